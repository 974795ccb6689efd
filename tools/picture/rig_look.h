// A look for a rigged character: the rig knows where the lips and brows are, and what its parts are called.
#pragma once

#include <vector>

#include "rig/rig.h"
#include "tools/picture/look.h"

namespace volto::picture {

// A mesh with materials keeps them (lookOf). One without gets its parts by their names (eyeballs with iris, teeth,
// tongue, lashes), lips and eyebrows painted on the skin between the feature points, and a dark inside of the mouth, so
// that an expression can be read.
Look lookOfRig(const rig::Rig& rig);

// The feature points of the mask's outline and what lies inside: what HeadRenderer::focusOn() wants for a picture of
// the face.
std::vector<Vec3> facePoints(const rig::Rig& rig);

}  // namespace volto::picture
