// The skin of a glTF mesh: the bones that carry it. Volto deforms faces without bones; a skin is kept for the programs
// that an exported character goes to.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

namespace volto::rig {

struct GltfSkin {
  struct Joint {
    std::string name;
    std::int32_t parent = -1;  // index of the next joint above it; it comes before its children
    Eigen::Affine3d mesh_from_joint = Eigen::Affine3d::Identity();  // where it stands when the mesh is at rest
  };
  std::vector<Joint> joints;
  std::vector<std::array<std::uint16_t, 4>> joint;  // #V, in the order of parseGltf(): indices into joints
  std::vector<std::array<float, 4>> weight;         // #V: sum 1, or all 0 for a vertex that no bone carries
};

// Empty (no joints) for a file without a skin. Throws InputError as parseGltf() does, and for joints or weights that
// are damaged: joints that do not exist, bind matrices that cannot be inverted, weights below 0.
GltfSkin parseGltfSkin(std::string_view bytes, const std::string& name_for_errors,
                       const std::filesystem::path& folder = {});
GltfSkin readGltfSkin(const std::filesystem::path& path);

}  // namespace volto::rig
