// What every mesh reader promises, whatever bytes it is given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "rig/mesh_io.h"

namespace volto::fuzz {

inline void require(bool holds) {
  if (!holds) std::abort();
}

template <typename Reader>
void tryMesh(std::string_view bytes, const Reader& read) {
  const std::string name = "m.file";
  try {
    const rig::Mesh mesh = read(bytes, name);
    require(mesh.polygonCount() > 0 && mesh.positions.allFinite());
    require(mesh.polygon_start.front() == 0 && mesh.polygon_start.back() == mesh.corner_vertices.size());
    for (const std::uint32_t vertex : mesh.corner_vertices) require(vertex < mesh.vertexCount());
    for (std::size_t p = 0; p < mesh.polygonCount(); ++p)
      require(mesh.polygon_start[p + 1] >= mesh.polygon_start[p] + 3);
    require(mesh.corner_texcoords.empty() || mesh.corner_texcoords.size() == mesh.corner_vertices.size());
    require(mesh.vertex_colours.empty() || mesh.vertex_colours.size() == mesh.vertexCount());
    require(mesh.polygon_material.empty() || mesh.polygon_material.size() == mesh.polygonCount());
    for (const std::uint32_t material : mesh.polygon_material) require(material < mesh.materials.size());
    for (const std::string& note : mesh.notes) require(note.find('\n') == std::string::npos && note.size() < 400);
    // Written as OBJ it is the same mesh.
    const rig::Mesh again = rig::parseObj(rig::formatObj(mesh, mesh.positions), "again.obj");
    require(again.positions == mesh.positions && again.corner_vertices == mesh.corner_vertices);
    require(again.polygon_start == mesh.polygon_start);
  } catch (const rig::InputError& error) {
    const std::string_view text = error.what();
    require(text.starts_with("m.file") && text.find('\n') == std::string_view::npos && text.size() < 600);
  }
}

}  // namespace volto::fuzz
