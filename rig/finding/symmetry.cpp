#include "rig/finding/symmetry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "rig/finding/nearest_point.h"

namespace volto::rig {
namespace {

Eigen::Vector3d mirrored(const SymmetryPlane& plane, const Eigen::Vector3d& p) {
  return p - 2 * (plane.normal.dot(p) - plane.offset) * plane.normal;
}

double agreement(const Eigen::Vector3d& normal, const Eigen::Vector3d& other, bool two_sided) {
  const double cosine = normal.dot(other);
  return std::max(0.0, two_sided ? std::abs(cosine) : cosine);
}

struct Matching {
  std::span<const SurfaceSample> samples;
  const NearestPoint& nearest;
  std::size_t stride;  // every so many samples are mirrored
};

// One closest-point step: the plane that best carries the mirrored samples onto what they hit. For pairs (p, q) the sum
// of |p - mirror(q)|^2 is least where the normal is the eigenvector of the least eigenvalue of the symmetrised
// sum w (p - c)(q - c)^T, c the mean of all.
SymmetryPlane step(const Matching& m, const SymmetryPlane& plane, double sigma) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double weights = 0;
  double possible = 0;
  struct Pair {
    std::size_t p, q;
    double weight;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < m.samples.size(); i += m.stride) {
    const SurfaceSample& sample = m.samples[i];
    const NearestPoint::Hit hit = m.nearest(mirrored(plane, sample.position));
    const SurfaceSample& other = m.samples[hit.index];
    const Eigen::Vector3d normal = sample.normal - 2 * plane.normal.dot(sample.normal) * plane.normal;
    const double r = hit.squared_distance / (sigma * sigma);
    const double weight = agreement(normal, other.normal, sample.two_sided || other.two_sided) / ((1 + r) * (1 + r));
    possible += 1;
    weights += weight;
    mean += weight * (sample.position + other.position);
    pairs.push_back({i, hit.index, weight});
  }
  if (!(weights > 0)) return plane;
  mean /= 2 * weights;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Pair& pair : pairs) {
    const Eigen::Vector3d p = m.samples[pair.p].position - mean;
    const Eigen::Vector3d q = m.samples[pair.q].position - mean;
    moment += pair.weight * (p * q.transpose() + q * p.transpose());
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moment);
  SymmetryPlane next;
  next.normal = solver.eigenvectors().col(0);
  if (next.normal.dot(plane.normal) < 0) next.normal = -next.normal;
  next.offset = next.normal.dot(mean);
  next.score = weights / possible;
  return next;
}

SymmetryPlane converge(const Matching& m, SymmetryPlane plane, std::initializer_list<double> sigmas) {
  for (const double sigma : sigmas) plane = step(m, plane, sigma);
  return plane;
}

bool same(const SymmetryPlane& a, const SymmetryPlane& b) {
  const double sign = a.normal.dot(b.normal) < 0 ? -1 : 1;
  return sign * a.normal.dot(b.normal) > 0.97 && std::abs(a.offset - sign * b.offset) < 0.12;
}

}  // namespace

std::vector<SymmetryPlane> findSymmetryPlanes(std::span<const SurfaceSample> samples, std::size_t count) {
  std::vector<Eigen::Vector3d> points;
  for (const SurfaceSample& s : samples) points.push_back(s.position);
  const NearestPoint nearest(points);
  const Matching coarse{samples, nearest, std::max<std::size_t>(1, samples.size() / 250)};
  const Matching fine{samples, nearest, std::max<std::size_t>(1, samples.size() / 1200)};

  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) moment += (p - mean) * (p - mean).transpose();
  const Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment).eigenvectors();
  // Starts turn with the mesh: principal axes, and a spiral over the half sphere around them.
  std::vector<Eigen::Vector3d> starts{axes.col(0), axes.col(1), axes.col(2)};
  constexpr int kSpiral = 45;
  for (int i = 0; i < kSpiral; ++i) {
    const double z = 1 - (i + 0.5) / kSpiral;
    const double r = std::sqrt(1 - z * z);
    const double angle = std::numbers::pi * (3 - std::sqrt(5.0)) * i;
    starts.push_back(axes * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z));
  }
  std::vector<SymmetryPlane> planes;
  for (const Eigen::Vector3d& normal : starts)
    planes.push_back(converge(coarse, {normal, normal.dot(mean), 0}, {0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.15}));
  auto better = [](const SymmetryPlane& a, const SymmetryPlane& b) { return a.score > b.score; };
  std::stable_sort(planes.begin(), planes.end(), better);
  std::vector<SymmetryPlane> distinct;
  for (const SymmetryPlane& plane : planes) {
    if (distinct.size() >= 3 * count) break;
    if (std::none_of(distinct.begin(), distinct.end(), [&](const auto& other) { return same(plane, other); }))
      distinct.push_back(plane);
  }
  std::vector<SymmetryPlane> result;
  for (SymmetryPlane& plane : distinct) plane = converge(fine, plane, {0.15, 0.12, 0.1, 0.08, 0.06, 0.05, 0.05, 0.05});
  std::stable_sort(distinct.begin(), distinct.end(), better);
  for (const SymmetryPlane& plane : distinct) {
    if (result.size() >= count) break;
    if (std::none_of(result.begin(), result.end(), [&](const auto& other) { return same(plane, other); }))
      result.push_back(plane);
  }
  return result;
}

SymmetryPlane refineSymmetryPlane(std::span<const SurfaceSample> samples, const SymmetryPlane& plane,
                                  const Eigen::Vector3d& centre, double radius, double* error) {
  std::vector<SurfaceSample> near;
  std::vector<Eigen::Vector3d> points;
  for (const SurfaceSample& s : samples)
    if ((s.position - centre).norm() < radius) {
      near.push_back(s);
      points.push_back(s.position);
    }
  if (error != nullptr) *error = 0;
  if (near.size() < 20) return plane;
  const NearestPoint nearest(points);
  const Matching matching{near, nearest, 1};
  SymmetryPlane refined =
      converge(matching, plane, {0.1 * radius, 0.08 * radius, 0.06 * radius, 0.05 * radius, 0.05 * radius});
  if (error != nullptr) {
    // Along the normal of what is hit, so that the distance between samples does not count; the worst tenth left out.
    std::vector<double> squares;
    for (const SurfaceSample& s : near) {
      const Eigen::Vector3d p = mirrored(refined, s.position);
      const NearestPoint::Hit hit = nearest(p);
      const double d = near[hit.index].normal.dot(p - near[hit.index].position) / 2;
      squares.push_back(d * d);
    }
    std::sort(squares.begin(), squares.end());
    squares.resize(squares.size() * 9 / 10 + 1);
    double sum = 0;
    for (const double s : squares) sum += s;
    *error = std::sqrt(sum / static_cast<double>(squares.size()));
  }
  return refined;
}

}  // namespace volto::rig
