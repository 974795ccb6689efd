// Any bytes, taken for an OBJ file: refused with one line that names the file, or a mesh whose indices and numbers can
// be trusted, and that is the same mesh after another trip through a file.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "rig/mesh_io.h"

using namespace volto::rig;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const Mesh mesh = parseObj({reinterpret_cast<const char*>(data), size}, "m.obj");
    require(mesh.polygonCount() > 0 && mesh.positions.allFinite());
    require(mesh.polygon_start.front() == 0 && mesh.polygon_start.back() == mesh.corner_vertices.size());
    for (const std::uint32_t vertex : mesh.corner_vertices) require(vertex < mesh.vertexCount());
    for (std::size_t p = 0; p < mesh.polygonCount(); ++p)
      require(mesh.polygon_start[p + 1] >= mesh.polygon_start[p] + 3);
    const Mesh again = parseObj(formatObj(mesh, mesh.positions), "again.obj");
    require(again.corner_vertices == mesh.corner_vertices && again.polygon_start == mesh.polygon_start);
  } catch (const InputError& error) {
    const std::string_view text = error.what();
    require(text.starts_with("m.obj") && text.find('\n') == std::string_view::npos && text.size() < 600);
  }
  return 0;
}
