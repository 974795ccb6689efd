// What a file holds, as JSON, and the same in words.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace volto::cli {

using Json = nlohmann::ordered_json;

// Told by content. "kind" says which: "rig", "take", "mesh", "OpenFace CSV", "Live Link Face CSV"; "problems" is a list
// of lines, empty for a file in good health. Throws as the readers of each kind do.
Json describeFile(const std::filesystem::path& path);

Json describeRig(const std::filesystem::path& path);
Json describeTake(const std::filesystem::path& path);
Json describeMesh(const std::filesystem::path& path);
Json describePerformance(const std::filesystem::path& path);

// A screen at most: what is long is counted.
std::string describeInWords(const Json& description);

}  // namespace volto::cli
