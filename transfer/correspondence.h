// Which place of one head is which place of another whose mesh is another: both were found on the generic head (Orvalho,
// Zacur, Susin, section 4), and what lies under the same place of the generic head corresponds.
#pragma once

#include "rig/rig.h"
#include "transfer/deformation_transfer.h"

namespace volto::transfer {

// For the skin of the face, up to a third of an eye separation beyond the control mask; elsewhere, inside the mouth and on
// separate parts there is none (kNone, no weights). Only source_triangle and source_point are filled. Fits the generic
// head to both (some 1.5 s for two heads on two cores). Throws rig::InputError when the points are on no face.
Correspondence correspondThroughGenericHead(const rig::Rig& source, const rig::Rig& target);

// The lips and lids of both that face each other, column by column, where both have them.
std::vector<SlitPair> slitPairs(const rig::Rig& source, const rig::Rig& target);

}  // namespace volto::transfer
