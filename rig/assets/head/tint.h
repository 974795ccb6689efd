// What a vertex's colour is multiplied by: blood under the skin, shade where skin folds, strands of hair, the iris's
// rays. Painted on the adult's form and carried along with its vertices.
#pragma once

#include "rig/assets/head/half_mesh.h"

namespace volto::head {

// Linear factors up to 1, where they are strongest.
struct Tints {
  Vec3 blush{1.0, 0.70, 0.66};   // cheeks, nose, ears, chin
  Vec3 shade{0.62, 0.50, 0.47};  // lid crease, nostrils, behind the nose wing, the root of the hair
  Vec3 crown{1, 1, 1};           // skull without hair
  double hair = 0.55;            // in the furrows between locks
};

void tintSkin(const Tints& tints, HalfMesh& skin);
void tintEyeball(HalfMesh& eyeball);
void tintMouthPart(HalfMesh& part);  // teeth, tongue: darker towards the throat

}  // namespace volto::head
