// Any bytes, taken for a glTF or GLB file: refused with one line that names the file, or a mesh whose indices and
// numbers can be trusted.
#include <cstdlib>

#include "rig/errors.h"
#include "rig/gltf_skin.h"
#include "tests/fuzz/mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  volto::fuzz::tryMesh(
      {reinterpret_cast<const char*>(data), size},
      [](std::string_view bytes, const std::string& name) { return volto::rig::parseGltf(bytes, name); });
  try {
    const auto skin = volto::rig::parseGltfSkin({reinterpret_cast<const char*>(data), size}, "fuzz");
    for (std::size_t v = 0; v < skin.joint.size(); ++v)
      for (std::size_t i = 0; i < 4; ++i)
        if (skin.weight[v][i] < 0 || (skin.weight[v][i] > 0 && skin.joint[v][i] >= skin.joints.size())) std::abort();
  } catch (const volto::rig::InputError&) {
  }
  return 0;
}
