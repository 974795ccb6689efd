#include "rig/assets/head/texture.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

namespace volto::head {
namespace {

constexpr double kPi = 3.14159265358979323846;
using Uv = std::array<double, 2>;

struct Rectangle {
  double u, v, width, height;
};
// In the right half of the atlas; what joins its mirror image begins at u = 0.5.
constexpr Rectangle kPlaces[] = {
    {0.500, 0.300, 0.495, 0.695},  // face
    {0.580, 0.165, 0.120, 0.125},  // ear
    {0.850, 0.165, 0.125, 0.125},  // lids
    {0.500, 0.165, 0.065, 0.125},  // mouth
    {0.715, 0.165, 0.125, 0.125},  // eyeball
    {0.500, 0.120, 0.130, 0.040},  // upper teeth
    {0.500, 0.075, 0.130, 0.040},  // lower teeth
    {0.500, 0.005, 0.080, 0.065},  // tongue
    {0.650, 0.075, 0.200, 0.030},  // lashes
    {0.650, 0.115, 0.200, 0.045},  // brow
};

// The polygons of one chart into its rectangle; turned over where they face away.
void fit(std::vector<Polygon*>& polygons, Chart chart) {
  double low_u = 1e9, high_u = -1e9, low_v = 1e9, high_v = -1e9, area = 0;
  for (const Polygon* polygon : polygons)
    for (std::size_t i = 0; i < polygon->uv.size(); ++i) {
      const Uv &a = polygon->uv[i], &b = polygon->uv[(i + 1) % polygon->uv.size()];
      area += a[0] * b[1] - a[1] * b[0];
      low_u = std::min(low_u, a[0]);
      high_u = std::max(high_u, a[0]);
      low_v = std::min(low_v, a[1]);
      high_v = std::max(high_v, a[1]);
    }
  const Rectangle& place = kPlaces[static_cast<std::size_t>(chart)];
  for (Polygon* polygon : polygons)
    for (Uv& uv : polygon->uv) {
      const double u = (uv[0] - low_u) / (high_u - low_u), v = (uv[1] - low_v) / (high_v - low_v);
      uv = {place.u + place.width * u, place.v + place.height * (area < 0 ? 1 - v : v)};
    }
}

Chart chartOf(const HalfMesh& skin, const Polygon& polygon) {
  if (polygon.material == Material::caruncle) return Chart::lids;
  if (polygon.material == Material::mouth) return Chart::mouth;
  // The ear from its root outward, the cap over its hollow included.
  bool ear = true;
  for (const int c : polygon.corners) {
    const HalfVertex& v = skin.vertices[static_cast<std::size_t>(c)];
    const bool cap = v.hold == Hold::linear && v.position.x > 5;
    ear = ear && (cap || (v.strip == Strip::ear && v.ring >= kEarRoot));
  }
  return ear ? Chart::ear : Chart::face;
}

// Rings as circles; vertices without strip coordinates (caps) go to the middle of their neighbours.
void unwrapRings(const HalfMesh& skin, std::vector<Polygon*>& polygons, double first, double last, double inner,
                 double around_full_turn) {
  std::map<int, Uv> at;
  std::map<int, std::vector<int>> caps;
  for (const Polygon* polygon : polygons)
    for (std::size_t i = 0; i < polygon->corners.size(); ++i) {
      const int c = polygon->corners[i];
      const HalfVertex& v = skin.vertices[static_cast<std::size_t>(c)];
      if (v.hold == Hold::linear) {
        const std::size_t n = polygon->corners.size();
        caps[c].push_back(polygon->corners[(i + 1) % n]);
        caps[c].push_back(polygon->corners[(i + n - 1) % n]);
        at.try_emplace(c, Uv{0, 0});
        continue;
      }
      const double radius = lerp(1.0, inner, (v.ring - first) / (last - first));
      const double angle = kPi / 2 - 2 * kPi * v.around / around_full_turn;
      at[c] = {radius * std::cos(angle), radius * std::sin(angle)};
      if (v.midline) at[c][0] = 0;
    }
  for (int round = 0; round < 400; ++round)
    for (const auto& [c, neighbours] : caps) {
      Uv sum{0, 0};
      for (const int n : neighbours) sum = {sum[0] + at[n][0], sum[1] + at[n][1]};
      const double count = static_cast<double>(neighbours.size());
      at[c] = {skin.vertices[static_cast<std::size_t>(c)].midline ? 0 : sum[0] / count, sum[1] / count};
    }
  for (Polygon* polygon : polygons)
    for (const int c : polygon->corners) polygon->uv.push_back(at[c]);
}

class FaceUnwrapper {
 public:
  FaceUnwrapper(const HalfMesh& skin, const std::vector<Polygon*>& polygons) : skin_(skin), polygons_(polygons) {}

  void run() {
    const std::size_t n = skin_.vertices.size();
    for (const HalfVertex& v : skin_.vertices) position_.push_back(v.position);
    middle_.assign(n, false);
    std::map<std::pair<int, int>, bool> edges;  // directed
    for (const Polygon* polygon : polygons_) {
      for (std::size_t i = 0; i < polygon->corners.size(); ++i)
        edges[{polygon->corners[i], polygon->corners[(i + 1) % polygon->corners.size()]}] = true;
      for (std::size_t i = 1; i + 1 < polygon->corners.size(); ++i)
        triangles_.push_back({polygon->corners[0], polygon->corners[i], polygon->corners[i + 1]});
    }
    std::map<int, int> next;  // along borders, the surface on the left
    for (const auto& [edge, unused] : edges)
      if (!edges.contains({edge.second, edge.first})) next[edge.first] = edge.second;
    layBorders(next);
    solve();
    for (Polygon* polygon : polygons_)
      for (const int c : polygon->corners) polygon->uv.push_back(at_[static_cast<std::size_t>(c)]);
  }

 private:
  const HalfVertex& vertex(int v) const { return skin_.vertices[static_cast<std::size_t>(v)]; }

  // The half's one long border runs down the front, along the neck, up the back; holes are filled.
  void layBorders(std::map<int, int> next) {
    at_.assign(position_.size(), Uv{0.3, 0});
    fixed_.assign(position_.size(), false);
    while (!next.empty()) {
      std::vector<int> loop;
      const int start = next.begin()->first;
      for (int v = start; next.contains(v);) {
        loop.push_back(v);
        const int following = next[v];
        next.erase(v);
        v = following;
      }
      const bool outer = std::any_of(loop.begin(), loop.end(), [this](int v) { return vertex(v).border; });
      if (outer)
        layOutline(loop);
      else
        fillHole(loop, false);
    }
  }

  void layOutline(std::vector<int> loop) {
    // Counter-clockwise seen from in front, the left half on the right: down the front's midline (with the mouth
    // between), along the neck to the nape, up and over the crown.
    const std::size_t n = loop.size();
    const auto is_neck_front = [&](int v) { return vertex(v).border && vertex(v).midline && vertex(v).position.z > 0; };
    const auto first = std::find_if(loop.begin(), loop.end(), is_neck_front);
    if (first == loop.end()) throw std::logic_error("head: no neck border to unwrap");
    std::rotate(loop.begin(), first, loop.end());
    // The cut ends in the middle of the hair line.
    const auto ends_cut = [&](int v) { return vertex(v).position.z > 0 && vertex(v).position.y < kCutHeight; };
    std::size_t cut = 1;
    while (cut < n && (vertex(loop[cut]).border || !vertex(loop[cut]).midline ||
                       vertex(loop[cut]).position.y < kCutHeight || vertex(loop[cut]).position.z < 0))
      ++cut;
    while (cut < n && !ends_cut(loop[cut])) ++cut;
    std::vector<double> along{0};
    for (std::size_t i = 1; i <= cut; ++i)
      along.push_back(along.back() + length(vertex(loop[i]).position - vertex(loop[i - 1]).position));
    for (std::size_t i = 0; i <= cut; ++i) {
      const double t = -kPi / 2 + kPi * along[i] / along[cut];
      // A rounded rectangle, strictly convex.
      const double c = std::cos(t), s = std::sin(t), power = 0.62;
      Uv uv{std::pow(std::fabs(c), power), (s < 0 ? -1 : 1) * std::pow(std::fabs(s), power) * 1.4};
      if (i == 0 || i == cut) uv[0] = 0;
      pin(loop[i], uv);
    }
    // The front's midline: free to slide along u = 0. The mouth is a gap in it, between the two lips.
    std::vector<int> lips;
    for (std::size_t i = cut; i < n; ++i) {
      const int v = loop[i];
      if (vertex(v).midline) {
        middle_[static_cast<std::size_t>(v)] = true;
        at_[static_cast<std::size_t>(v)][0] = 0;
      }
    }
    for (std::size_t i = cut; i < n; ++i) {
      const bool lip = !vertex(loop[i]).midline;
      if (lip && lips.empty()) lips.push_back(loop[i - 1]);
      if (lip) lips.push_back(loop[i]);
      if (!lip && !lips.empty()) {
        lips.push_back(loop[i]);
        fillHole(lips, true);
        lips.clear();
      }
    }
  }

  void pin(int v, const Uv& uv) {
    at_[static_cast<std::size_t>(v)] = uv;
    fixed_[static_cast<std::size_t>(v)] = true;
  }

  // A fan about a vertex in the middle; `open`: one half of a hole across the midline.
  void fillHole(const std::vector<int>& loop, bool open) {
    const int centre = static_cast<int>(position_.size());
    Vec3 sum;
    for (const int v : loop) sum = sum + position_[static_cast<std::size_t>(v)];
    sum = sum * (1.0 / static_cast<double>(loop.size()));
    if (open) sum.x = 0;
    position_.push_back(sum);
    at_.push_back({open ? 0 : 0.3, 0});
    fixed_.push_back(false);
    middle_.push_back(open);
    for (std::size_t i = 0; i + (open ? 1 : 0) < loop.size(); ++i)
      triangles_.push_back({loop[(i + 1) % loop.size()], loop[i], centre});
  }

  void solve() {
    struct Pull {
      int to;
      double weight;
    };
    std::vector<std::vector<Pull>> pulls(position_.size());
    const auto pull = [&](int from, int to, double weight) {
      for (Pull& p : pulls[static_cast<std::size_t>(from)])
        if (p.to == to) {
          p.weight += weight;
          return;
        }
      pulls[static_cast<std::size_t>(from)].push_back({to, weight});
    };
    for (const auto& t : triangles_)
      for (std::size_t k = 0; k < 3; ++k) {
        const int a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
        const Vec3 ab = position_[static_cast<std::size_t>(b)] - position_[static_cast<std::size_t>(a)];
        const Vec3 ac = position_[static_cast<std::size_t>(c)] - position_[static_cast<std::size_t>(a)];
        const double lb = std::max(length(ab), 1e-6), lc = std::max(length(ac), 1e-6);
        const double angle = std::acos(std::max(-1.0, std::min(1.0, dot(ab, ac) / (lb * lc))));
        const double half = std::tan(0.5 * std::max(0.02, std::min(2.8, angle)));
        pull(a, b, half / lb);
        pull(a, c, half / lc);
      }
    // Successive over-relaxation, in a fixed order.
    constexpr double kOver = 1.6;
    for (int round = 0; round < 10000; ++round) {
      double largest = 0;
      for (std::size_t i = 0; i < pulls.size(); ++i) {
        if (fixed_[i] || pulls[i].empty()) continue;
        double u = 0, v = 0, weight = 0;
        for (const Pull& p : pulls[i]) {
          u += p.weight * at_[static_cast<std::size_t>(p.to)][0];
          v += p.weight * at_[static_cast<std::size_t>(p.to)][1];
          weight += p.weight;
        }
        const double du = middle_[i] ? 0 : u / weight - at_[i][0], dv = v / weight - at_[i][1];
        at_[i] = {at_[i][0] + kOver * du, at_[i][1] + kOver * dv};
        largest = std::max({largest, std::fabs(du), std::fabs(dv)});
      }
      if (largest < 1e-6) break;
    }
  }

  static constexpr double kCutHeight = 6.9;  // the hair line is at 6.5

  const HalfMesh& skin_;
  const std::vector<Polygon*>& polygons_;
  std::vector<Vec3> position_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<Uv> at_;
  std::vector<bool> fixed_, middle_;
};

}  // namespace

void unwrapSkin(HalfMesh& skin) {
  std::map<Chart, std::vector<Polygon*>> charts;
  for (Polygon& polygon : skin.polygons) {
    polygon.uv.clear();
    charts[chartOf(skin, polygon)].push_back(&polygon);
  }
  FaceUnwrapper(skin, charts[Chart::face]).run();
  unwrapRings(skin, charts[Chart::ear], kEarRoot, kEarFloor, 0.25, kEarAround);
  unwrapRings(skin, charts[Chart::lids], kLidMarginFront, kLidPocket, 0.45, kEyeAround);
  unwrapRings(skin, charts[Chart::mouth], kLipRim, kMouthBack, 0.35, 2 * kMouthAround);
  for (auto& [chart, polygons] : charts) fit(polygons, chart);
}

void placeChart(HalfMesh& part, Chart chart) {
  std::vector<Polygon*> polygons;
  for (Polygon& polygon : part.polygons) polygons.push_back(&polygon);
  fit(polygons, chart);
}

}  // namespace volto::head
