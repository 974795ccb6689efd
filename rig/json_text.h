// Reading JSON that people write: what is wrong is one line, names that are nearly right get a suggestion.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace volto::rig {

// Throws InputError "NAME: not valid JSON: ...", also for what is nested too deeply or given twice.
nlohmann::json parseJsonText(std::string_view text, const std::string& name_for_errors, int max_depth = 8);

// Keys come from files: what is shown of them is short and printable.
std::string shownKey(std::string_view key);

// The one of `names` (not empty) that takes the fewest edits to reach.
std::string_view nearestName(std::string_view name, std::span<const std::string_view> names);

}  // namespace volto::rig
