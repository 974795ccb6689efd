#include "rig/finding/surface_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

#include "rig/errors.h"

namespace volto::rig {
namespace {

Eigen::Vector3d scaledNormal(const NormalisedSurface& surface, const Triangle& t) {
  const Eigen::Vector3d a = surface.positions.row(t[0]);
  const Eigen::Vector3d b = surface.positions.row(t[1]);
  const Eigen::Vector3d c = surface.positions.row(t[2]);
  return (b - a).cross(c - a);
}

// Points of a sphere, evenly: the golden spiral.
std::vector<Eigen::Vector3d> directions(int count) {
  std::vector<Eigen::Vector3d> result;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double r = std::sqrt(1.0 - z * z);
    result.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  return result;
}

std::vector<SurfaceSample> sampleSurface(const NormalisedSurface& surface, std::size_t count) {
  const std::vector<Triangle>& triangles = surface.triangles;
  std::vector<double> area(triangles.size());
  double total = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) total += area[t] = scaledNormal(surface, triangles[t]).norm() / 2;
  const double per_area = 0.5 * static_cast<double>(count) / total;
  const double per_triangle = 0.5 * static_cast<double>(count) / static_cast<double>(triangles.size());
  std::vector<SurfaceSample> samples;
  samples.reserve(count + 1);
  double due = 0.5;
  std::size_t made = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (!(area[t] > 0)) continue;
    for (due += area[t] * per_area + per_triangle; due >= 1 && made <= count; due -= 1) {
      // The R2 sequence (Roberts 2018) folded into the triangle.
      const double n = static_cast<double>(++made);
      double u = std::fmod(0.7548776662466927 * n, 1.0);
      double v = std::fmod(0.5698402909980532 * n, 1.0);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Eigen::Vector3d a = surface.positions.row(triangles[t][0]);
      const Eigen::Vector3d b = surface.positions.row(triangles[t][1]);
      const Eigen::Vector3d c = surface.positions.row(triangles[t][2]);
      SurfaceSample sample;
      sample.position = a + u * (b - a) + v * (c - a);
      sample.normal = scaledNormal(surface, triangles[t]).normalized();
      sample.triangle = static_cast<std::uint32_t>(t);
      samples.push_back(sample);
    }
  }
  return samples;
}

// Looks at the samples from far away in one direction: those not behind others are seen.
class Onlooker {
 public:
  explicit Onlooker(double cell) : cell_(cell) {}

  void look(const Eigen::Vector3d& towards_eye, std::span<const SurfaceSample> samples, std::vector<float>& as_wound,
            std::vector<float>& reversed) {
    const Eigen::Vector3d side = towards_eye.unitOrthogonal();
    const Eigen::Vector3d up = towards_eye.cross(side);
    double extent = 0;
    for (const SurfaceSample& s : samples)
      extent = std::max({extent, std::abs(side.dot(s.position)), std::abs(up.dot(s.position))});
    // A far-flung mesh gets coarser cells, never a larger picture.
    const double cell = std::max(cell_, 2 * extent / 400);
    const int half = static_cast<int>(extent / cell) + 2;
    const int width = 2 * half + 1;
    nearest_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(width),
                    -std::numeric_limits<double>::infinity());
    auto cellOf = [&](const SurfaceSample& s) {
      const int i = static_cast<int>(std::floor(side.dot(s.position) / cell)) + half;
      const int j = static_cast<int>(std::floor(up.dot(s.position) / cell)) + half;
      return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
    };
    for (const SurfaceSample& s : samples) {
      double& depth = nearest_[cellOf(s)];
      depth = std::max(depth, towards_eye.dot(s.position));
    }
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double facing = samples[i].normal.dot(towards_eye);
      if (std::abs(facing) < 0.35) continue;
      const double slack = cell * (0.7 + std::sqrt(1 - facing * facing) / std::abs(facing));
      if (towards_eye.dot(samples[i].position) < nearest_[cellOf(samples[i])] - slack) continue;
      (facing > 0 ? as_wound : reversed)[i] += static_cast<float>(std::abs(facing));
    }
  }

 private:
  double cell_;
  std::vector<double> nearest_;
};

}  // namespace

NormalisedSurface normaliseSurface(const Mesh& mesh) {
  NormalisedSurface surface;
  surface.positions = mesh.positions;
  surface.triangles = triangulate(mesh);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  for (const Triangle& t : surface.triangles)
    for (const std::uint32_t v : t) {
      const Eigen::Vector3d p = mesh.positions.row(v);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  const double extent = surface.triangles.empty() ? 0 : (high - low).maxCoeff();
  if (!(extent > 0) || !std::isfinite(extent)) throw InputError("no surface to look for a face on");
  // Once by the box, so that areas neither overflow nor vanish, then by area.
  surface.centre = (low + high) / 2;
  surface.size = extent;
  surface.positions.rowwise() -= surface.centre.transpose();
  surface.positions /= extent;
  double total = 0;
  double second = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (const Triangle& t : surface.triangles) {
    const double area = scaledNormal(surface, t).norm() / 2;
    const Eigen::Vector3d a = surface.positions.row(t[0]);
    const Eigen::Vector3d b = surface.positions.row(t[1]);
    const Eigen::Vector3d c = surface.positions.row(t[2]);
    total += area;
    first += area * (a + b + c) / 3;
    second += area * ((a + b + c).squaredNorm() + a.squaredNorm() + b.squaredNorm() + c.squaredNorm()) / 12;
  }
  if (!(total > 1e-12)) throw InputError("no surface to look for a face on");
  const Eigen::Vector3d centroid = first / total;
  const double rms = std::sqrt(std::max(second / total - centroid.squaredNorm(), 1e-12));
  surface.positions.rowwise() -= centroid.transpose();
  surface.positions /= rms;
  surface.centre += surface.size * centroid;
  surface.size *= rms;
  return surface;
}

std::vector<SurfaceSample> sampleVisibleSurface(const NormalisedSurface& surface, std::size_t count,
                                                std::vector<std::uint32_t>* hidden) {
  std::vector<SurfaceSample> samples = sampleSurface(surface, count);
  std::vector<float> as_wound(samples.size());
  std::vector<float> reversed(samples.size());
  double area = 0;
  for (const Triangle& t : surface.triangles) area += scaledNormal(surface, t).norm() / 2;
  // Half the samples lie evenly: a cell should catch a few of them.
  Onlooker onlooker(std::sqrt(4.0 * area / static_cast<double>(count)));
  constexpr int kDirections = 42;
  for (const Eigen::Vector3d& d : directions(kDirections)) onlooker.look(d, samples, as_wound, reversed);
  std::vector<SurfaceSample> visible;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // A side seen from everywhere scores about a quarter of the directions.
    SurfaceSample& sample = samples[i];
    sample.seen_as_wound = std::min(1.0F, as_wound[i] / (kDirections / 4.0F));
    sample.seen_reversed = std::min(1.0F, reversed[i] / (kDirections / 4.0F));
    const float more = std::max(sample.seen_as_wound, sample.seen_reversed);
    const float less = std::min(sample.seen_as_wound, sample.seen_reversed);
    if (more < 0.08F) {
      if (hidden != nullptr) hidden->push_back(sample.triangle);
      continue;
    }
    sample.two_sided = less > 0.35F * more;
    if (!sample.two_sided && sample.seen_reversed > sample.seen_as_wound) sample.normal = -sample.normal;
    visible.push_back(sample);
  }
  return visible;
}

}  // namespace volto::rig
