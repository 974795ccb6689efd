// Planes that a surface is its own mirror image in.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "rig/finding/surface_samples.h"

namespace volto::rig {

struct SymmetryPlane {
  Eigen::Vector3d normal;  // unit
  double offset = 0;       // normal . p = offset
  double score = 0;        // 0..1: how much of the surface finds its mirror image, closely and facing the same way
};

// The best `count` planes that differ, best first. Iterative closest point of the samples on their mirror image, from
// many planes through the centroid; robust, so that a part that has no mirror image does not count. The samples'
// centroid is near the origin and their root mean square distance from it near 1.
std::vector<SymmetryPlane> findSymmetryPlanes(std::span<const SurfaceSample> samples, std::size_t count);

// One plane made exact on what lies within `radius` of `centre`; `error`: root mean square of half the distance between
// the matched points.
SymmetryPlane refineSymmetryPlane(std::span<const SurfaceSample> samples, const SymmetryPlane& plane,
                                  const Eigen::Vector3d& centre, double radius, double* error);

}  // namespace volto::rig
