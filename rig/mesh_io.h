// Reading and writing meshes. First version: OBJ.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "rig/errors.h"
#include "rig/mesh.h"

namespace volto::rig {

// Chooses by extension. Throws InputError ("head.obj:12: face names vertex 9, the file has 8"), std::system_error when
// the file cannot be opened. A mesh without polygons, with an index out of range or with a position that is not finite
// is refused.
Mesh readMesh(const std::filesystem::path& path);
Mesh parseObj(std::string_view text, const std::string& name_for_errors);

// The OBJ text of a mesh: parseObj(formatObj(m, m.positions)) is m again, to the bit. Throws std::invalid_argument when
// the number of positions is another or one is not finite.
std::string formatObj(const Mesh& mesh, const VertexPositions& positions);

// Writes vertices in order; positions may be replaced by a deformed set of the same size. Written whole or not at all
// (temporary file, rename).
void writeObj(const std::filesystem::path& path, const Mesh& mesh, const VertexPositions& positions);

}  // namespace volto::rig
