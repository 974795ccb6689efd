// The actor of the shipped take: a face that is nobody's, with proportions of its own, that moves a little differently
// from the expression table, as every person does.
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "frames/arkit_blendshapes.h"
#include "rig/feature_points.h"

namespace volto::recordings {

inline constexpr std::size_t kLandmarks = 68;

class Person {
 public:
  Person();

  // 84 points at rest, millimetres, head frame.
  const rig::FeaturePointPositions& neutral() const { return neutral_; }

  // The 68 iBUG landmarks, millimetres, head frame. Jaw and lids move along arcs, so that the motion is not linear in
  // the weights.
  using Landmarks = std::array<Eigen::Vector3d, kLandmarks>;
  Landmarks landmarks(const ArkitWeights& weights) const;

  // Of the numbers above, to a millionth of a millimetre, which come from the reference mask and the expression table:
  // a take made from other numbers is another take.
  std::string digest() const;

 private:
  rig::FeaturePointPositions neutral_;
  // Displacement of every point by every shape, millimetres.
  std::array<rig::FeaturePointPositions, kArkitBlendshapeCount> moves_;
};

}  // namespace volto::recordings
