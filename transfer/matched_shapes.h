// Shapes that came back from another program: the same head, but in its frame, its unit, its triangles, and with its
// vertices split where textures or normals are cut.
#pragma once

#include <string>
#include <vector>

#include "rig/mesh_io.h"

namespace volto::transfer {

// One per shape of `read`: #V by 3 of `neutral`, its order, frame and unit. As many vertices as `neutral`: they are taken
// in order, and the frame and unit are found from them; other numbers: every vertex of `neutral` is looked for at its
// place. What is read differs from `neutral` at rest by rounding only, within 1e-3 of its size; displacements count. Throws
// rig::InputError with both counts when it is another mesh.
std::vector<rig::VertexPositions> matchedShapes(const rig::Mesh& neutral, const rig::ShapedMesh& read,
                                                const std::string& name_for_errors);

}  // namespace volto::transfer
