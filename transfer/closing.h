// Lids and lips that meet on the source meet on the target: what is still open between the target's margins, where the
// source's are shut, is closed along the eyeball, and fades out along the skin (rig/contacts.h).
#pragma once

#include <array>
#include <span>

#include "rig/rig.h"

namespace volto::transfer {

// `neutral`, `example`: #V of the source; `result`: #V of the target, whose contacts `contacts` are. A column counts as
// shut where its gap is below a tenth of what it is at rest, or below a hundredth of the eye separation; where that is
// so at rest, the target's own gap at rest remains. Reentrant.
void closeAsSource(const rig::Rig& source, std::span<const std::array<float, 3>> neutral,
                   std::span<const std::array<float, 3>> example, const rig::Rig& target,
                   std::span<const std::array<float, 3>> target_neutral, std::span<std::array<float, 3>> result);

}  // namespace volto::transfer
