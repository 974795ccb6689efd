#include "rig/shape_translation.h"

#include <algorithm>

#include "rig/errors.h"

namespace volto::rig {
namespace {

ShapeSet meaningOf(std::span<const std::string> names, const ShapeSet* meaning) {
  if (meaning == nullptr) meaning = shapeSetOf(names);
  if (meaning == nullptr)
    throw InputError(
        "no known set of blendshapes (arkit, facs, ict, vrm0, vrm1) holds at least half of the character's; say by "
        "--shapes-mean F.csv what they are in ARKit's terms");
  return ShapeSet::ofNames(names, *meaning);
}

}  // namespace

std::vector<std::string> blendshapeNames(const Rig& rig) {
  std::vector<std::string> names;
  for (const Blendshape& shape : rig.blendshapes) names.push_back(shape.name);
  return names;
}

ShapeTranslation::ShapeTranslation(std::span<const std::string> names, const ShapeSet* meaning, const ShapeSet& to)
    : from_(meaningOf(names, meaning)), to_(to) {
  if (std::all_of(from_.shapes().begin(), from_.shapes().end(),
                  [](const ShapeSet::Shape& shape) { return shape.parts.empty(); }))
    throw InputError("the set '" + from_.name() + "' gives none of the character's blendshapes a meaning");
}

void ShapeTranslation::apply(std::span<const float> weights, std::span<const std::uint8_t> observed,
                             std::span<float> out, std::span<std::uint8_t> out_observed) const {
  ArkitObserved arkit_observed;
  for (std::size_t k = 0; k < from_.shapes().size() && k < weights.size(); ++k)
    if (observed.empty() || observed[k] != 0)
      for (const ShapeSet::Part& part : from_.shapes()[k].parts) arkit_observed.set(part.arkit);
  ArkitWeights arkit;
  from_.toArkit(weights, arkit);
  if (to_.name() != "arkit") return to_.fromArkit(arkit, arkit_observed, out, out_observed);
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {  // nothing to solve, and not a bit lost
    out_observed[k] = arkit_observed[k] ? 1 : 0;
    out[k] = arkit_observed[k] ? arkit[k] : 0.0F;
  }
}

}  // namespace volto::rig
