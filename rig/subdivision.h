// Adaptive subdivision of the control mask (Queiroz, section V-A1, Figure 8): a triangle is split in three at the vertex
// of the mesh that is nearest to its centroid among those associated with it; recursively; for all triangles, for chosen
// ones, or where an example set is reproduced worst.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rig/skin_rows.h"

namespace volto::rig {

// Of `mask` (controlMaskOnSkin). A triangle in whose inside no vertex is left stays as it is, so there are never two
// points at one vertex. `examples`: displacements of all vertices (#V by 3 each), used by the automatic choice alone:
// each counts by its error relative to its own size. Throws InputError for a vertex that is on no triangle, and for an
// automatic choice without examples.
MaskOnSkin subdivide(const SkinProblem& problem, MaskOnSkin mask, const Subdivision& wanted,
                     std::span<const VertexPositions> examples);

}  // namespace volto::rig
