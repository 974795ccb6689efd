// What belongs to the head besides the skin, each a component of its own: eyeballs, teeth, tongue, lashes and brows.
#pragma once

#include "rig/assets/head/half_mesh.h"

namespace volto::head {

// Left half of each part; a part on the midline has its midline vertices marked, the others stand wholly on the left.
HalfMesh makeEyeball(double iris_size = 1, double pupil_size = 1);  // sizes: of the adult's
HalfMesh makeUpperTeeth();
HalfMesh makeLowerTeeth();
HalfMesh makeTongue();
HalfMesh makeUpperLashes();
HalfMesh makeBrow();

// Where the brow's middle line runs (t 0 at the inner end, 1 at the outer end), on the skin.
Vec3 browLine(double t);

}  // namespace volto::head
