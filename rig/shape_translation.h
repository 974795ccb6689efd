// Weights of a character's shapes in the words of another set.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "rig/rig.h"
#include "rig/shape_set.h"

namespace volto::rig {

std::vector<std::string> blendshapeNames(const Rig& rig);

// Thread-bound. Allocates in apply().
class ShapeTranslation {
 public:
  // `names`: of the character's shapes. What they mean: `meaning`, or where that is null the shipped set that most of
  // them belong to; names that it does not know mean nothing. Throws InputError when no name means anything. Copies
  // both sets.
  ShapeTranslation(std::span<const std::string> names, const ShapeSet* meaning, const ShapeSet& to);

  const ShapeSet& to() const { return to_; }

  // Weights and which of them were observed (empty: all), one per shape; `out` and `out_observed`: one per shape of the
  // other set. An ARKit shape is observed when one of the shapes that show it is.
  void apply(std::span<const float> weights, std::span<const std::uint8_t> observed, std::span<float> out,
             std::span<std::uint8_t> out_observed) const;

 private:
  ShapeSet from_, to_;
};

}  // namespace volto::rig
