// Our readers against OpenMesh's, on files that OpenMesh wrote: an independent reader and an independent writer. One
// mesh is the same mesh in every format.
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <gtest/gtest.h>

#include "tests/rig/mesh_bytes.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
};
using Reference = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;

// A manifold mesh, which is all that OpenMesh keeps as it is: a ball of triangles with single precision coordinates.
Mesh ball() {
  Mesh mesh;
  constexpr std::uint32_t kAround = 12, kRows = 7;
  mesh.positions.resize(kAround * kRows, 3);
  mesh.polygon_start.push_back(0);
  for (std::uint32_t j = 0; j < kRows; ++j)
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const double a = 6.28318 * i / kAround, b = 3.0 * j / (kRows - 1) - 1.5;
      for (int axis = 0; axis < 3; ++axis)
        mesh.positions(j * kAround + i, axis) =
            static_cast<double>(static_cast<float>(axis == 0   ? std::cos(a) * std::cos(b)
                                                   : axis == 1 ? std::sin(b)
                                                               : std::sin(a) * std::cos(b)));
    }
  for (std::uint32_t j = 0; j + 1 < kRows; ++j)
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      for (const std::uint32_t v : {a, b, b + kAround, a, b + kAround, a + kAround}) mesh.corner_vertices.push_back(v);
      mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size() - 3));
      mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
    }
  return mesh;
}

Reference toReference(const Mesh& mesh) {
  Reference out;
  std::vector<Reference::VertexHandle> handles;
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    handles.push_back(out.add_vertex({mesh.positions(v, 0), mesh.positions(v, 1), mesh.positions(v, 2)}));
  for (std::size_t c = 0; c < mesh.corner_vertices.size(); c += 3)
    out.add_face(handles[mesh.corner_vertices[c]], handles[mesh.corner_vertices[c + 1]],
                 handles[mesh.corner_vertices[c + 2]]);
  return out;
}

void expectSame(const Mesh& mesh, const Mesh& wanted, double tolerance) {
  ASSERT_EQ(mesh.vertexCount(), wanted.vertexCount());
  EXPECT_LE((mesh.positions - wanted.positions).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_EQ(mesh.corner_vertices, wanted.corner_vertices);
  EXPECT_EQ(mesh.polygon_start, wanted.polygon_start);
}

TEST(MeshCompare, WhatOpenMeshWroteIsReadAsTheSameMeshInEveryFormat) {
  const test::TemporaryDir folder;
  const Mesh wanted = ball();
  const Reference reference = toReference(wanted);
  using OpenMesh::IO::Options;
  Options text, binary, big;
  binary += Options::Binary;
  big += Options::Binary;
  big += Options::MSB;
  const struct {
    const char* file;
    Options options;
    double tolerance;
  } cases[] = {
      {"a.obj", text, 1e-5}, {"a.ply", text, 1e-5}, {"b.ply", binary, 0}, {"c.ply", big, 0}, {"a.off", text, 1e-5}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.file);
    ASSERT_TRUE(OpenMesh::IO::write_mesh(reference, (folder / one.file).string(), one.options, 9));
    expectSame(readMesh(folder / one.file), wanted, one.tolerance);
  }
  for (const auto& options : {text, binary}) {
    ASSERT_TRUE(OpenMesh::IO::write_mesh(reference, (folder / "a.stl").string(), options, 9));
    const Mesh mesh = readMesh(folder / "a.stl");
    EXPECT_EQ(mesh.vertexCount(), wanted.vertexCount());
    ASSERT_EQ(mesh.corner_vertices.size(), wanted.corner_vertices.size());
    for (std::size_t c = 0; c < wanted.corner_vertices.size(); ++c)
      EXPECT_LT((mesh.positions.row(mesh.corner_vertices[c]) - wanted.positions.row(wanted.corner_vertices[c])).norm(),
                1e-5);
  }
}

// Why the readers are our own: an artist's mesh may have edges with three faces, and must come back with all of them.
TEST(MeshCompare, FacesThatAreNotManifoldStayHereAndAreLostThere) {
  const test::TemporaryDir folder;
  const Mesh fan = parseObj("v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n", "fan");
  writeObj(folder / "fan.obj", fan, fan.positions);
  EXPECT_EQ(readMesh(folder / "fan.obj").polygonCount(), 3U);
  Reference reference;
  omerr().disable();
  EXPECT_TRUE(OpenMesh::IO::read_mesh(reference, (folder / "fan.obj").string()));
  omerr().enable();
  // OpenMesh gives the lost faces vertices of their own, or loses them: either way it is another mesh.
  EXPECT_TRUE(reference.n_faces() != 3 || reference.n_vertices() != 5)
      << reference.n_faces() << " faces, " << reference.n_vertices() << " vertices";
}

TEST(MeshCompare, ReadersAgreeOnAPublicHead) {
  VOLTO_REQUIRE_DATA(data);
  const Mesh mesh = readMesh(data / "meshes/other/suzanne.obj");
  OpenMesh::PolyMesh_ArrayKernelT<DoubleTraits> reference;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(reference, (data / "meshes/other/suzanne.obj").string()));
  ASSERT_EQ(mesh.vertexCount(), reference.n_vertices());
  for (const auto v : reference.vertices())
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(mesh.positions(v.idx(), axis), reference.point(v)[static_cast<std::size_t>(axis)], 1e-6);
}

}  // namespace
}  // namespace volto::rig
