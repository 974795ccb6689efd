// Polygons that run the wrong way round.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rig/finding/face_frame.h"
#include "rig/finding/surface_samples.h"

namespace volto::rig {

struct Winding {
  std::vector<std::uint32_t> reversed;  // polygons, ascending
  bool face_reversed = false;
};

// Patches of polygons that agree with each other along their edges are turned as a whole: outward is where a patch is
// seen from, and on the face, in front. What says nothing of itself (hidden, or seen from both sides alike) follows the
// rest. `samples`, `hidden_triangles` (one for each sample that is not seen), `frame`: as of sampleVisibleSurface().
// O(E log E).
Winding findReversedPolygons(const Mesh& mesh, std::span<const SurfaceSample> samples,
                             std::span<const std::uint32_t> hidden_triangles, const FaceFrame& frame);

}  // namespace volto::rig
