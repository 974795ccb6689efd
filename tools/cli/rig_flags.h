// What `volto rig` is told about subdivision.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rig/mesh.h"
#include "rig/rig_options.h"

namespace volto::cli {

// "2", "auto", "auto:150". Throws CommandError (kWrongUsage).
rig::Subdivision parseSubdivision(const std::string& text, bool has_examples);

// Displacements of all vertices in every mesh of a folder, by file name. Throws CommandError when there is none,
// rig::InputError for a mesh of another topology.
std::vector<rig::VertexPositions> readExamples(const std::filesystem::path& folder, const rig::Mesh& neutral);

}  // namespace volto::cli
