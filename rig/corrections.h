// What 84 points cannot say of an expression, worked out on the mesh when a character is rigged: lids that meet, a
// puffed cheek that is round, a tongue that comes out, lips that stay in front of the teeth, skin that does not fold
// over; and the same for shapes that go wrong together.
#pragma once

#include "rig/rig.h"
#include "rig/skin.h"

namespace volto::rig {

// Fills the blendshapes' corrections and the combinations. `rig`: complete otherwise, with contacts and part motions. A
// shape is known by its ARKit name; shapes of other names are only freed of folds. Deterministic.
void makeCorrections(Rig& rig, const Skin& skin);

}  // namespace volto::rig
