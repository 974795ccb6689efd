// All 84 feature points of a head, however many a person gave.
#pragma once

#include <string>
#include <vector>

#include "rig/build_rig.h"

namespace volto::cli {

struct CompletePoints {
  rig::FeaturePointChoices points;  // all 84
  std::vector<std::string> notes;   // one line each: how sure, what to check, what was mended
};

// 84 given: those, checked. At least rig::kFewestPoints: the rest by fitting the generic head to them. Fewer, or none: the face
// is looked for first. Throws rig::InputError.
CompletePoints completePoints(const rig::Mesh& mesh, const rig::FeaturePointChoices& given);

}  // namespace volto::cli
