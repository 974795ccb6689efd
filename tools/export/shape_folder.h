// A character's blendshapes as a folder of OBJ files.
#pragma once

#include <filesystem>
#include <functional>

#include "rig/rig.h"

namespace volto::exporter {

// Writes neutral.obj, one SHAPE.obj per blendshape at weight 1, and materials.mtl that they name, into `folder`, which
// is there: the artist's vertices, polygons, texture coordinates and materials, with smooth normals. Calls `progress`
// with the number of files done; stops when it returns false. Throws std::system_error, and rig::InputError when a
// blendshape's name cannot be a file name.
void writeShapeFolder(const std::filesystem::path& folder, const rig::Rig& rig,
                      const std::function<bool(std::size_t)>& progress);

}  // namespace volto::exporter
