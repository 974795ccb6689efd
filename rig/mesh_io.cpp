#include "rig/mesh_io.h"

#include <charconv>
#include <map>
#include <stdexcept>

#include "rig/file_bytes.h"
#include "rig/gltf_skin.h"
#include "rig/mesh_builder.h"
#include "rig/mtl_reader.h"
#include "rig/obj_reader.h"

namespace volto::rig {
namespace {

void append(std::string& out, double x) {
  char digits[32];
  out.append(digits, std::to_chars(digits, digits + sizeof digits, x).ptr);
}
void append(std::string& out, float x) {
  char digits[32];
  out.append(digits, std::to_chars(digits, digits + sizeof digits, x).ptr);
}
void append(std::string& out, std::size_t x) {
  char digits[32];
  out.append(digits, std::to_chars(digits, digits + sizeof digits, x).ptr);
}

}  // namespace

namespace {

std::string extensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

std::filesystem::path folderOf(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

bool isMeshFileName(const std::filesystem::path& path) {
  const std::string extension = extensionOf(path);
  for (const char* known : {".obj", ".ply", ".off", ".stl", ".gltf", ".glb"})
    if (extension == known) return true;
  return false;
}

Mesh readMesh(const std::filesystem::path& path) {
  const std::string extension = extensionOf(path), name = path.string();
  const std::string bytes = readFileBytes(path, kMaxMeshFileBytes);
  if (extension == ".obj") {
    std::vector<std::string> libraries;
    Mesh mesh = parseObj(bytes, name, libraries);
    if (!mesh.materials.empty()) readMaterialLibraries(folderOf(path), libraries, mesh);
    return mesh;
  }
  if (extension == ".ply") return parsePly(bytes, name);
  if (extension == ".off") return parseOff(bytes, name);
  if (extension == ".stl") return parseStl(bytes, name);
  if (extension == ".gltf" || extension == ".glb") return parseGltf(bytes, name, folderOf(path));
  throw InputError(name + ": cannot read '" + extension + "' meshes; give an OBJ, PLY, OFF, STL, glTF or GLB file");
}

ShapedMesh readGltfShapes(const std::filesystem::path& path) {
  return parseGltfShapes(readFileBytes(path, kMaxMeshFileBytes), path.string(), folderOf(path));
}

GltfSkin readGltfSkin(const std::filesystem::path& path) {
  return parseGltfSkin(readFileBytes(path, kMaxMeshFileBytes), path.string(), folderOf(path));
}

std::string formatObj(const Mesh& mesh, const VertexPositions& positions, const ObjOptions& options) {
  if (positions.rows() != mesh.positions.rows())
    throw std::invalid_argument("formatObj: " + std::to_string(positions.rows()) + " positions for a mesh of " +
                                std::to_string(mesh.vertexCount()) + " vertices");
  if (!positions.allFinite()) throw std::invalid_argument("formatObj: a position is not finite");
  std::string out;
  out.reserve(mesh.vertexCount() * (options.normals ? 96 : 48) + mesh.corner_vertices.size() * 8);
  if (!options.material_library.empty()) out += "mtllib " + options.material_library + '\n';
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    out += 'v';
    for (int axis = 0; axis < 3; ++axis) append(out += ' ', positions(v, axis));
    if (!mesh.vertex_colours.empty())
      for (const float part : mesh.vertex_colours[static_cast<std::size_t>(v)])
        append(out += ' ', displayFromLinear(part));
    out += '\n';
  }
  if (options.normals) {
    const VertexPositions normals = smoothNormals(mesh, positions);
    for (Eigen::Index v = 0; v < normals.rows(); ++v) {
      out += "vn";
      for (int axis = 0; axis < 3; ++axis) append(out += ' ', static_cast<float>(normals(v, axis)));
      out += '\n';
    }
  }
  std::vector<std::size_t> corner_texcoord;
  if (!mesh.corner_texcoords.empty()) {
    std::map<std::array<float, 2>, std::size_t> numbered;
    corner_texcoord.reserve(mesh.corner_texcoords.size());
    for (const auto& uv : mesh.corner_texcoords) {
      const auto [entry, fresh] = numbered.emplace(uv, numbered.size() + 1);
      corner_texcoord.push_back(entry->second);
      if (!fresh) continue;
      append(out += "vt ", uv[0]);
      append(out += ' ', uv[1]);
      out += '\n';
    }
  }
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    if (!mesh.polygon_material.empty() && (p == 0 || mesh.polygon_material[p] != mesh.polygon_material[p - 1]))
      out += "usemtl " + mesh.materials.at(mesh.polygon_material[p]).name + '\n';
    out += 'f';
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c) {
      append(out += ' ', static_cast<std::size_t>(mesh.corner_vertices[c]) + 1);
      if (!corner_texcoord.empty()) append(out += '/', corner_texcoord[c]);
      if (options.normals)
        append(out += corner_texcoord.empty() ? "//" : "/", static_cast<std::size_t>(mesh.corner_vertices[c]) + 1);
    }
    out += '\n';
  }
  return out;
}

void writeObj(const std::filesystem::path& path, const Mesh& mesh, const VertexPositions& positions,
              const ObjOptions& options) {
  writeFileAtomically(path, formatObj(mesh, positions, options));
}

void writeMtl(const std::filesystem::path& path, const Mesh& mesh) { writeFileAtomically(path, formatMtl(mesh)); }

}  // namespace volto::rig
