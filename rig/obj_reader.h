// The part of the OBJ reader that only readMesh() needs; rig/mesh_io.h has the rest.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "rig/mesh.h"

namespace volto::rig {

// parseObj (rig/mesh_io.h) that also says which material libraries the file names, each as written after mtllib,
// whatever that is: nothing is opened here.
Mesh parseObj(std::string_view text, const std::string& name_for_errors, std::vector<std::string>& material_libraries);

}  // namespace volto::rig
