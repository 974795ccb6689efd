// The rounds of bringing back folded triangles (rig/fold_guard.h): the first one over all that are watched, those after
// it only around what the round before has moved. Internal to rig/.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rig/fold_guard.h"

namespace volto::rig {

// A set of vertices in two kilobytes, whatever their number: says yes to all that were added, and to a few others.
class TouchedVertices {
 public:
  void addAll(const TouchedVertices& other) {
    for (std::size_t i = 0; i < kWords; ++i) bits_[i] |= other.bits_[i];
    groups_ |= other.groups_;
  }
  void clear() {
    bits_.fill(0);
    groups_ = 0;
  }
  void add(std::uint32_t v) {
    bits_[(v >> 6U) % kWords] |= std::uint64_t{1} << (v & 63U);
    groups_ |= groupOf(v);
  }
  bool hasAny(const std::array<std::uint32_t, 3>& v) const { return (bit(v[0]) | bit(v[1]) | bit(v[2])) != 0; }

  // Vertices that follow each other make a group, one bit of 64; the groups of all that were added.
  std::uint64_t groups() const { return groups_; }
  static std::uint64_t groupOf(std::uint32_t v) { return std::uint64_t{1} << ((v >> 7U) & 63U); }

 private:
  std::uint64_t bit(std::uint32_t v) const { return bits_[(v >> 6U) % kWords] >> (v & 63U) & 1U; }

  static constexpr std::size_t kWords = 256;
  std::array<std::uint64_t, kWords> bits_{};
  std::uint64_t groups_ = 0;
};

// A guard's triangles in blocks that follow each other, and the groups of vertices in each: most of them can be passed
// over at one look.
class TriangleBlocks {
 public:
  explicit TriangleBlocks(const FoldGuard& guard);
  std::size_t size() const { return size_; }  // triangles in a block
  std::uint64_t groups(std::size_t block) const { return groups_[block]; }

 private:
  static constexpr std::size_t kMostBlocks = 256;
  std::size_t size_;
  std::array<std::uint64_t, kMostBlocks> groups_{};
};

// One round over the first `count` triangles: each that lacks something gets three times `least`. `now` gains what was
// moved. Returns how many lacked something; 0: nothing was touched.
std::size_t unfoldFirst(const FoldGuard& guard, std::size_t count, TouchedVertices& now,
                        std::span<std::array<float, 3>> positions);

// One round over the triangles with a vertex in `reach`: what the round before has moved, to which come those moved in
// this one. `now` gains these too. `blocks`: of this guard. Returns how many lacked something.
std::size_t unfoldAround(const FoldGuard& guard, const TriangleBlocks& blocks, TouchedVertices& reach,
                         TouchedVertices& now, std::span<std::array<float, 3>> positions);

}  // namespace volto::rig
