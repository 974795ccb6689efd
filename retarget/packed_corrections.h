// The corrections of a rig's blendshapes and combinations (rig/rig.h), packed for adding: a sixth of the memory, which
// is what adding them costs while a network keeps pushing it out of the processor's cache.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "retarget/deformer.h"
#include "rig/rig.h"

namespace volto::retarget {

// One correction. Displacements in fixed point, and in runs of vertices that follow each other in the mesh.
struct PackedCorrection {
  struct Run {
    std::uint32_t first, count;  // vertices
  };
  float unit = 0;  // mesh units per step; the largest displacement is kFixedPointMax steps
  std::vector<Run> runs;
  std::vector<std::int16_t> steps;  // x, y, z of each vertex, run after run
};

// Exact to half a step, a 65 000th of the correction's largest displacement.
PackedCorrection pack(const rig::SparseDisplacement& correction);

// positions += weight x displacement. Rounds as deformBlocks() does (retarget/deform_kernel.h).
void add(const PackedCorrection& correction, float weight, Vertex* positions);

// All of a rig's. Borrows nothing; thread-safe after construction; adding allocates nothing.
class PackedCorrections {
 public:
  explicit PackedCorrections(const rig::Rig& rig);

  // `weights`: one per blendshape. The same sum as in rig::addToPose().
  void addTo(std::span<const float> weights, std::span<Vertex> positions) const;

 private:
  std::vector<PackedCorrection> shapes_;
  std::vector<rig::Combination> rules_;  // without their corrections
  std::vector<PackedCorrection> combinations_;
};

}  // namespace volto::retarget
