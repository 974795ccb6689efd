// "Did you mean": the known word nearest to a mistyped one.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace volto::cli {

// The word with the smallest edit distance (insert, delete, change, swap of neighbours), when at most a third of the
// letters are wrong or the typed word begins it; else empty.
std::string nearestMatch(std::string_view typed, std::span<const std::string> known);

}  // namespace volto::cli
