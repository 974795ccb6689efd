#include "rig/find_contacts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include <Eigen/Geometry>

#include "rig/closest_point.h"

namespace volto::rig {
namespace {

constexpr std::size_t kMouthColumns = 41, kEyeColumns = 25;

double smoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

std::array<float, 3> toFloat(const Eigen::Vector3d& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

struct SlitPoints {
  SlitContact::Place place;
  SlitSide upper_side, lower_side;
  std::array<std::string_view, 5> upper, lower;  // from the subject's right to left, with both corners
  std::string_view upper_extent, lower_extent;   // where lip or lid ends
};
constexpr std::array<SlitPoints, 3> kSlits = {{
    {SlitContact::Place::mouth,
     SlitSide::upper_lip,
     SlitSide::lower_lip,
     {"2.5", "2.7", "2.2", "2.6", "2.4"},
     {"2.5", "2.9", "2.3", "2.8", "2.4"},
     "9.15",
     "2.10"},
    {SlitContact::Place::left_eye,
     SlitSide::left_upper_lid,
     SlitSide::left_lower_lid,
     {"3.11", "12.5", "3.1", "12.6", "3.7"},
     {"3.11", "12.7", "3.3", "12.8", "3.7"},
     "3.13",
     "3.9"},
    {SlitContact::Place::right_eye,
     SlitSide::right_upper_lid,
     SlitSide::right_lower_lid,
     {"3.12", "12.10", "3.2", "12.9", "3.8"},
     {"3.12", "12.12", "3.4", "12.11", "3.8"},
     "3.14",
     "3.10"},
}};

class ContactFinder {
 public:
  ContactFinder(const Rig& rig, const Skin& skin, const SkinAssociation& association, const SkinPoints& on_skin)
      : rig_(rig),
        skin_(skin),
        association_(association),
        on_skin_(on_skin),
        at_(rig.neutral.positions),
        es_(rig.fapu.fapu.eye_separation) {}

  Contacts find() {
    findBalls();
    for (const SlitPoints& points : kSlits) findSlit(points);
    findRiders();
    return std::move(out_);
  }

 private:
  Eigen::Vector3d position(std::uint32_t v) const { return at_.row(v).transpose(); }
  Eigen::Vector3d point(std::string_view id) const {
    return rig_.feature_positions.row(static_cast<Eigen::Index>(featurePointIndex(id).value()));
  }
  std::uint32_t skinVertex(std::string_view id) const {
    const SkinPoint& p = on_skin_[featurePointIndex(id).value()];
    const auto nearest = std::min_element(p.around.begin(), p.around.end(),
                                          [](const auto& a, const auto& b) { return a.distance < b.distance; });
    return nearest->vertex;
  }
  bool moves(std::uint32_t v) const { return rig_.deformation.row_start[v] < rig_.deformation.row_start[v + 1]; }
  bool isSkin(std::uint32_t v) const {
    return association_.kind[v] == AssociationKind::ray || association_.kind[v] == AssociationKind::geodesic;
  }

  // --- eyeballs

  void findBalls() {
    for (const auto follows : {RigidPart::Follows::right_eye, RigidPart::Follows::left_eye}) {
      std::optional<BallContact> ball;
      Eigen::Vector3d centre = Eigen::Vector3d::Zero();
      double radius = 0;
      for (const RigidPart& part : rig_.rigid_parts) {
        if (part.follows != follows) continue;
        if (!ball) {
          ball.emplace();
          centre = Eigen::Map<const Eigen::Vector3d>(part.centre.data());
        }
        for (const std::uint32_t v : part.vertices) radius = std::max(radius, (position(v) - centre).norm());
      }
      ball_of_[follows == RigidPart::Follows::left_eye] = -1;
      if (!ball || !(radius > 0)) continue;
      ball->centre = toFloat(centre);
      ball->radius = static_cast<float>(radius);
      for (std::uint32_t v = 0; v < at_.rows(); ++v) {
        if (!isSkin(v) || !moves(v)) continue;
        const double distance = (position(v) - centre).norm();
        if (distance > 2 * radius || distance < 0.3 * radius) continue;
        // Near the ball a vertex keeps its own distance; farther out less and less of it.
        const double near = 1.15 * radius, width = 0.5 * radius, beyond = std::max(0.0, distance - near) / width;
        const double kept = std::min(distance, near) + width * beyond / (1 + beyond);
        ball->vertex.push_back(v);
        ball->distance.push_back(static_cast<float>(kept * (1 - 2e-6)));
      }
      ball_of_[follows == RigidPart::Follows::left_eye] = static_cast<std::int32_t>(out_.balls.size());
      out_.balls.push_back(std::move(*ball));
    }
  }

  // --- lips and lids

  // Shortest way along the skin through the points; empty where it cannot be found.
  std::vector<std::uint32_t> margin(const std::array<std::string_view, 5>& ids) const {
    std::vector<std::uint32_t> path = {skinVertex(ids[0])};
    for (std::size_t i = 1; i < ids.size(); ++i) {
      const std::uint32_t from = skinVertex(ids[i]);
      const GeodesicSource source{from, 0.0F};
      const auto limit = static_cast<float>(3 * (position(from) - position(path.back())).norm() + 0.2 * es_);
      const std::vector<float> distance = geodesicDistances(skin_.graph, {&source, 1}, limit).distance;
      if (!(distance[path.back()] < kUnreached)) return {};
      while (path.back() != from) {
        const std::uint32_t v = path.back();
        std::uint32_t next = v;
        float best = distance[v];
        for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e) {
          const std::uint32_t u = skin_.graph.neighbour[e];
          if (distance[u] < best) {
            // On the shortest way: distance[v] = length + distance[u], up to rounding.
            if (distance[u] + skin_.graph.length[e] <= distance[v] * (1 + 1e-5F)) {
              best = distance[u];
              next = u;
            }
          }
        }
        if (next == v) return {};
        path.push_back(next);
      }
    }
    return path;
  }

  // Where the margin passes each column. `along`: from corner to corner, 0..1.
  template <class Along>
  std::vector<SlitContact::Sample> samples(const std::vector<std::uint32_t>& path, std::size_t columns,
                                           const Along& along) const {
    std::vector<SlitContact::Sample> out;
    std::size_t k = 0;
    for (std::size_t j = 0; j < columns; ++j) {
      const double t = static_cast<double>(j) / static_cast<double>(columns - 1);
      while (k + 2 < path.size() && along(path[k + 1]) < t) ++k;
      const double a = along(path[k]), b = along(path[k + 1]);
      const double share = b > a ? std::clamp((t - a) / (b - a), 0.0, 1.0) : 0.0;
      out.push_back({path[k], path[k + 1], static_cast<float>(share)});
    }
    return out;
  }

  void findSlit(const SlitPoints& points) {
    const std::vector<std::uint32_t> upper = margin(points.upper), lower = margin(points.lower);
    if (upper.size() < 3 || lower.size() < 3) return;
    const Eigen::Vector3d from = point(points.upper[0]), to = point(points.upper[4]);
    const double length2 = (to - from).squaredNorm();
    if (!(length2 > 0)) return;
    const auto along = [&](std::uint32_t v) { return (position(v) - from).dot(to - from) / length2; };
    const Eigen::Vector3d head_up = rig_.mesh_from_head.col(1);
    const Eigen::Vector3d up = (head_up - (to - from) * head_up.dot(to - from) / length2).normalized();
    if (!up.allFinite()) return;

    SlitContact slit;
    slit.place = points.place;
    const bool mouth = points.place == SlitContact::Place::mouth;
    slit.ball = mouth ? -1 : ball_of_[points.place == SlitContact::Place::left_eye];
    slit.up = toFloat(up);
    slit.upper_share = mouth ? 0.5F : 0.8F;
    const std::size_t columns = mouth ? kMouthColumns : kEyeColumns;
    slit.upper = samples(upper, columns, along);
    slit.lower = samples(lower, columns, along);
    std::vector<double> upper_height, lower_height;
    for (std::size_t j = 0; j < columns; ++j) {
      const auto height = [&](const SlitContact::Sample& s) {
        const double a = up.dot(position(s.first)), b = up.dot(position(s.second));
        return a + static_cast<double>(s.share_of_second) * (b - a);
      };
      upper_height.push_back(height(slit.upper[j]));
      lower_height.push_back(height(slit.lower[j]));
      slit.least_gap.push_back(static_cast<float>(std::min(0.0, upper_height[j] - lower_height[j]) - 1e-6 * es_));
    }
    addSide(points.upper_side, upper, 1.0, (point(points.upper_extent) - point(points.upper[2])).norm(), along, up,
            lower_height, slit);
    addSide(points.lower_side, lower, -1.0, (point(points.lower_extent) - point(points.lower[2])).norm(), along, up,
            upper_height, slit);
    sortVertices(slit);
    if (!slit.vertex.empty()) out_.slits.push_back(std::move(slit));
  }

  template <class Along>
  void addSide(SlitSide side, const std::vector<std::uint32_t>& path, double sign, double extent, const Along& along,
               const Eigen::Vector3d& up, const std::vector<double>& other_height, SlitContact& slit) const {
    const bool mouth = slit.place == SlitContact::Place::mouth;
    const double fade = std::max(mouth ? 0.9 * extent : 1.4 * extent, (mouth ? 0.15 : 0.08) * es_);
    std::vector<GeodesicSource> sources;
    for (const std::uint32_t v : path) sources.push_back({v, 0.0F});
    const std::vector<float> distance = geodesicDistances(skin_.graph, sources, static_cast<float>(fade)).distance;
    const double columns = static_cast<double>(other_height.size());
    for (std::uint32_t v = 0; v < at_.rows(); ++v) {
      const std::uint32_t s = skin_.same_as[v];
      if (!isSkin(v) || !moves(v) || !(distance[s] < kUnreached)) continue;
      if (association_.side[v] != side && distance[s] > 0) continue;
      const double share = 1 - smoothStep(static_cast<double>(distance[s]) / fade);
      if (share < 1e-3) continue;
      const double column = std::clamp(along(v), 0.0, 1.0) * (columns - 1);
      const auto j = std::min(static_cast<std::size_t>(column), other_height.size() - 2);
      const double t = column - static_cast<double>(j);
      const double other = other_height[j] + t * (other_height[j + 1] - other_height[j]);
      slit.vertex.push_back(v);
      slit.column.push_back(static_cast<float>(column));
      slit.share.push_back(static_cast<float>(sign * share));
      slit.reach.push_back(static_cast<float>(std::min(0.0, sign * (up.dot(position(v)) - other)) - 2e-6 * es_));
    }
  }

  // Ascending; a corner, which both sides hold, gives way to neither.
  static void sortVertices(SlitContact& slit) {
    std::vector<std::size_t> order(slit.vertex.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return slit.vertex[a] < slit.vertex[b]; });
    SlitContact sorted = slit;
    sorted.vertex.clear();
    sorted.column.clear();
    sorted.share.clear();
    sorted.reach.clear();
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::uint32_t v = slit.vertex[order[i]];
      if (i + 1 < order.size() && slit.vertex[order[i + 1]] == v) {
        ++i;
        continue;
      }
      sorted.vertex.push_back(v);
      sorted.column.push_back(slit.column[order[i]]);
      sorted.share.push_back(slit.share[order[i]]);
      sorted.reach.push_back(slit.reach[order[i]]);
    }
    slit = std::move(sorted);
  }

  // --- lashes, brows, wet edges

  void findRiders() {
    std::vector<std::array<std::uint32_t, 3>> skin;
    for (const auto& t : skin_.triangles)
      if (isSkin(t[0]) && isSkin(t[1]) && isSkin(t[2])) skin.push_back(t);
    if (skin.empty()) return;
    const ClosestPoint surface(at_, skin);
    for (const RigidPart& part : rig_.rigid_parts)
      if (part.follows == RigidPart::Follows::skin) addRiders(part, surface, skin);
    std::sort(out_.riders.begin(), out_.riders.end(),
              [](const Rider& a, const Rider& b) { return a.vertex < b.vertex; });
  }

  // The lid that most of the part's own rows follow.
  SlitSide lidOf(const RigidPart& part) const {
    std::array<double, 7> following{};
    for (const std::uint32_t v : part.vertices)
      for (std::uint32_t e = rig_.deformation.row_start[v]; e < rig_.deformation.row_start[v + 1]; ++e)
        following[static_cast<std::size_t>(slitSide(rig_.deformation.point[e]))] +=
            static_cast<double>(rig_.deformation.weight[e]);
    double total = 0;
    for (const std::uint32_t v : part.vertices)
      for (std::uint32_t e = rig_.deformation.row_start[v]; e < rig_.deformation.row_start[v + 1]; ++e)
        total += static_cast<double>(rig_.deformation.weight[e]);
    const auto most = std::max_element(following.begin() + 3, following.end());  // lids alone
    return *most > 0.3 * total ? static_cast<SlitSide>(most - following.begin()) : SlitSide::none;
  }

  void addRiders(const RigidPart& part, const ClosestPoint& all,
                 const std::vector<std::array<std::uint32_t, 3>>& skin) {
    const double near = 0.1 * es_;
    const SlitSide lid = lidOf(part);
    std::optional<ClosestPoint> one_side;
    if (lid != SlitSide::none) {
      std::vector<std::array<std::uint32_t, 3>> triangles;
      for (const auto& t : skin)
        if (std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return opposite(association_.side[v], lid); }))
          triangles.push_back(t);
      if (triangles.empty()) return;
      one_side.emplace(at_, std::move(triangles));
    }
    const ClosestPoint& surface = one_side ? *one_side : all;
    std::vector<SurfacePoint> nearest;
    double closest = near;
    Eigen::Vector3d low = position(part.vertices.front()), high = low;
    for (const std::uint32_t v : part.vertices) {
      nearest.push_back(surface.find(position(v), near));
      if (nearest.back().triangle >= 0) closest = std::min(closest, nearest.back().distance);
      low = low.cwiseMin(position(v));
      high = high.cwiseMax(position(v));
    }
    if (!(closest < near)) return;
    // A lash grows from its lid: what stands away from the skin goes with the nearest root.
    const bool by_roots = lid != SlitSide::none && (high - low).norm() < 0.9 * es_;
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < nearest.size(); ++i)
      if (nearest[i].triangle >= 0 && nearest[i].distance < closest + 0.015 * es_) roots.push_back(i);
    const bool left = lid == SlitSide::left_upper_lid || lid == SlitSide::left_lower_lid;
    for (std::size_t i = 0; i < part.vertices.size(); ++i) {
      std::size_t root = i;
      if (by_roots)
        root = *std::min_element(roots.begin(), roots.end(), [&](std::size_t a, std::size_t b) {
          const Eigen::Vector3d p = position(part.vertices[i]);
          return (position(part.vertices[a]) - p).squaredNorm() < (position(part.vertices[b]) - p).squaredNorm();
        });
      if (nearest[root].triangle < 0 || !moves(part.vertices[i])) continue;
      Rider rider;
      rider.vertex = part.vertices[i];
      rider.anchor = surface.triangle(nearest[root].triangle);
      for (std::size_t k = 0; k < 3; ++k) rider.weight[k] = static_cast<float>(nearest[root].barycentric[k]);
      rider.ball = lid == SlitSide::none ? -1 : ball_of_[left];
      out_.riders.push_back(rider);
    }
  }

  const Rig& rig_;
  const Skin& skin_;
  const SkinAssociation& association_;
  const SkinPoints& on_skin_;
  const VertexPositions& at_;
  double es_;
  std::array<std::int32_t, 2> ball_of_{-1, -1};  // right, left
  Contacts out_;
};

}  // namespace

Contacts findContacts(const Rig& rig, const Skin& skin, const SkinAssociation& association, const SkinPoints& on_skin) {
  return ContactFinder(rig, skin, association, on_skin).find();
}

}  // namespace volto::rig
