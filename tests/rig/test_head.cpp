#include "tests/rig/test_head.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace volto::test {
namespace {

using Eigen::Vector3d;

class HeadMaker {
 public:
  explicit HeadMaker(const TestHeadOptions& options) : options_(options), mask_(rig::referenceMask()) {
    if (options.closed_lips)
      for (const auto& [lower, upper] : {std::pair{"2.3", "2.2"}, std::pair{"2.8", "2.6"}, std::pair{"2.9", "2.7"}})
        mask_.row(index(lower)) = mask_.row(index(upper));
  }

  TestHead make() {
    head_.mesh.polygon_start = {0};
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      const std::uint32_t v = add(mask_.row(static_cast<Eigen::Index>(p)));
      head_.points[p] = v;
    }
    for (const rig::MaskTriangle& t : rig::maskTriangles()) subdivide(t[0], t[1], t[2], options_.subdivisions);
    addSkirt();
    mouthContour();
    if (options_.split_midline) splitMidline();
    if (options_.parts) addParts();
    finish();
    return std::move(head_);
  }

 private:
  static Eigen::Index index(const char* id) { return static_cast<Eigen::Index>(rig::featurePointIndex(id).value()); }
  Vector3d at(const char* id) const { return mask_.row(index(id)); }

  std::uint32_t add(const Vector3d& p) {
    positions_.push_back(p);
    return static_cast<std::uint32_t>(positions_.size() - 1);
  }
  void face(std::initializer_list<std::uint32_t> corners) {
    head_.mesh.corner_vertices.insert(head_.mesh.corner_vertices.end(), corners);
    head_.mesh.polygon_start.push_back(static_cast<std::uint32_t>(head_.mesh.corner_vertices.size()));
  }
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const auto [entry, fresh] = middle_.try_emplace(std::minmax(a, b), 0U);
    if (fresh) entry->second = add((positions_[a] + positions_[b]) / 2);
    return entry->second;
  }
  void subdivide(std::uint32_t a, std::uint32_t b, std::uint32_t c, int levels) {
    if (levels == 0) return face({a, b, c});
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    subdivide(a, ab, ca, levels - 1);
    subdivide(ab, b, bc, levels - 1);
    subdivide(ca, bc, c, levels - 1);
    subdivide(ab, bc, ca, levels - 1);
  }
  // The vertices along a mask edge from a to just before b.
  void alongEdge(std::uint32_t a, std::uint32_t b, int levels, std::vector<std::uint32_t>& out) {
    if (levels == 0) return out.push_back(a);
    const std::uint32_t m = middle(a, b);
    alongEdge(a, m, levels - 1, out);
    alongEdge(m, b, levels - 1, out);
  }
  template <class Loop>
  std::vector<std::uint32_t> alongLoop(const Loop& loop) {
    std::vector<std::uint32_t> out;
    for (std::size_t i = 0; i < loop.size(); ++i)
      alongEdge(loop[i], loop[(i + 1) % loop.size()], options_.subdivisions, out);
    return out;
  }

  // Rings of quads from the outline outward and back, as the scalp, the sides and the neck lie.
  void addSkirt() {
    const std::vector<std::uint32_t> outline = alongLoop(rig::maskLoops().outline);
    const Vector3d centre = at("9.3");
    head_.skirt_step = 8;
    std::vector<std::uint32_t> ring = outline;
    for (const std::uint32_t v : ring) head_.skirt.push_back({v});
    for (int r = 1; r <= 16; ++r) {
      std::vector<std::uint32_t> next;
      for (std::size_t i = 0; i < ring.size(); ++i) {
        Vector3d outward = positions_[outline[i]] - centre;
        outward.z() = 0;
        next.push_back(add(positions_[ring[i]] +
                           head_.skirt_step * (0.5 * outward.normalized() + Vector3d(0, 0, -1)).normalized()));
        head_.skirt[i].push_back(next.back());
      }
      // The outline runs 11.1, 11.3 (subject's left), ...: clockwise or not, the quads must continue the mask's
      // winding.
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const std::size_t j = (i + 1) % ring.size();
        const Vector3d normal =
            (positions_[ring[j]] - positions_[ring[i]]).cross(positions_[next[i]] - positions_[ring[i]]);
        Vector3d outward = positions_[ring[i]] - centre;
        if (normal.dot(outward) > 0)
          face({ring[i], ring[j], next[j], next[i]});
        else
          face({ring[i], next[i], next[j], ring[j]});
      }
      ring = next;
    }
  }

  void mouthContour() {
    const std::vector<std::uint32_t> loop = alongLoop(rig::maskLoops().mouth);
    const auto corner = [&](const char* id) {
      return std::find(loop.begin(), loop.end(), static_cast<std::uint32_t>(index(id))) - loop.begin();
    };
    const auto from = std::min(corner("2.4"), corner("2.5")), to = std::max(corner("2.4"), corner("2.5"));
    std::vector<std::uint32_t> between(loop.begin() + from + 1, loop.begin() + to),
        rest(loop.begin() + to + 1, loop.end());
    rest.insert(rest.end(), loop.begin(), loop.begin() + from);
    const bool upper_between =
        std::find(between.begin(), between.end(), static_cast<std::uint32_t>(index("2.2"))) != between.end();
    head_.upper_mouth = upper_between ? between : rest;
    head_.lower_mouth = upper_between ? rest : between;
  }

  void splitMidline() {
    std::map<std::uint32_t, std::uint32_t> twin;
    for (std::size_t p = 0; p + 1 < head_.mesh.polygon_start.size(); ++p) {
      double x = 0;
      for (std::uint32_t c = head_.mesh.polygon_start[p]; c < head_.mesh.polygon_start[p + 1]; ++c)
        x += positions_[head_.mesh.corner_vertices[c]].x();
      if (x <= 0) continue;
      for (std::uint32_t c = head_.mesh.polygon_start[p]; c < head_.mesh.polygon_start[p + 1]; ++c) {
        std::uint32_t& v = head_.mesh.corner_vertices[c];
        if (positions_[v].x() != 0) continue;
        if (!twin.contains(v)) twin[v] = add(positions_[v]);
        v = twin[v];
      }
    }
  }

  void box(const std::string& name, const Vector3d& centre, const Vector3d& half, int n = 3) {
    std::map<std::array<int, 3>, std::uint32_t> grid;
    const auto vertex = [&](int x, int y, int z) {
      const auto [entry, fresh] = grid.try_emplace({x, y, z}, 0U);
      if (fresh) {
        entry->second = add(centre + half.cwiseProduct(Vector3d(2.0 * x / n - 1, 2.0 * y / n - 1, 2.0 * z / n - 1)));
        head_.parts[name].push_back(entry->second);
      }
      return entry->second;
    };
    for (int side : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          face({vertex(side, i, j), vertex(side, i + 1, j), vertex(side, i + 1, j + 1), vertex(side, i, j + 1)});
          face({vertex(i, side, j), vertex(i + 1, side, j), vertex(i + 1, side, j + 1), vertex(i, side, j + 1)});
          face({vertex(i, j, side), vertex(i + 1, j, side), vertex(i + 1, j + 1, side), vertex(i, j + 1, side)});
        }
  }

  void sphere(const std::string& name, const Vector3d& centre, double radius) {
    constexpr int kRings = 8, kSectors = 12;
    std::vector<std::vector<std::uint32_t>> rings;
    for (int r = 1; r < kRings; ++r) {
      rings.emplace_back();
      for (int s = 0; s < kSectors; ++s) {
        const double theta = M_PI * r / kRings, phi = 2 * M_PI * s / kSectors;
        rings.back().push_back(add(centre + radius * Vector3d(std::sin(theta) * std::cos(phi), std::cos(theta),
                                                              std::sin(theta) * std::sin(phi))));
        head_.parts[name].push_back(rings.back().back());
      }
    }
    for (std::size_t r = 1; r < rings.size(); ++r)
      for (std::size_t s = 0; s < kSectors; ++s)
        face({rings[r - 1][s], rings[r - 1][(s + 1) % kSectors], rings[r][(s + 1) % kSectors], rings[r][s]});
  }

  // A strip from the lid margin forward, as lashes are drawn.
  void lash(const std::string& name, std::initializer_list<const char*> margin, double up) {
    std::vector<std::uint32_t> roots, tips;
    for (const char* id : margin) {
      roots.push_back(add(at(id) + Vector3d(0, 0.1 * up, 0.2)));
      tips.push_back(add(at(id) + Vector3d(0, 3 * up, 7)));
      head_.parts[name].insert(head_.parts[name].end(), {roots.back(), tips.back()});
    }
    for (std::size_t i = 1; i < roots.size(); ++i) face({roots[i - 1], roots[i], tips[i], tips[i - 1]});
  }

  void addParts() {
    const double radius = 12.5;
    sphere("left eye", (at("3.7") + at("3.11")) / 2 + Vector3d(0, 0, -8), radius);
    sphere("right eye", (at("3.8") + at("3.12")) / 2 + Vector3d(0, 0, -8), radius);
    const Vector3d mouth = (at("2.2") + at("2.3")) / 2;
    box("upper teeth", mouth + Vector3d(0, 5.5, -12), Vector3d(18, 4.5, 6));
    box("lower teeth", mouth + Vector3d(0, -6, -13), Vector3d(16, 4.5, 6));
    box("tongue", mouth + Vector3d(0, -3, -32), Vector3d(11, 4, 18));
    lash("left upper lash", {"3.11", "12.5", "3.1", "12.6", "3.7"}, 1);
    lash("left lower lash", {"3.11", "12.7", "3.3", "12.8", "3.7"}, -1);
    box("hair", at("11.1") + Vector3d(0, 70, -30), Vector3d(60, 20, 60));
  }

  void finish() {
    head_.mesh.positions.resize(static_cast<Eigen::Index>(positions_.size()), 3);
    for (std::size_t v = 0; v < positions_.size(); ++v)
      head_.mesh.positions.row(static_cast<Eigen::Index>(v)) = positions_[v];
    for (auto& [name, vertices] : head_.parts) std::sort(vertices.begin(), vertices.end());
  }

  TestHeadOptions options_;
  rig::FeaturePointPositions mask_;
  std::vector<Vector3d> positions_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle_;
  TestHead head_;
};

}  // namespace

TestHead makeTestHead(const TestHeadOptions& options) { return HeadMaker(options).make(); }

std::array<double, kFeaturePointCount> rowOf(const rig::Rig& rig, std::uint32_t vertex) {
  std::array<double, kFeaturePointCount> row{};
  for (std::uint32_t i = rig.deformation.row_start[vertex]; i < rig.deformation.row_start[vertex + 1]; ++i)
    row[rig.deformation.point[i]] = static_cast<double>(rig.deformation.weight[i]);
  return row;
}

rig::VertexPositions deform(const rig::Rig& rig, const rig::FeaturePointPositions& displacement) {
  rig::VertexPositions out = rig::VertexPositions::Zero(rig.neutral.positions.rows(), 3);
  for (std::size_t v = 0; v < rig.deformation.vertexCount(); ++v)
    for (std::uint32_t i = rig.deformation.row_start[v]; i < rig.deformation.row_start[v + 1]; ++i)
      out.row(static_cast<Eigen::Index>(v)) +=
          static_cast<double>(rig.deformation.weight[i]) * displacement.row(rig.deformation.point[i]);
  return out;
}

}  // namespace volto::test
