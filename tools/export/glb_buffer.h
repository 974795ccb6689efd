// The binary half of a GLB file as it grows: numbers in, accessors out.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "rig/tinygltf.h"

namespace volto::exporter {

using Float3 = std::array<float, 3>;

// Borrows the model; everything goes into its first buffer.
class GlbBuffer {
 public:
  explicit GlbBuffer(tinygltf::Model& model);

  // Each returns the accessor's index. `bounds`: with minimum and maximum, which positions and times must have.
  int floats(std::span<const float> values, bool bounds);
  int vectors2(std::span<const std::array<float, 2>> values);
  int vectors3(std::span<const Float3> values, bool bounds);
  int vectors4(std::span<const std::array<float, 4>> values);
  // RGB 0..1 as 16-bit RGBA.
  int colours(std::span<const Float3> values);
  // Of a skin's joints, and its bind matrices, column by column.
  int joints(std::span<const std::array<std::uint16_t, 4>> values);
  int matrices4(std::span<const std::array<float, 16>> values);
  int indices(std::span<const std::uint32_t> values, std::size_t vertices);
  // Only what differs from zero by more than `least` in some component, when that takes fewer bytes.
  int sparseVectors3(std::span<const Float3> values, float least, bool bounds);

 private:
  int view(const void* bytes, std::size_t size, int target);
  int accessor(int view, int component_type, int type, std::size_t count);

  tinygltf::Model& model_;
};

}  // namespace volto::exporter
