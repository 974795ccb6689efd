// The inside of lips, cheeks and nostrils: the mask has no point there, but flesh lies between it and the skin in
// front, so it goes where that skin goes. Left to the equations alone it would stay behind, and the skin pass through it.
#pragma once

#include <vector>

#include "rig/association.h"
#include "rig/mesh.h"
#include "rig/skin.h"
#include "rig/skin_equations.h"

namespace volto::rig {

// The vertices of the lining, each tied to the place of the outer skin that it lies behind, the more the thinner the
// flesh and the farther in, since lips roll. Lining is what has no ray and is nearest along the skin to a margin of the lips or to a nostril. One entry at most
// per vertex that stands for itself, ascending; none where the outer skin is farther away than a fifth of the eye
// separation, is not in front, or is of the opposite lip. `is_skin`: per component.
std::vector<SkinTie> findLining(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin,
                                  const SkinAssociation& association, double eye_separation);

}  // namespace volto::rig
