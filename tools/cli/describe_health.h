// The health of a rig, as JSON and in a few lines.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "rig/rig.h"

namespace volto::cli {

// {"vertices": {...}, "unassigned", "doubtful", "regions": {...}, "smoothness": {...}, "expressions": {...}}.
// `problems` gets one sentence for each thing that a person should mend. About a tenth of a second.
nlohmann::ordered_json describeHealth(const rig::Rig& rig, nlohmann::ordered_json& problems);

// Five lines at most, and the problems.
std::string healthInWords(const nlohmann::ordered_json& health, const nlohmann::ordered_json& problems);

}  // namespace volto::cli
