#include "rig/combined_expressions.h"

#include <nlohmann/json.hpp>

#include "frames/arkit_blendshapes.h"
#include "rig/errors.h"

namespace volto::rig {

extern const char* const kCombinedExpressionsText;  // made from assets/combined_expressions.json

std::span<const NamedPose> combinedExpressions() {
  static const std::vector<NamedPose> poses = [] {
    std::vector<NamedPose> out;
    const auto json = nlohmann::ordered_json::parse(kCombinedExpressionsText);
    for (const auto& [name, weights] : json.items()) {
      NamedPose pose{name, {}};
      for (const auto& [shape, weight] : weights.items()) {
        if (!arkitBlendshapeIndex(shape)) throw InputError("combined_expressions.json: " + name + " names " + shape);
        pose.weights.emplace_back(shape, weight.get<float>());
      }
      out.push_back(std::move(pose));
    }
    return out;
  }();
  return poses;
}

}  // namespace volto::rig
