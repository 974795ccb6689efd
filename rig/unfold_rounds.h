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
  bool has(std::uint32_t v) const { return (bits_[(v >> 6U) % kWords] >> (v & 63U) & 1U) != 0; }

 private:
  static constexpr std::size_t kWords = 256;
  std::array<std::uint64_t, kWords> bits_{};
};

// One round over the triangles with a vertex in `before` or moved in this round, which `now` gains. Returns how many
// lacked something.
std::size_t unfoldAround(const FoldGuard& guard, const TouchedVertices& before, TouchedVertices& now,
                         std::span<std::array<float, 3>> positions);

}  // namespace volto::rig
