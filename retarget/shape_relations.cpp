#include "retarget/shape_relations.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "frames/arkit_blendshapes.h"
#include "rig/errors.h"

namespace volto::retarget {
namespace {

// Shapes whose mask motions point against each other by more than this (cosine) are antagonists, not a pair.
constexpr double kAntagonists = -0.3;

std::string lowerCase(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return out;
}

// The name of the other side's shape in lower case, for a name that ends in left or _l; else nothing.
std::string rightOf(const std::string& lower) {
  for (const auto& [left, right] : {std::pair{"left", "right"}, std::pair{"_l", "_r"}, std::pair{".l", ".r"}})
    if (lower.ends_with(left)) return lower.substr(0, lower.size() - std::string_view(left).size()) + right;
  return {};
}

double cosine(const rig::Blendshape& a, const rig::Blendshape& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = a.mask_displacement[p][axis], y = b.mask_displacement[p][axis];
      ab += x * y;
      aa += x * x;
      bb += y * y;
    }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

}  // namespace

void ShapeRelations::drive(std::span<float> weights) const {
  for (const DrivenShape& shape : driven) {
    float product = 1;
    for (const std::uint16_t parent : shape.parents) product *= weights[parent];
    weights[shape.shape] = product;
  }
}

ShapeRelations shapeRelations(std::span<const rig::Blendshape> shapes, std::span<const rig::Combination> combinations) {
  ShapeRelations out;
  std::vector<std::string> lower;
  for (const rig::Blendshape& shape : shapes) lower.push_back(lowerCase(shape.name));
  const auto indexOf = [&](std::string_view name) -> std::optional<std::uint16_t> {
    const auto found = std::find(lower.begin(), lower.end(), name);
    if (found == lower.end()) return {};
    return static_cast<std::uint16_t>(found - lower.begin());
  };

  std::vector<bool> driven(shapes.size(), false);
  for (const rig::Combination& combination : combinations) {
    if (combination.rule != rig::Combination::Rule::product || combination.drivers.size() < 2) continue;
    const auto named = std::find_if(shapes.begin(), shapes.end(),
                                    [&](const rig::Blendshape& shape) { return shape.name == combination.name; });
    if (named == shapes.end()) continue;
    DrivenShape shape;
    shape.shape = static_cast<std::uint16_t>(named - shapes.begin());
    for (const rig::Combination::Driver& driver : combination.drivers) shape.parents.push_back(driver.shape);
    std::sort(shape.parents.begin(), shape.parents.end());
    driven[shape.shape] = true;
    out.driven.push_back(std::move(shape));
  }
  // A product of products has no place in one pass: such a shape is left to the mask like any other.
  std::erase_if(out.driven, [&](const DrivenShape& shape) {
    const bool bad = std::any_of(shape.parents.begin(), shape.parents.end(),
                                 [&](std::uint16_t p) { return p >= shapes.size() || driven[p]; });
    return bad;
  });

  for (std::size_t k = 0; k < shapes.size(); ++k) {
    // Eyes look the same way together: what one does inwards the other does outwards.
    if (driven[k] || lower[k].starts_with("eyelook")) continue;
    const std::string other = rightOf(lower[k]);
    const auto right = other.empty() ? std::nullopt : indexOf(other);
    if (!right || driven[*right] || cosine(shapes[k], shapes[*right]) < kAntagonists) continue;
    out.pairs.push_back({static_cast<std::uint16_t>(k), *right});
  }
  out.mouth_close = indexOf("mouthclose");
  out.jaw_open = indexOf("jawopen");
  if (!out.mouth_close || !out.jaw_open) out.mouth_close = out.jaw_open = std::nullopt;
  return out;
}

std::vector<std::uint16_t> parentsByName(std::string_view name, std::span<const std::string> names) {
  std::vector<std::uint16_t> parents;
  std::string missing;
  std::size_t start = 0;
  if (name.find('+') == std::string_view::npos) return {};
  while (start <= name.size()) {
    const std::size_t end = std::min(name.find('+', start), name.size());
    const std::string_view part = name.substr(start, end - start);
    const auto found = std::find(names.begin(), names.end(), part);
    if (found == names.end())
      missing = part;
    else
      parents.push_back(static_cast<std::uint16_t>(found - names.begin()));
    start = end + 1;
  }
  if (parents.empty()) return {};
  if (!missing.empty())
    throw rig::InputError("shape '" + std::string(name) + "' combines '" + missing +
                          "', which the set does not have; add it or rename the combination");
  std::sort(parents.begin(), parents.end());
  if (std::adjacent_find(parents.begin(), parents.end()) != parents.end())
    throw rig::InputError("shape '" + std::string(name) + "' names a parent twice");
  return parents;
}

}  // namespace volto::retarget
