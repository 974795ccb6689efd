// How rig/assets/expression_table.csv is made: measured on ICT-FaceKit's artist-made expressions.
#pragma once

#include <filesystem>
#include <string>

namespace volto::rig {

// The whole text of expression_table.csv. `ict` holds neutral.obj and expressions/*.obj; `feature_points_file` names
// the 84 vertex indices on it (P.json). Throws InputError, std::system_error.
std::string measureExpressionTable(const std::filesystem::path& ict, const std::filesystem::path& feature_points_file);

}  // namespace volto::rig
