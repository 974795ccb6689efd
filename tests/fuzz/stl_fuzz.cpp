// Any bytes, taken for an STL file: refused with one line that names the file, or a mesh whose indices and numbers can
// be trusted.
#include "tests/fuzz/mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  volto::fuzz::tryMesh(
      {reinterpret_cast<const char*>(data), size},
      [](std::string_view bytes, const std::string& name) { return volto::rig::parseStl(bytes, name); });
  return 0;
}
