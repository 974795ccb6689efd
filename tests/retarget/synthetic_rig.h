// A made-up character for tests and benchmarks: a curved sheet of skin over 84 scattered control points, with two
// eyeballs, and blendshapes that each move one neighbourhood. Nothing of it comes from the rigging code, so that it can
// serve as truth for it.
#pragma once

#include <cstdint>

#include "rig/rig.h"

namespace volto::test {

struct SyntheticRigOptions {
  std::size_t skin_side = 40;    // the sheet has this many vertices along each side
  std::size_t neighbours = 17;   // control points per region of influence, besides its own
  double size = 1.0;             // of the whole face, any unit
  std::size_t blendshapes = 52;  // the first of them bear the ARKit names
  std::uint32_t seed = 1;
};

// Vertices: the sheet, row by row; then 60 of the left eyeball and 60 of the right. The outer fifth of the sheet does
// not move.
rig::Rig syntheticRig(const SyntheticRigOptions& options = {});

// Displacement, FAPU, of a lively expression: smooth over the face, about 0.1 units.
MaskDisplacements syntheticExpression(std::uint32_t seed, float amplitude = 0.1F);

// The product in double precision, straight from the operator: #V positions.
rig::VertexPositions deformReference(const rig::Rig& rig, const MaskDisplacements& displacement_fapu);

}  // namespace volto::test
