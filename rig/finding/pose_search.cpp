#include "rig/finding/pose_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "rig/finding/face_template.h"

namespace volto::rig {
namespace {

// The surface folded along a plane of symmetry: x = distance from the plane, (y, z) in the plane.
struct FoldedSurface {
  std::vector<Eigen::Vector3d> points, normals;
  std::vector<bool> two_sided;
  Eigen::Matrix3d basis;  // columns: the plane's normal, and two axes in it
  Eigen::Vector3d origin;
  std::unique_ptr<NearestPoint> nearest;
};

FoldedSurface fold(std::span<const SurfaceSample> samples, const SymmetryPlane& plane) {
  FoldedSurface folded;
  folded.basis.col(0) = plane.normal;
  folded.basis.col(1) = plane.normal.unitOrthogonal();
  folded.basis.col(2) = plane.normal.cross(folded.basis.col(1));
  folded.origin = plane.offset * plane.normal;
  for (const SurfaceSample& s : samples) {
    Eigen::Vector3d p = folded.basis.transpose() * (s.position - folded.origin);
    Eigen::Vector3d n = folded.basis.transpose() * s.normal;
    if (p.x() < 0) p.x() = -p.x(), n.x() = -n.x();
    folded.points.push_back(p);
    folded.normals.push_back(n);
    folded.two_sided.push_back(s.two_sided);
  }
  folded.nearest = std::make_unique<NearestPoint>(folded.points);
  return folded;
}

// A head frame on a folded surface: (x, y, z) -> (size x, size * turn * (y, facing z) + place).
struct FoldedPose {
  double cosine = 1, sine = 0;  // of the turn
  double size = 1;
  double facing = 1;  // -1: the head frame's left is against the plane's normal
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double closeness = 0;

  Eigen::Vector3d turned(const Eigen::Vector3d& p) const {
    const double z = facing * p.z();
    return {p.x(), cosine * p.y() - sine * z, sine * p.y() + cosine * z};
  }
  Eigen::Vector3d operator()(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = size * turned(p);
    return {q.x(), q.y() + place.x(), q.z() + place.y()};
  }
};

// How well the first `count` template points find the surface; with `move`, the pose is bettered by one closest-point
// step. `reach`: how far a point may look, eye separations.
double align(const FoldedSurface& surface, FoldedPose& pose, std::size_t count, double reach, bool move) {
  const FaceTemplate& face = faceTemplate();
  count = std::min(count, face.points.size());
  double total = 0;
  double face_total = 0;
  std::size_t face_count = 0;
  double weights = 0;
  struct Pair {
    Eigen::Vector3d p, q;
    double weight;
  };
  static thread_local std::vector<Pair> pairs;
  pairs.clear();
  Eigen::Vector2d mean_p = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_q = Eigen::Vector2d::Zero();
  const double reach2 = reach * reach * pose.size * pose.size;
  for (std::size_t i = 0; i < count; ++i) {
    if (face.on_face[i]) ++face_count;
    const Eigen::Vector3d p = pose(face.points[i]);
    const NearestPoint::Hit hit = (*surface.nearest)(p);
    double cosine = pose.turned(face.normals[i]).dot(surface.normals[hit.index]);
    if (surface.two_sided[hit.index]) cosine = std::abs(cosine);
    if (cosine <= 0) continue;
    const double r = hit.squared_distance / reach2;
    const double weight = cosine / ((1 + r) * (1 + r));
    total += weight;
    if (face.on_face[i]) face_total += weight;
    if (!move || weight < 0.05) continue;
    const Eigen::Vector3d& q = surface.points[hit.index];
    Eigen::Vector3d source(face.points[i].x(), face.points[i].y(), pose.facing * face.points[i].z());
    pairs.push_back({source, q, weight});
    weights += weight;
    mean_p += weight * source.tail<2>();
    mean_q += weight * q.tail<2>();
  }
  // A mesh may be a face alone, without the skull: the face counts more.
  pose.closeness = 0.4 * total / static_cast<double>(count) +
                   0.6 * face_total / static_cast<double>(std::max<std::size_t>(face_count, 1));
  if (!move || pairs.size() < 8) return pose.closeness;
  mean_p /= weights;
  mean_q /= weights;
  double along = 0, across = 0, x = 0, square = 0;
  for (const Pair& pair : pairs) {
    const Eigen::Vector2d p = pair.p.tail<2>() - mean_p;
    const Eigen::Vector2d q = pair.q.tail<2>() - mean_q;
    along += pair.weight * p.dot(q);
    across += pair.weight * (p.x() * q.y() - p.y() * q.x());
    x += pair.weight * pair.p.x() * pair.q.x();
    square += pair.weight * (p.squaredNorm() + pair.p.x() * pair.p.x());
  }
  const double length = std::hypot(along, across);
  if (!(length > 0) || !(square > 0)) return pose.closeness;
  pose.cosine = along / length;
  pose.sine = across / length;
  pose.size = std::clamp((length + x) / square, 0.8 * pose.size, 1.25 * pose.size);
  pose.place = mean_q - pose.size * Eigen::Vector2d(pose.cosine * mean_p.x() - pose.sine * mean_p.y(),
                                                    pose.sine * mean_p.x() + pose.cosine * mean_p.y());
  return pose.closeness;
}

// Places in the plane, at least `apart` from each other, that have surface within `half` of the plane.
std::vector<Eigen::Vector2d> spreadPlaces(const FoldedSurface& surface, double half, double apart, std::size_t most) {
  std::vector<Eigen::Vector2d> candidates;
  for (const Eigen::Vector3d& p : surface.points)
    if (p.x() < half) candidates.emplace_back(p.y(), p.z());
  std::vector<Eigen::Vector2d> places;
  if (candidates.empty()) return places;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : candidates) mean += p / static_cast<double>(candidates.size());
  places.push_back(mean);
  std::vector<double> distance(candidates.size(), 1e30);
  while (places.size() < most) {
    std::size_t farthest = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      distance[i] = std::min(distance[i], (candidates[i] - places.back()).squaredNorm());
      if (distance[i] > distance[farthest]) farthest = i;
    }
    if (distance[farthest] < apart * apart) break;
    places.push_back(candidates[farthest]);
  }
  return places;
}

FaceFrame unfolded(const FoldedSurface& surface, const FoldedPose& pose) {
  FaceFrame frame;
  const Eigen::Vector3d up = surface.basis * Eigen::Vector3d(0, pose.cosine, pose.sine);
  const Eigen::Vector3d out = surface.basis * Eigen::Vector3d(0, -pose.facing * pose.sine, pose.facing * pose.cosine);
  frame.mesh_from_head.col(0) = up.cross(out);
  frame.mesh_from_head.col(1) = up;
  frame.mesh_from_head.col(2) = out;
  frame.origin = surface.origin + surface.basis * Eigen::Vector3d(0, pose.place.x(), pose.place.y());
  frame.size = pose.size;
  return frame;
}

bool same(const FoldedPose& a, const FoldedPose& b) {
  return a.facing == b.facing && a.cosine * b.cosine + a.sine * b.sine > 0.94 &&
         (a.place - b.place).norm() < 0.35 * std::min(a.size, b.size) && std::abs(std::log(a.size / b.size)) < 0.25;
}

struct Ranked {
  FoldedPose pose;
  std::size_t plane;
};

// The best first, without repetitions, at most `most`.
void prune(std::vector<Ranked>& ranked, std::size_t most) {
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.pose.closeness > b.pose.closeness; });
  std::vector<Ranked> kept;
  for (const Ranked& r : ranked) {
    if (kept.size() >= most) break;
    if (std::none_of(kept.begin(), kept.end(),
                     [&](const Ranked& other) { return r.plane == other.plane && same(r.pose, other.pose); }))
      kept.push_back(r);
  }
  ranked = std::move(kept);
}

}  // namespace

std::vector<PoseCandidate> searchPoses(std::span<const SurfaceSample> samples, std::span<const SymmetryPlane> planes,
                                       std::size_t count, double smallest) {
  constexpr int kTurns = 12;
  // A face alone is about one eye separation in root mean square, a head two, a standing person eight.
  constexpr double kSizes[] = {1.05, 0.7, 0.47, 0.31, 0.21, 0.14, 0.1};
  std::vector<FoldedSurface> surfaces;
  for (const SymmetryPlane& plane : planes) surfaces.push_back(fold(samples, plane));
  std::vector<Ranked> ranked;
  for (std::size_t k = 0; k < surfaces.size(); ++k)
    for (const double size : kSizes) {
      if (size < smallest) continue;
      for (const Eigen::Vector2d& place : spreadPlaces(surfaces[k], 1.6 * size, 1.1 * size, 120))
        for (int turn = 0; turn < kTurns; ++turn)
          for (const double facing : {1.0, -1.0}) {
            FoldedPose pose;
            const double angle = 2 * std::numbers::pi * turn / kTurns;
            pose.cosine = std::cos(angle);
            pose.sine = std::sin(angle);
            pose.size = size;
            pose.facing = facing;
            // The middle of the head, not the eyes, comes to lie at the place.
            pose.place = place - size * pose.turned({0, -0.2, -1.0}).tail<2>();
            align(surfaces[k], pose, 40, 0.5, true);
            ranked.push_back({pose, k});
          }
    }
  prune(ranked, 400);
  for (Ranked& r : ranked) {
    for (int i = 0; i < 3; ++i) align(surfaces[r.plane], r.pose, 80, 0.4, true);
    align(surfaces[r.plane], r.pose, 80, 0.25, false);
  }
  prune(ranked, 60);
  for (Ranked& r : ranked) {
    for (const double reach : {0.4, 0.35, 0.3, 0.3, 0.25, 0.25, 0.2, 0.2, 0.2, 0.2})
      align(surfaces[r.plane], r.pose, 250, reach, true);
    align(surfaces[r.plane], r.pose, 500, 0.15, false);
  }
  prune(ranked, count);
  std::vector<PoseCandidate> result;
  for (const Ranked& r : ranked) result.push_back({unfolded(surfaces[r.plane], r.pose), r.pose.closeness, r.plane});
  return result;
}

}  // namespace volto::rig
