// Colours of OBJ materials: from the library beside the file, and from nowhere else.
#include <fstream>
#include <sys/stat.h>

#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "rig/mtl_reader.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

constexpr const char* kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl skin\nf 1 2 3\nusemtl left eye\nf 3 2 1\n";
constexpr const char* kMtl =
    "\xEF\xBB\xBF# by hand\nnewmtl skin\r\nKa 1 1 1\nKd 0.5 0.25 0.125\r\nnewmtl left eye\n  Kd 0.5\nnewmtl other\nKd "
    "1 0 0\n";

TEST(Mtl, GivesMaterialsTheirDiffuseColour) {
  Mesh mesh = parseObj(kObj, "m");
  applyMaterialLibrary(kMtl, mesh);
  EXPECT_EQ(mesh.materials[0].colour, (std::array<float, 3>{0.5F, 0.25F, 0.125F}));
  EXPECT_EQ(mesh.materials[1].colour, (std::array<float, 3>{0.5F, 0.5F, 0.5F})) << "one number stands for all three";
}

TEST(Mtl, NonsenseChangesNothing) {
  for (const char* text :
       {"", "Kd 1 1 1\n", "newmtl skin\nKd spectral a.rfl\n", "newmtl skin\nKd nan 1 1\n", "newmtl skin\nKd 1 1\n",
        "newmtl skin\nKd 1,0 0 0\n", "newmtl\nKd 1 0 0\n", "newmtl SKIN\nKd 1 0 0\n"}) {
    Mesh mesh = parseObj(kObj, "m");
    applyMaterialLibrary(text, mesh);
    EXPECT_EQ(mesh.materials[0].colour, Mesh::Material{}.colour) << text;
  }
  Mesh mesh = parseObj(kObj, "m");
  applyMaterialLibrary(std::string("newmtl skin\nKd 7 -1 0\n\0\xFF", 25), mesh);
  EXPECT_EQ(mesh.materials[0].colour, (std::array<float, 3>{1.0F, 0.0F, 0.0F})) << "held within what a colour can be";
}

TEST(Mtl, OnlyARegularFileBesideTheMeshIsOpened) {
  const test::TemporaryDir folder;
  std::filesystem::create_directory(folder / "model");
  std::ofstream(folder / "outside.mtl") << kMtl;
  std::ofstream(folder / "model/my colours.mtl") << kMtl;
  std::filesystem::create_symlink(folder / "outside.mtl", folder / "model/link.mtl");
  ASSERT_EQ(mkfifo((folder / "model/trap.mtl").c_str(), 0600), 0);  // opening it would hang
  const auto read = [&](const std::string& library) {
    std::ofstream(folder / "model/head.obj") << "mtllib " << library << "\n" << kObj;
    return readMesh(folder / "model/head.obj");
  };
  const Mesh good = read("my colours.mtl");
  EXPECT_EQ(good.materials[0].colour[0], 0.5F);
  EXPECT_TRUE(good.notes.empty());
  std::ofstream(folder / "model/second.mtl") << "newmtl left eye\nKd 1 0 0\n";
  EXPECT_EQ(read("absent.mtl second.mtl").materials[1].colour[0], 1.0F) << "two names in one line";
  EXPECT_EQ(read("absent.mtl second.mtl").notes.size(), 1U);
  for (const std::string& bad :
       {std::string("../outside.mtl"), (folder / "outside.mtl").string(), std::string("../../etc/passwd"),
        std::string("link.mtl"), std::string("trap.mtl"), std::string("absent.mtl"), std::string("."),
        std::string(".."), std::string("C:\\colours.mtl"), std::string(2000, 'x'), std::string()}) {
    const Mesh mesh = read(bad);
    EXPECT_EQ(mesh.vertexCount(), 3U) << bad;
    EXPECT_EQ(mesh.materials[0].colour, Mesh::Material{}.colour) << bad;
    EXPECT_EQ(mesh.notes.size(), 1U) << "said, since colours will be missed: " << bad;
  }
  // A library of more than 4 MiB is no library.
  std::ofstream(folder / "model/huge.mtl") << std::string(5 << 20, '#');
  EXPECT_EQ(read("huge.mtl").notes.size(), 1U);
}

TEST(Mtl, WrittenBesideTheMeshItIsReadAgain) {
  const test::TemporaryDir folder;
  Mesh mesh = parseObj(kObj, "m");
  mesh.materials[0].colour = {0.1F, 1.0F / 3.0F, 1.0F};
  mesh.vertex_colours = {{1.0F, 0.0F, 0.5F}, {0.2F, 0.2F, 0.2F}, {0.0F, 0.0F, 0.0F}};
  writeMtl(folder / "head.mtl", mesh);
  writeObj(folder / "head.obj", mesh, mesh.positions, {.material_library = "head.mtl", .normals = true});
  const Mesh again = readMesh(folder / "head.obj");
  EXPECT_EQ(again.materials[0].colour, mesh.materials[0].colour);
  EXPECT_EQ(again.polygon_material, mesh.polygon_material);
  EXPECT_EQ(again.corner_vertices, mesh.corner_vertices);
  ASSERT_EQ(again.vertex_colours.size(), 3U);
  for (std::size_t v = 0; v < 3; ++v)
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(again.vertex_colours[v][c], mesh.vertex_colours[v][c], 1e-6);
}

TEST(SmoothNormals, PointOutwardsAndAreSharedAcrossSeams) {
  // Two triangles that meet at a right angle along an edge whose vertices are there twice.
  const Mesh mesh = parseObj("v 0 0 0\nv 0 1 0\nv 1 0 0\nv 0 0 0\nv 0 1 0\nv 0 0 -1\nf 1 3 2\nf 4 5 6\nv 7 7 7\n", "m");
  const VertexPositions normals = smoothNormals(mesh, mesh.positions);
  EXPECT_TRUE(normals.row(2).isApprox(Eigen::RowVector3d(0, 0, 1)));
  EXPECT_TRUE(normals.row(5).isApprox(Eigen::RowVector3d(-1, 0, 0)));
  for (const Eigen::Index v : {0, 3})
    EXPECT_TRUE(normals.row(v).isApprox(v == 0 ? Eigen::RowVector3d(0, 0, 1) : Eigen::RowVector3d(-1, 0, 0)))
        << "sides at a right angle or more stay apart";
  EXPECT_TRUE(normals.row(6).isApprox(Eigen::RowVector3d(0, 0, 1))) << "in no polygon";
  const Mesh flat = parseObj("v 0 0 0\nv 0 1 0\nv 1 0 0\nv 0 0 0\nv 0 1 0\nv -1 0 -0.5\nf 1 3 2\nf 4 5 6\n", "m");
  const VertexPositions smooth = smoothNormals(flat, flat.positions);
  EXPECT_TRUE(smooth.row(0).isApprox(smooth.row(3)));
  EXPECT_LT(smooth(0, 0), 0.0) << "bent towards the other side";
}

}  // namespace
}  // namespace volto::rig
