// How the parts that turn as bones do answer to the blendshapes: the jaw's teeth and tongue, the eyeballs.
#pragma once

#include <vector>

#include "rig/rig.h"

namespace volto::rig {

// `rig`: with its points, parts, operator and blendshapes. The jaw turns about an axis from ear to ear; how far is read
// from what each jaw shape does to the chin, of which the bone makes the larger part. Measured on ICT-FaceKit, whose
// jawOpen is a rotation by 25.4 degrees about an axis 0.33 eye separations behind the lower ends of the ears: the
// boss of the chin goes 0.89 of the bone's way there. Shapes that are not of the jaw do not move its bone. An eyeball
// turns by what an iPhone's recordings give as eye angles for a full eyeLook weight: 0.60 rad in and out, 0.41 up, 0.65
// down.
std::vector<PartMotion> partMotions(const Rig& rig);

}  // namespace volto::rig
