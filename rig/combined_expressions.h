// Twelve expressions made of several shapes each (joy, anger, ..., visemes, wink): what a character is looked at and
// measured with, because correct single shapes can add up to a wrong face. Their weights:
// assets/combined_expressions.json.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace volto::rig {

struct NamedPose {
  std::string name;
  std::vector<std::pair<std::string, float>> weights;  // ARKit blendshape name, 0..1
};

std::span<const NamedPose> combinedExpressions();

}  // namespace volto::rig
