// Mesh deformation per frame: vertex displacement = operator x mask displacement (rig/rig.h), repacked for speed.
//
// The operator has one weight per vertex and control point, the same for x, y and z. Vertices that follow the same
// control points are gathered into blocks of 16 lanes; a block lists its control points once and stores its weights as
// 16-bit fixed point, control point by control point, so that one vector instruction serves many vertices and the
// weights are read from memory once, in order. Results are scattered into the artist's vertex order. The kernel
// (deform_kernel.h) is compiled for several instruction sets and chosen at run time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "frames/mask_frame.h"
#include "rig/rig.h"

namespace volto::retarget {

using Vertex = std::array<float, 3>;

// Displacement of each feature point from neutral in the mesh's own unit and frame. Row i is feature point i.
using MeshMaskDisplacement = std::array<std::array<float, 3>, kFeaturePointCount>;

inline constexpr std::size_t kBlockLanes = 16;

// Up to 16 vertices that share a list of control points.
struct DeformBlock {
  std::uint32_t first_point;  // into PackedOperator::points; its weights start at 16 times this
  std::uint16_t point_count;
  std::uint8_t lane_count;  // 1..16; the weights of unused lanes are zero
  bool in_order;            // all 16 lanes used by vertices vertex[0], vertex[0] + 1, ...
  float weight_unit;        // weight = weight_unit * fixed-point number
};

struct PackedOperator {
  std::vector<DeformBlock> blocks;
  std::vector<std::uint8_t> points;   // control point indices, block after block
  std::vector<std::int16_t> weights;  // 16 per entry of points: one per lane
  std::vector<float> neutral;         // 48 per block: x of 16 lanes, y, z; mesh frame and unit
  std::vector<std::uint32_t> vertex;  // 16 per block: vertex index of each lane
  struct Run {
    std::uint32_t first, count;
  };
  std::vector<Run> unmoved;  // vertices that never move, as runs of consecutive indices
};

// Thread-safe after construction (deform() is const and touches only its arguments). Borrows nothing.
class Deformer {
 public:
  // `deformation`: #V rows over 84 control points. `neutral`: #V vertex positions, mesh frame. Throws
  // std::invalid_argument when the sizes do not agree, a control point does not exist or a number is not finite.
  Deformer(const rig::DeformationOperator& deformation, std::span<const Vertex> neutral);

  std::size_t vertexCount() const { return neutral_.size(); }
  // Entries of the operator, and entries as packed, with the zeros that fill up the blocks: how well the packing fits.
  std::size_t entryCount() const { return entry_count_; }
  std::size_t packedEntryCount() const { return packed_.points.size() * kBlockLanes; }

  // Writes all #V positions, artist's order: neutral + operator x displacement. `displacement` must be finite. No
  // displacement at all gives the neutral bit for bit. No allocation. Against the product in double precision the error
  // stays under 1e-4 of the largest displacement.
  void deform(const MeshMaskDisplacement& displacement, std::span<Vertex> out) const;

 private:
  std::vector<Vertex> neutral_;
  PackedOperator packed_;
  std::size_t entry_count_ = 0;
};

}  // namespace volto::retarget
