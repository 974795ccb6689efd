// A folder of meshes that are one mesh, moved: expressions of a character, by file name.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "rig/mesh.h"

namespace volto::transfer {

struct MeshSet {
  std::vector<std::string> names;               // file names without their ending, ascending
  std::vector<std::filesystem::path> files;     // one per name
  std::vector<rig::VertexPositions> positions;  // one per name, #V by 3

  std::size_t size() const { return names.size(); }
};

// Reads every mesh in `folder` (endings that rig::readMesh knows; the rest is passed over), several at a time. Each
// must have the vertices and polygons of `neutral`, in its order. Throws rig::InputError: a mesh of another topology
// (names it and both counts), two files of one name, a folder without meshes; std::system_error when it cannot be read.
MeshSet readMeshSet(const std::filesystem::path& folder, const rig::Mesh& neutral, int threads = 0);

// Names of the meshes that do not move at all: further than 1e-6 of the mesh's size nowhere.
std::vector<std::string> stillMeshes(const MeshSet& set, const rig::Mesh& neutral);

}  // namespace volto::transfer
