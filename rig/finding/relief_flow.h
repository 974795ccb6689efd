// One face's relief laid over another's: where each pixel of the first is on the second.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "rig/finding/relief.h"

namespace volto::rig {

struct ReliefFlow {
  double pixel = 0.025;
  std::array<Grid, 2> shift;  // pixels, x and y: pixel (i, j) of the first is at (i, j) + shift of the second

  // The same point in head frame coordinates.
  Eigen::Vector2d carry(const Eigen::Vector2d& p) const;
};

// How alike two reliefs are after the flow: correlation of the forms, with their large-scale parts taken out, weighted
// by the mask. -1..1 each.
struct ReliefLikeness {
  double normals = 0;
  double curvature = 0;

  double mean() const { return (normals + curvature) / 2; }
};

struct FlowLevel {
  double scale;      // of the form that is compared, eye separations
  double stiffness;  // how far a pixel's shift spreads, eye separations
  int iterations;
};

// Coarse to fine: at each level Gauss-Newton steps of the local translation (Lucas, Kanade 1981) over Gaussian windows,
// robust, the shift smoothed after each step and kept mirror symmetric. `mask`: weight of each pixel of the first.
// `start` may have another pixel size.
ReliefFlow registerReliefs(const Relief& first, const Relief& second, const Grid& mask,
                           std::span<const FlowLevel> levels, const ReliefFlow* start = nullptr);

// One likeness for each mask.
std::vector<ReliefLikeness> compareReliefs(const Relief& first, const Relief& second, std::span<const Grid> masks,
                                           const ReliefFlow& flow, double scale);

}  // namespace volto::rig
