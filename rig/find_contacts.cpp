#include "rig/find_contacts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "rig/pose.h"

namespace volto::rig {
namespace {

constexpr std::size_t kMouthColumns = 61, kEyeColumns = 41;

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

  // A smooth curve through the points (Catmull and Rom), dense.
  std::vector<Eigen::Vector3d> curve(const std::array<std::string_view, 5>& ids) const {
    constexpr int kSteps = 16;
    std::vector<Eigen::Vector3d> out;
    for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
      const Eigen::Vector3d b = point(ids[i]), c = point(ids[i + 1]);
      const Eigen::Vector3d a = i > 0 ? point(ids[i - 1]) : Eigen::Vector3d(2 * b - c);
      const Eigen::Vector3d d = i + 2 < ids.size() ? point(ids[i + 2]) : Eigen::Vector3d(2 * c - b);
      for (int k = 0; k < kSteps; ++k) {
        const double f = static_cast<double>(k) / kSteps;
        out.push_back(b + 0.5 * f * (c - a + f * (2 * a - 5 * b + 4 * c - d + f * (3 * (b - c) + d - a))));
      }
    }
    out.push_back(point(ids.back()));
    return out;
  }

  // The skin's edges, each the longer the farther it is from the curve: behind a lid's or lip's edge the way is shorter
  // in itself.
  EdgeGraph graphAlong(const std::vector<Eigen::Vector3d>& curve) const {
    const double near = 0.01 * es_, far = 0.3 * es_;
    EdgeGraph out = skin_.graph;
    std::vector<double> distance(static_cast<std::size_t>(at_.rows()), far);
    Eigen::Vector3d low = curve.front(), high = low;
    for (const Eigen::Vector3d& c : curve) {
      low = low.cwiseMin(c);
      high = high.cwiseMax(c);
    }
    for (std::uint32_t v = 0; v < distance.size(); ++v) {
      const Eigen::Vector3d p = position(v);
      if (((p - low).array() < -far).any() || ((p - high).array() > far).any()) continue;
      for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
        const double t = shareOnSegment(p, curve[i], curve[i + 1]);
        distance[v] = std::min(distance[v], (p - curve[i] - t * (curve[i + 1] - curve[i])).norm());
      }
    }
    for (std::uint32_t v = 0; v < distance.size(); ++v)
      for (std::uint32_t e = out.start[v]; e < out.start[v + 1]; ++e) {
        const double off = 0.5 * (distance[v] + distance[out.neighbour[e]]) / near;
        out.length[e] = static_cast<float>(static_cast<double>(out.length[e]) * (1 + off * off));
      }
    return out;
  }

  // Along the skin through the points, near a smooth curve through them; empty where there is no way.
  std::vector<std::uint32_t> margin(const std::array<std::string_view, 5>& ids) const {
    const EdgeGraph graph = graphAlong(curve(ids));
    std::vector<std::uint32_t> path = {skinVertex(ids[0])};
    for (std::size_t i = 1; i < ids.size(); ++i) {
      const std::uint32_t from = skinVertex(ids[i]);
      const GeodesicSource source{from, 0.0F};
      // A hundred times: a coarse mesh has no vertices near the curve.
      const auto limit = static_cast<float>(100 * (3 * (position(from) - position(path.back())).norm() + 0.2 * es_));
      const std::vector<float> distance = geodesicDistances(graph, {&source, 1}, limit).distance;
      if (!(distance[path.back()] < kUnreached)) return {};
      while (path.back() != from) {
        const std::uint32_t v = path.back();
        std::uint32_t next = v;
        float best = distance[v];
        for (std::uint32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
          const std::uint32_t u = graph.neighbour[e];
          if (distance[u] < best) {
            // On the shortest way: distance[v] = length + distance[u], up to rounding.
            if (distance[u] + graph.length[e] <= distance[v] * (1 + 1e-5F)) {
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
    }
    slit.least_gap.resize(columns);
    const std::array<float, kMaxSlitColumns> gaps = slitGaps(slit, neutralPositions(rig_));
    for (std::size_t j = 0; j < columns; ++j)
      slit.least_gap[j] = std::min(0.0F, gaps[j]) - static_cast<float>(1e-5 * es_);
    addSide(points.upper_side, upper, 1.0, (point(points.upper_extent) - point(points.upper[2])).norm(), along, up,
            lower_height, slit);
    addSide(points.lower_side, lower, -1.0, (point(points.lower_extent) - point(points.lower[2])).norm(), along, up,
            upper_height, slit);
    sortVertices(slit);
    if (slit.ball >= 0) holdLids(upper, lower, out_.balls[static_cast<std::size_t>(slit.ball)]);
    if (!slit.vertex.empty()) out_.slits.push_back(std::move(slit));
  }

  // The margins, what is behind them along the ball, and less and less of the skin before them.
  void holdLids(const std::vector<std::uint32_t>& upper, const std::vector<std::uint32_t>& lower,
                BallContact& ball) const {
    const double fully = 0.03 * es_, fade = 0.07 * es_;
    std::vector<GeodesicSource> sources;
    for (const auto* path : {&upper, &lower})
      for (const std::uint32_t v : *path) sources.push_back({v, 0.0F});
    const std::vector<float> distance =
        geodesicDistances(skin_.graph, sources, static_cast<float>(fully + fade)).distance;
    const Eigen::Vector3d centre = Eigen::Map<const Eigen::Vector3f>(ball.centre.data()).cast<double>();
    ball.outer.clear();
    ball.hold.clear();
    for (std::size_t i = 0; i < ball.vertex.size(); ++i) {
      const std::uint32_t v = ball.vertex[i];
      const double at_rest = (position(v) - centre).norm(), way = static_cast<double>(distance[skin_.same_as[v]]);
      const double hold = 1 - smoothStep((way - fully) / fade);
      ball.outer.push_back(static_cast<float>(at_rest * (1 + 2e-6)));
      ball.hold.push_back(static_cast<float>(hold));
      ball.distance[i] += static_cast<float>(hold) * (static_cast<float>(at_rest * (1 - 2e-6)) - ball.distance[i]);
    }
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
      slit.reach.push_back(static_cast<float>(std::min(0.0, sign * (up.dot(position(v)) - other)) - 1e-5 * es_));
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
    for (const RigidPart& part : rig_.rigid_parts)
      if (part.follows == RigidPart::Follows::skin) addRiders(part, skin);
    std::sort(out_.riders.begin(), out_.riders.end(),
              [](const Rider& a, const Rider& b) { return a.vertex < b.vertex; });
  }

  // The lid that most of the part's own rows follow, of the eye whose lids they follow: one piece may hold the lashes of
  // both lids and follow neither much.
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
    const auto of = [&](SlitSide lid) { return following[static_cast<std::size_t>(lid)]; };
    for (const auto& [upper, lower] : {std::pair{SlitSide::left_upper_lid, SlitSide::left_lower_lid},
                                       std::pair{SlitSide::right_upper_lid, SlitSide::right_lower_lid}})
      if (of(upper) + of(lower) > 0.3 * total) return of(upper) > of(lower) ? upper : lower;
    return SlitSide::none;
  }

  // The slit that lashes of a lid grow around; null where it was not found.
  const SlitContact* slitOf(SlitSide lid) const {
    const bool left = lid == SlitSide::left_upper_lid || lid == SlitSide::left_lower_lid;
    for (const SlitContact& s : out_.slits)
      if (lid != SlitSide::none && s.place == (left ? SlitContact::Place::left_eye : SlitContact::Place::right_eye)) return &s;
    return nullptr;
  }

  // The nearest place on the edges that the eye's margins run along: of both lids, since one piece may hold the lashes of
  // both.
  void anchorAtMargin(const SlitContact& slit, Rider& rider) const {
    double least = 1e300;
    for (const auto* margin : {&slit.upper, &slit.lower}) {
      for (const SlitContact::Sample& s : *margin) {
        const Eigen::Vector3d from = position(s.first), along = position(s.second) - from;
        const double t = shareOnSegment(position(rider.vertex), from, position(s.second));
        const double distance = (from + t * along - position(rider.vertex)).squaredNorm();
        if (distance >= least) continue;
        least = distance;
        rider.anchor = {s.first, s.second, s.first};
        rider.weight = {static_cast<float>(1 - t), static_cast<float>(t), 0};
      }
    }
  }

  void addRiders(const RigidPart& part, const std::vector<std::array<std::uint32_t, 3>>& skin) {
    const double near = 0.1 * es_;
    const SlitSide lid = lidOf(part);
    Eigen::Vector3d low = position(part.vertices.front()), high = low;
    for (const std::uint32_t v : part.vertices) {
      low = low.cwiseMin(position(v));
      high = high.cwiseMax(position(v));
    }
    const ClosestPoint surface(at_, trianglesNear(at_, skin, low.array() - near, high.array() + near, [&](const auto& t) {
      return lid == SlitSide::none ||
             std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return opposite(association_.side[v], lid); });
    }));
    if (surface.empty()) return;
    std::vector<SurfacePoint> nearest;
    double closest = near;
    for (const std::uint32_t v : part.vertices) {
      nearest.push_back(surface.find(position(v), near));
      if (nearest.back().triangle >= 0) closest = std::min(closest, nearest.back().distance);
    }
    if (!(closest < near)) return;
    // A lash grows from its lid: what stands away from the skin goes with the nearest root.
    const bool by_roots = lid != SlitSide::none && (high - low).norm() < 0.9 * es_;
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < nearest.size(); ++i)
      if (nearest[i].triangle >= 0 && nearest[i].distance < closest + 0.015 * es_) roots.push_back(i);
    // ... at the lid's margin: the tips of broad lashes come near the skin again, farther up, which goes another way.
    const SlitContact* const slit = by_roots ? slitOf(lid) : nullptr;
    const bool left = lid == SlitSide::left_upper_lid || lid == SlitSide::left_lower_lid;
    for (std::size_t i = 0; i < part.vertices.size(); ++i) {
      if (!moves(part.vertices[i])) continue;
      Rider rider;
      rider.vertex = part.vertices[i];
      if (slit != nullptr) {
        anchorAtMargin(*slit, rider);
      } else {
        std::size_t root = i;
        if (by_roots)
          root = *std::min_element(roots.begin(), roots.end(), [&](std::size_t a, std::size_t b) {
            const Eigen::Vector3d p = position(part.vertices[i]);
            return (position(part.vertices[a]) - p).squaredNorm() < (position(part.vertices[b]) - p).squaredNorm();
          });
        if (nearest[root].triangle < 0) continue;
        rider.anchor = surface.triangle(nearest[root].triangle);
        for (std::size_t k = 0; k < 3; ++k) rider.weight[k] = static_cast<float>(nearest[root].barycentric[k]);
      }
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
