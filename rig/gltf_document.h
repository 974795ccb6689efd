// The bytes of a glTF or GLB file, taken apart safely: container, JSON, buffers. What the mesh in it is,
// gltf_reader.cpp knows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "rig/tinygltf.h"

namespace volto::rig {

// Borrows the bytes given to openGltf().
struct GltfDocument {
  tinygltf::Model model;  // meshes, skins, nodes, scenes, accessors, bufferViews, materials; no images, no buffers
  std::vector<std::string_view> buffers;
  std::vector<std::string> owned;  // bytes of buffers that are not part of the file itself
  std::vector<bool> textured;      // of each material: its colour comes from an image, which is not read
  std::vector<std::vector<std::string>> target_names;  // of each mesh: extras.targetNames; empty where it has none
};

// Throws InputError "name: @byte: what" or "name: what". Checked here: the GLB container, JSON (depth at most 64),
// version 2, extensions that are required, buffers (GLB chunk, base64, or a file below `folder` that is reached without
// "..", a link or an absolute path; empty `folder`: none). Not checked: indices and sizes of accessors and views, see
// GltfAccessor.
GltfDocument openGltf(std::string_view bytes, const std::string& name, const std::filesystem::path& folder);

// The values of an accessor as double, normalised integers as 0..1 or -1..1, sparse ones with their changes. Throws
// InputError when it does not exist, holds another number of components than `components` or more than `most` elements,
// or reaches beyond its view or buffer.
std::vector<double> readAccessor(const GltfDocument& document, int accessor, std::size_t components, std::size_t most,
                                 const std::string& name);

}  // namespace volto::rig
