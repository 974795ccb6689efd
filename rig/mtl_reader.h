// Material libraries of OBJ files: colours only, from the OBJ's own folder only.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "rig/mesh.h"

namespace volto::rig {

// Gives materials of `mesh` the diffuse colour (Kd, taken as linear) that the library's text has for their name. Lines
// that mean nothing here are passed over; nothing throws.
void applyMaterialLibrary(std::string_view text, Mesh& mesh);

// Reads what an OBJ file in `folder` names after mtllib and applies it. Only a plain file name is followed, to a
// regular file of at most 4 MiB in that very folder, never a path, a link, a pipe or a device. What is not opened is a
// line in mesh.notes: a mesh without its colours is still a mesh.
void readMaterialLibraries(const std::filesystem::path& folder, std::span<const std::string> names, Mesh& mesh);

// The text of a library with the mesh's materials, for what formatObj() writes.
std::string formatMtl(const Mesh& mesh);

}  // namespace volto::rig
