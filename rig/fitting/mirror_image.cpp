#include "rig/fitting/mirror_image.h"

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Eigenvalues>

namespace volto::rig {
namespace {

constexpr std::size_t kSamples = 1500;
constexpr int kRounds = 30;
constexpr double kReach_es = 0.25;      // the first plane is no better than the landmarks
constexpr double kMirrored_es = 0.004;  // of which nine tenths of the surface must be their mirror image
constexpr double kImage_es = 0.005;     // how exactly the mirror image of a landmark is one
constexpr double kConverged_es = 1e-6;

struct Pair {
  Eigen::Vector3d from, to;  // `to`: what of the surface is nearest to the mirror image of `from`
  double distance;
};

std::vector<Pair> pairsIn(const TargetSurface& surface, const std::vector<std::int64_t>& samples,
                          const MirrorPlane& plane) {
  std::vector<Pair> out;
  for (const std::int64_t t : samples) {
    const auto& corner = surface.triangle(t);
    const VertexPositions& at = surface.positions();
    const Eigen::Vector3d from = (at.row(corner[0]) + at.row(corner[1]) + at.row(corner[2])).transpose() / 3;
    const SurfaceHit hit =
        surface.find(plane.mirrored(from), plane.mirroredDirection(surface.normal(t)), 0.5, kReach_es);
    out.push_back({from, hit.position, hit.distance});
  }
  std::sort(out.begin(), out.end(), [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  return out;
}

// The plane that mirrors one side of the pairs onto the other best: its normal is the direction in which they are most
// each other's opposite.
MirrorPlane planeOf(const std::vector<Pair>& pairs, std::size_t counted) {
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < counted; ++i) {
    from += pairs[i].from;
    to += pairs[i].to;
  }
  from /= static_cast<double>(counted);
  to /= static_cast<double>(counted);
  Eigen::Matrix3d together = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < counted; ++i) {
    const Eigen::Matrix3d product = (pairs[i].from - from) * (pairs[i].to - to).transpose();
    together += product + product.transpose();
  }
  MirrorPlane out;
  out.normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(together).eigenvectors().col(0);
  if (out.normal.x() < 0) out.normal = -out.normal;
  out.offset = 0.5 * out.normal.dot(from + to);
  return out;
}

}  // namespace

std::optional<MirrorPlane> findMirrorPlane(const TargetSurface& surface, const Eigen::Vector3d& centre, double radius) {
  std::vector<std::int64_t> near;
  for (std::int64_t t = 0; t < static_cast<std::int64_t>(surface.triangleCount()); ++t)
    if ((surface.positions().row(surface.triangle(t)[0]).transpose() - centre).norm() < radius) near.push_back(t);
  std::vector<std::int64_t> samples;
  const std::size_t step = std::max<std::size_t>(1, near.size() / kSamples);
  for (std::size_t i = 0; i < near.size(); i += step) samples.push_back(near[i]);
  if (samples.size() < 20) return std::nullopt;

  MirrorPlane plane;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Pair> pairs = pairsIn(surface, samples, plane);
    const std::size_t counted = samples.size() * 9 / 10;
    if (!(pairs[counted - 1].distance < kReach_es)) return std::nullopt;
    const MirrorPlane next = planeOf(pairs, counted);
    if (next.normal.x() < 0.9) return std::nullopt;  // another symmetry than a face's
    const double step_es = (next.normal - plane.normal).norm() + std::abs(next.offset - plane.offset);
    plane = next;
    if (step_es < kConverged_es) break;
  }
  if (pairsIn(surface, samples, plane)[samples.size() * 9 / 10 - 1].distance > kMirrored_es) return std::nullopt;
  return plane;
}

SurfaceHit findOnPlane(const TargetSurface& surface, const MirrorPlane& plane, const Eigen::Vector3d& p,
                       const Eigen::Vector3d& normal) {
  SurfaceHit best;
  for (std::int64_t t = 0; t < static_cast<std::int64_t>(surface.triangleCount()); ++t) {
    if (!(surface.normal(t).dot(normal) > 0)) continue;
    const auto& corner = surface.triangle(t);
    std::array<Eigen::Vector3d, 3> at;
    std::array<double, 3> height;
    for (std::size_t i = 0; i < 3; ++i) {
      at[i] = surface.positions().row(corner[i]);
      height[i] = plane.normal.dot(at[i]) - plane.offset;
    }
    // The two ends of the cut, each on an edge or a corner, by their barycentric coordinates.
    std::array<std::array<double, 3>, 3> ends;
    std::size_t found = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      if ((height[i] > 0) == (height[j] > 0)) continue;
      const double share = height[i] / (height[i] - height[j]);
      std::array<double, 3> end{};
      end[i] = 1 - share;
      end[j] = share;
      ends[found++] = end;
    }
    if (found < 2) continue;
    const auto place = [&](const std::array<double, 3>& of) -> Eigen::Vector3d {
      return of[0] * at[0] + of[1] * at[1] + of[2] * at[2];
    };
    const Eigen::Vector3d from = place(ends[0]), way = place(ends[1]) - from;
    const double along = way.squaredNorm() > 0 ? std::clamp((p - from).dot(way) / way.squaredNorm(), 0.0, 1.0) : 0.0;
    const double distance = (from + along * way - p).norm();
    if (!(distance < best.distance)) continue;
    best = {t, {}, from + along * way, distance};
    for (std::size_t i = 0; i < 3; ++i) best.barycentric[i] = (1 - along) * ends[0][i] + along * ends[1][i];
  }
  return best;
}

void addMirrorImages(const MirrorPlane& plane, const Similarity& mesh_from_generic,
                     std::vector<PlacedLandmark>& landmarks) {
  std::array<bool, kFeaturePointCount> there{};
  for (const PlacedLandmark& l : landmarks) there[l.feature_point] = true;
  const std::size_t count = landmarks.size();
  for (std::size_t i = 0; i < count; ++i) {
    PlacedLandmark other = landmarks[i];
    other.feature_point = featurePoints()[other.feature_point].mirror;
    if (there[other.feature_point]) continue;
    other.position = mesh_from_generic(plane.mirrored(mesh_from_generic.inverse(other.position)));
    other.sigma_es = std::max(other.sigma_es, kImage_es);
    landmarks.push_back(other);
  }
}

FacePoints alikeOnBothSides(const FacePoints& points, const MirrorPlane& plane, const Similarity& mesh_from_generic,
                            const std::vector<PlacedLandmark>& landmarks) {
  std::array<bool, kFeaturePointCount> exact{};
  FeaturePointPositions known = points.positions;
  for (const PlacedLandmark& l : landmarks) {
    if (l.sigma_es > 0) continue;
    exact[l.feature_point] = true;
    known.row(static_cast<Eigen::Index>(l.feature_point)) = mesh_from_generic.inverse(l.position).transpose();
  }
  FacePoints out = points;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (exact[p]) continue;
    const std::size_t other = featurePoints()[p].mirror;
    const auto row = static_cast<Eigen::Index>(p), from = static_cast<Eigen::Index>(other);
    const Eigen::Vector3d image = plane.mirrored(known.row(from));
    out.positions.row(row) += (exact[other] ? 1.0 : 0.5) * (image.transpose() - points.positions.row(row));
    out.normals.row(row) += plane.mirroredDirection(points.normals.row(from)).transpose();
    out.normals.row(row).normalize();
  }
  return out;
}

}  // namespace volto::rig
