// Reading and writing meshes: OBJ, PLY, OFF, STL, glTF and GLB in; OBJ out (GLB: tools/export).
//
// Whatever the format, vertices and polygons keep the file's order, so that results drop back into it. An STL file has
// no vertices of its own: equal corners become one, in order of first appearance. A glTF file has several meshes: they
// follow one another in the order of its scene, with the transforms of its nodes applied.
//
// Bad bytes throw InputError with one line: "head.obj:12: face names vertex 9, the file has 8", or for binary files
// "head.ply: @1234: ...". Refused are a mesh without polygons, an index out of range, a position that is not finite, a
// count that the file is too short for (before anything is allocated), and more than 1 000 000 vertices, 2 000 000
// polygons or 256 MiB. What was only odd is a line in Mesh::notes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "rig/errors.h"
#include "rig/mesh.h"

namespace volto::rig {

// Chooses by extension: .obj, .ply, .off, .stl, .gltf, .glb. Throws also std::system_error when the file cannot be
// opened. Files that it names are opened only beside it: the OBJ's material library (colours; a note when it is not
// there) and the glTF's buffers (an error when they are not).
Mesh readMesh(const std::filesystem::path& path);
// Whether readMesh() knows this file name's extension.
bool isMeshFileName(const std::filesystem::path& path);

// OBJ; a vertex may carry a colour after its position, as a screen shows it (sRGB 0..1). No file is opened.
Mesh parseObj(std::string_view text, const std::string& name_for_errors);
// PLY 1.0: ascii and binary of either byte order; elements in any order; colours and texture coordinates of vertices.
Mesh parsePly(std::string_view bytes, const std::string& name_for_errors);
// OFF, the ASCII kind without COFF, NOFF and other prefixes; colours of faces are passed over.
Mesh parseOff(std::string_view text, const std::string& name_for_errors);
// STL, ASCII and binary.
Mesh parseStl(std::string_view bytes, const std::string& name_for_errors);
// glTF 2.0 as JSON or GLB. `folder`: where its external buffers may lie; empty: they are refused.
Mesh parseGltf(std::string_view bytes, const std::string& name_for_errors, const std::filesystem::path& folder = {});

// A mesh with named shapes of it: glTF's morph targets.
struct ShapedMesh {
  Mesh mesh;
  std::vector<std::string> names;          // of each shape, in order of first appearance in the file; none is empty
  std::vector<VertexPositions> positions;  // one per name: #V by 3, where that shape at weight 1 puts the vertices
};
// As parseGltf(), with the morph targets: shapes of one name in several meshes are one; targets without a name are called
// "target 0", ... Throws InputError also when there are none, or two of one name in one mesh.
ShapedMesh parseGltfShapes(std::string_view bytes, const std::string& name_for_errors,
                           const std::filesystem::path& folder = {});
ShapedMesh readGltfShapes(const std::filesystem::path& path);

struct ObjOptions {
  std::string material_library;  // file name for mtllib; empty: none is named
  bool normals = false;          // smooth normals, one per vertex
};

// The OBJ text of a mesh: parseObj(formatObj(m, m.positions)) is m again, to the bit but for vertex colours, which are
// rounded. Throws std::invalid_argument when the number of positions is another or one is not finite.
std::string formatObj(const Mesh& mesh, const VertexPositions& positions, const ObjOptions& options = {});

// Writes vertices in order; positions may be replaced by a deformed set of the same size. Written whole or not at all
// (temporary file, rename).
void writeObj(const std::filesystem::path& path, const Mesh& mesh, const VertexPositions& positions,
              const ObjOptions& options = {});
// Colours of the materials, for ObjOptions::material_library.
void writeMtl(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace volto::rig
