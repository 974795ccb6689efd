// The inner loop of Deformer, compiled once per instruction set (Google Highway) and chosen at run time.
#pragma once

#include "retarget/deformer.h"

namespace volto::retarget {

// For every vertex in a block: out[vertex] = neutral + weights x displacement. Vertices in no block are left alone.
// Instruction sets with fused multiply-add (AVX2, AVX-512, NEON, ...) give the same bits as each other; without it the
// last bits may differ.
void deformBlocks(const PackedOperator& packed, const MeshMaskDisplacement& displacement, Vertex* out);

// Name of the instruction set in use, for reports: "AVX2".
const char* deformKernelTarget();

}  // namespace volto::retarget
