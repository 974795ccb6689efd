// Where lids and lips of the head part, seen from in front: edges that a smooth fit only comes near to.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "rig/build_rig.h"
#include "rig/mesh.h"

namespace volto::rig {

// A point of a margin that was seen. Generic head's frame and unit (eye separations).
struct SeenMargin {
  enum class Of : std::uint8_t { left_eye, right_eye, mouth };
  Of of = Of::mouth;
  std::size_t feature_point = 0;
  Eigen::Vector3d position;
  double sigma_es = 0.02;
};

// `positions`, `triangles`: the skin without eyeballs and teeth, counter-clockwise from outside, y up and z forward.
// `points`: the 84 as fitted so far; `known`: those of them that are certain. An eye is a hole in the picture of the
// skin, or a place much deeper than its lids, around the middle of the fitted lids; closed lips part where the
// surface's profile from nose to chin is bent in most sharply. Nothing is said of what is not seen: closed eyes, eyes
// that are painted on, smooth lips. About 20 ms for 50 000 triangles.
std::vector<SeenMargin> seenMargins(const VertexPositions& positions,
                                    const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                    const FeaturePointPositions& points,
                                    const std::array<bool, kFeaturePointCount>& known);

}  // namespace volto::rig
