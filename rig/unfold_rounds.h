// The rounds after the first one of bringing back folded triangles (rig/fold_guard.h): only around what the round before
// has moved. Internal to rig/.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "rig/fold_guard.h"

namespace volto::rig {

// A set of vertices in two kilobytes, whatever their number: says yes to all that were added, and to a few others.
class TouchedVertices {
 public:
  void addAll() { bits_.fill(~std::uint64_t{0}); }
  void clear() { bits_.fill(0); }
  void add(std::uint32_t v) { bits_[(v >> 6U) % kWords] |= std::uint64_t{1} << (v & 63U); }
  bool has(std::uint32_t v) const { return bit(v) != 0; }
  bool hasAny(const std::array<std::uint32_t, 3>& v) const { return (bit(v[0]) | bit(v[1]) | bit(v[2])) != 0; }
  void addAll(const TouchedVertices& other) {
    for (std::size_t i = 0; i < kWords; ++i) bits_[i] |= other.bits_[i];
  }

 private:
  std::uint64_t bit(std::uint32_t v) const { return bits_[(v >> 6U) % kWords] >> (v & 63U) & 1U; }
  static constexpr std::size_t kWords = 256;
  std::array<std::uint64_t, kWords> bits_{};
};

// One round over the triangles with a vertex in `reach`: what the round before has moved, to which come those moved in
// this one. `now` gains these too. Returns how many lacked something.
std::size_t unfoldAround(const FoldGuard& guard, TouchedVertices& reach, TouchedVertices& now,
                         std::span<std::array<float, 3>> positions);

}  // namespace volto::rig
