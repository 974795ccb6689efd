// A character's own set of blendshapes, made from meshes: an artist's, another program's, or what a transfer came to.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "rig/rig.h"

namespace volto::retarget {

// Replaces the rig's blendshapes, combinations and part motions by the shapes given: at weight 1 a shape puts the
// vertices where its mesh has them (to single precision; but for contacts, which are kept). The motion of the mask is
// read off the mesh at the feature points, so that a live face finds its weights on this set. Eyeballs turn about their
// centres as the meshes turn them.
//
// A shape whose name joins others of the set by '+', as browDown_L+eyeBlink_L, is a combination: nobody chooses its
// weight, it is the product of theirs. Its mesh shows what it adds to the face at rest, as a morph target does, not what
// all three come to.
//
// `positions`: one per name, #V by 3, mesh frame and unit. Throws rig::InputError: no shapes, a name empty, twice or
// longer than 200 bytes, a mesh of another number of vertices, a position that is not finite, a
// combination with a part that is no shape. Shapes that do not move
// are kept. Returns the names of those.
std::vector<std::string> replaceBlendshapes(rig::Rig& rig, std::span<const std::string> names,
                                            std::span<const rig::VertexPositions> positions);

}  // namespace volto::retarget
