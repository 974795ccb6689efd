// A polygon mesh as the artist's file has it: vertex order, polygon order and unit are kept, so that results drop back
// into it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace volto::rig {

// V by 3, row i is vertex i.
using VertexPositions = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

struct Mesh {
  VertexPositions positions;                   // #V by 3, the file's own unit and frame
  std::vector<std::uint32_t> corner_vertices;  // polygon corners one after the other: 0-based vertex index of each
  std::vector<std::uint32_t> polygon_start;    // #P + 1: polygon p is corners [polygon_start[p], polygon_start[p + 1])

  // Optional, for drawing and for writing files back: empty, or as many as said.
  std::vector<std::array<float, 2>>
      corner_texcoords;                              // one per corner; as in OBJ, (0, 0) is the lower left of the image
  std::vector<std::array<float, 3>> vertex_colours;  // one per vertex: linear RGB 0..1
  std::vector<std::uint32_t> polygon_material;       // one per polygon: index into materials
  struct Material {
    std::string name;
    std::array<float, 3> colour{0.8F, 0.8F, 0.8F};  // linear RGB 0..1
  };
  std::vector<Material> materials;

  // What a reader passed over or mended, one line each; of this reading, not of the mesh: no file keeps it.
  std::vector<std::string> notes;

  std::size_t vertexCount() const { return static_cast<std::size_t>(positions.rows()); }
  std::size_t polygonCount() const { return polygon_start.empty() ? 0 : polygon_start.size() - 1; }
};

// Fan triangulation of every polygon: #T by 3 vertex indices, in polygon order.
std::vector<std::array<std::uint32_t, 3>> triangulate(const Mesh& mesh);

// Unit normals of the vertices at `positions`: the mean of their polygons' normals weighted by area; (0, 0, 1) for a
// vertex in no polygon with an area. Vertices at the very same place in mesh.positions (seams of texture coordinates)
// share one normal, unless their sides face apart, as closed lips do. #V by 3.
VertexPositions smoothNormals(const Mesh& mesh, const VertexPositions& positions);

// Connected components over shared vertices: component[v], numbered 0.. in order of first vertex; vertices in no
// polygon get one of their own.
std::vector<std::uint32_t> connectedComponents(const Mesh& mesh);

// What is odd about a mesh without being wrong.
struct MeshHealth {
  std::size_t unused_vertices = 0;      // in no polygon
  std::size_t degenerate_polygons = 0;  // a vertex twice
  std::size_t duplicate_polygons = 0;   // the same vertices as one before, whatever their order
};
MeshHealth inspectMesh(const Mesh& mesh);

// Whether both are the same mesh, vertex by vertex and polygon by polygon, with vertices moved.
bool sameTopology(const Mesh& a, const Mesh& b);

// Throws InputError when `other` is not the same mesh as `neutral` with vertices moved; names both counts.
void requireSameTopology(const Mesh& neutral, const Mesh& other, const std::string& name_for_errors);

}  // namespace volto::rig
