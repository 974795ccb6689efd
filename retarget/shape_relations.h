// What the shapes of a set are to each other: which come in pairs, which follow from others, which one bounds another.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "rig/rig.h"

namespace volto::retarget {

// A combination shape (a corrective): its weight is the product of its parents' weights, nobody chooses it.
struct DrivenShape {
  std::uint16_t shape = 0;
  std::vector<std::uint16_t> parents;  // two or more, none of them driven, ascending
};

// The same movement on either side of the face.
struct ShapePair {
  std::uint16_t left = 0, right = 0;
};

struct ShapeRelations {
  std::vector<DrivenShape> driven;
  std::vector<ShapePair> pairs;
  // mouthClose closes the lips of a mouth that jawOpen opened: its weight is at most jawOpen's.
  std::optional<std::uint16_t> mouth_close, jaw_open;

  // Writes the products over the weights of driven shapes. `weights`: one per shape.
  void drive(std::span<float> weights) const;
};

// Pairs are told by name (..._L and ..._R, ...Left and ...Right, case aside) and by what they do to the mask: jawLeft
// and jawRight are no pair, for one undoes the other. A blendshape is driven when one of the combinations, of the kind
// `product`, bears its name.
ShapeRelations shapeRelations(std::span<const rig::Blendshape> shapes, std::span<const rig::Combination> combinations);

// "browDown_L+eyeBlink_L" -> the indices of its two parents. Empty when the name has no '+' or no part of it is a shape
// of the set. Throws rig::InputError when some parts are shapes and others are not, or one is named twice.
std::vector<std::uint16_t> parentsByName(std::string_view name, std::span<const std::string> names);

}  // namespace volto::retarget
