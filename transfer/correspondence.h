// Which place of one head is which place of another whose mesh is another: both were found on the generic head
// (Orvalho, Zacur, Susin, section 4), and what lies under the same place of the generic head corresponds.
#pragma once

#include <span>
#include <vector>

#include "rig/rig.h"
#include "transfer/deformation_transfer.h"

namespace volto::transfer {

// For the skin of the face, up to a third of an eye separation beyond the control mask; elsewhere, inside the mouth and
// on separate parts there is none (kNone, no weights). Only source_triangle, source_place and source_point are filled. Fits the
// generic head to both (some 1.5 s for two heads on two cores). Throws rig::InputError when the points are on no face.
Correspondence correspondThroughGenericHead(const rig::Rig& source, const rig::Rig& target);

// Vertices that no place corresponds to and that corresponding skin encloses: the inside of the mouth, of the lids, of
// the nostrils. They belong to their rim, wherever that goes. One per vertex of `mesh`.
std::vector<bool> enclosedByCorrespondence(const rig::Mesh& mesh, const Correspondence& correspondence,
                                           std::span<const std::uint32_t> same_as);

// The lips and lids of both that face each other, column by column, where both have them.
std::vector<SlitPair> slitPairs(const rig::Rig& source, const rig::Rig& target);

}  // namespace volto::transfer
