// OBJ in and out: every way a file can be wrong gives one line that says where.
#include <fstream>
#include <sys/stat.h>

#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

constexpr const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

// What the reader says about a text; empty when it accepts it.
std::string complaint(const std::string& text) {
  try {
    parseObj(text, "head.obj");
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "one line";
    EXPECT_LT(std::string(e.what()).size(), 200U);
    return e.what();
  }
  return {};
}

std::string refused(const std::string& text) {
  const std::string said = complaint(text);
  EXPECT_TRUE(said.starts_with("head.obj:")) << said;
  return said;
}

TEST(Obj, KeepsVertexAndPolygonOrder) {
  const Mesh mesh = parseObj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 2 -1e-1\nf 5 4 3\nf 1 2 3 4\n", "m");
  ASSERT_EQ(mesh.vertexCount(), 5U);
  EXPECT_EQ(mesh.positions.row(4), Eigen::RowVector3d(0.5, 2, -0.1));
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{4, 3, 2, 0, 1, 2, 3}));
  EXPECT_EQ(mesh.polygon_start, (std::vector<std::uint32_t>{0, 3, 7}));
  EXPECT_TRUE(mesh.corner_texcoords.empty());
  EXPECT_TRUE(mesh.materials.empty());
}

TEST(Obj, NumbersAreRoundedCorrectly) {
  // The fast way and std::strtod must agree to the last bit.
  for (const char* number : {"0.1", "-7.123456", "123456789.123456789", "9007199254740993", "1e22", "1e23", "4.9e-324",
                             "0.30000000000000004", "-0", "+2.5", "5.", ".25", "1E+2",
                             "3.14159265358979323846264338327950288419716939937510582097"}) {
    const Mesh mesh = parseObj("v " + std::string(number) + " 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "m");
    EXPECT_EQ(mesh.positions(0, 0), std::strtod(number, nullptr)) << number;
  }
}

TEST(Obj, MaterialsAndTextureCoordinatesStayWithTheirPolygons) {
  const Mesh mesh = parseObj(std::string(kTriangle) +
                                 "vt 0.25 0.5\nvt 1 0 0\nf 1/1 2/2 3/1\nusemtl left eye \nvn 0 0 1\nf 3/2 2//1 "
                                 "1\nusemtl skin\nvn 0 0 1\nf 1 2 3\n",
                             "m");
  ASSERT_EQ(mesh.corner_texcoords.size(), 9U);
  EXPECT_EQ(mesh.corner_texcoords[1], (std::array<float, 2>{1, 0}));
  EXPECT_EQ(mesh.corner_texcoords[3], (std::array<float, 2>{1, 0}));
  EXPECT_EQ(mesh.corner_texcoords[4], (std::array<float, 2>{0, 0})) << "a corner without one gets the origin";
  ASSERT_EQ(mesh.polygon_material.size(), 3U);
  EXPECT_EQ(mesh.materials[mesh.polygon_material[0]].name, "none");
  EXPECT_EQ(mesh.materials[mesh.polygon_material[1]].name, "left eye");
  EXPECT_EQ(mesh.materials[mesh.polygon_material[2]].name, "skin");
}

// The cases of the reliability notes, in their order.
TEST(Obj, IndexZeroIsRefused) {
  EXPECT_NE(refused(std::string(kTriangle) + "f 0 1 2\n").find(":4: "), std::string::npos);
}

TEST(Obj, IndexBeyondTheVerticesIsRefusedWithItsLine) {
  EXPECT_EQ(refused(std::string(kTriangle) + "f 1 2 3\nf 1 2 9\n"), "head.obj:5: face names vertex 9, the file has 3");
  EXPECT_NE(refused(std::string(kTriangle) + "f 1 2 99999999999\n"), "");
  EXPECT_NE(refused(std::string(kTriangle) + "f 1/7 2/1 3/1\n"), "");
  EXPECT_NE(refused(std::string(kTriangle) + "f 1//7 2//1 3//1\n"), "");
  EXPECT_EQ(complaint("f 1 2 3\n" + std::string(kTriangle)), "") << "vertices may follow their faces";
}

TEST(Obj, NegativeIndexCountsBackAndNotPastTheStart) {
  EXPECT_EQ(parseObj(std::string(kTriangle) + "f -3 -2 -1\n", "m").corner_vertices,
            (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_NE(refused(std::string(kTriangle) + "f -4 -2 -1\n").find(":4: "), std::string::npos);
  EXPECT_NE(refused(std::string(kTriangle) + "f -9223372036854775808 -2 -1\n"), "");
}

TEST(Obj, PositionThatIsNotFiniteIsRefused) {
  for (const char* bad :
       {"nan", "inf", "-inf", "1e999", "NaN", "-1e400", "0x10", "1e", "1.2.3", "--1", "+-1", "-", "."})
    EXPECT_NE(refused("v 0 " + std::string(bad) + " 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").find("head.obj:1: "),
              std::string::npos)
        << bad;
  EXPECT_EQ(parseObj("v 1e-999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "m").positions(0, 0), 0.0);
}

TEST(Obj, DecimalCommaAndMissingCoordinateAreRefused) {
  EXPECT_NE(refused("v 1,5 2,0 3,1\n").find("'1,5'"), std::string::npos);
  EXPECT_NE(refused("v 1 2\nv 1 2 3\n").find("head.obj:1: "), std::string::npos);
  EXPECT_NE(refused("v 1 2 3 4 5 6 7 8\n"), "");
  EXPECT_EQ(complaint("v 0 0 0 .5 .5 .5\nv 1 0 0 1\nv 0 1 0\nf 1 2 3\n"), "") << "weights and colours are allowed";
}

TEST(Obj, ColoursOfVerticesAreReadInEitherScale) {
  for (const char* red : {"1 0 0.5", "255 0 127.5"}) {
    const Mesh mesh = parseObj("v 0 0 0 " + std::string(red) + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "m");
    ASSERT_EQ(mesh.vertex_colours.size(), 3U);
    EXPECT_FLOAT_EQ(mesh.vertex_colours[0][0], 1.0F);
    EXPECT_NEAR(mesh.vertex_colours[0][2], 0.214F, 1e-3) << "half on a screen is a fifth of the light";
  }
  EXPECT_TRUE(parseObj("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n", "m").vertex_colours.empty()) << "a weight";
}

TEST(Obj, LineEndsAndMarksOfOtherSystemsAreFine) {
  EXPECT_EQ(complaint("\xEF\xBB\xBFv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\n\r\n# end\r\nf 1 2 \\\r\n 3"), "");
  EXPECT_NE(refused(std::string(kTriangle) + std::string("f 1 2 3\n\0\0", 10)), "");
  EXPECT_NE(refused(std::string(kTriangle) + "f 1 2 3\n# " + std::string(1, '\0') + "\n"), "");
  EXPECT_NE(refused("v " + std::string(10'000'000, ' ') + "1 2 3\n"), "");
  EXPECT_NE(refused("#" + std::string(10'000'000, 'x')), "");
  EXPECT_NE(refused("\x7F"
                    "ELF\x02\x01\x01"),
            "");
}

TEST(Obj, FaceWithTooFewOrTooManyCornersIsRefused) {
  EXPECT_NE(refused(std::string(kTriangle) + "f 1 2\n"), "");
  EXPECT_NE(refused(std::string(kTriangle) + "f\n"), "");
  std::string huge = std::string(kTriangle) + "f";
  for (int i = 0; i < 100'000; ++i) huge += " 1";
  EXPECT_NE(refused(huge + "\n").find("corners"), std::string::npos);
}

TEST(Obj, MixedCornersAreReadAndStraySlashesRefused) {
  EXPECT_EQ(complaint(std::string(kTriangle) + "vt 0 0\nvn 0 0 1\nf 1//1 2/1/1 3/1\n"), "");
  for (const char* bad : {"f 1/ /2 3", "f 1/1/1/1 2 3", "f 1// 2 3", "f / 2 3", "f 1a 2 3", "f 1.5 2 3", "f 1/x 2 3"})
    EXPECT_NE(refused(std::string(kTriangle) + "vt 0 0\nvn 0 0 1\n" + bad + "\n"), "") << bad;
}

TEST(Obj, MaterialLibraryElsewhereIsNeverOpened) {
  const test::TemporaryDir folder;
  ASSERT_EQ(mkfifo((folder / "trap.mtl").c_str(), 0600), 0);  // opening it would hang
  std::ofstream(folder / "head.obj") << "mtllib trap.mtl\nmtllib ../../etc/passwd\n"
                                     << kTriangle << "usemtl skin\nf 1 2 3\n";
  const Mesh mesh = readMesh(folder / "head.obj");
  EXPECT_EQ(mesh.vertexCount(), 3U);
  EXPECT_EQ(mesh.notes.size(), 2U);
}

TEST(Obj, NumberOfManyDigitsIsReadOrRefused) {
  EXPECT_EQ(parseObj("v 123456789012345678901234567890123 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "m").positions(0, 0),
            123456789012345678901234567890123.0);
  EXPECT_NE(refused("v " + std::string(70'000, '9') + " 0 0\n"), "");
  EXPECT_NE(refused(std::string(kTriangle) + "f 1 2 " + std::string(33, '9') + "\n"), "");
}

TEST(Obj, UnusedDuplicateAndDegenerateElementsAreRead) {
  const Mesh mesh = parseObj(std::string(kTriangle) + "v 5 5 5\nf 1 2 3\nf 1 2 3\nf 1 1 1\n", "m");
  EXPECT_EQ(mesh.polygonCount(), 3U);
  const MeshHealth health = inspectMesh(mesh);
  EXPECT_EQ(health.unused_vertices, 1U);
  EXPECT_EQ(health.degenerate_polygons, 1U);
  EXPECT_EQ(health.duplicate_polygons, 1U);
}

TEST(Obj, AnotherTopologyIsRefusedNamingBothCounts) {
  const Mesh three = parseObj(std::string(kTriangle) + "f 1 2 3\n", "m");
  const Mesh four = parseObj(std::string(kTriangle) + "v 1 1 1\nf 1 2 3\n", "m");
  const Mesh turned = parseObj(std::string(kTriangle) + "f 2 3 1\n", "m");
  EXPECT_NO_THROW(requireSameTopology(three, three, "smile.obj"));
  for (const Mesh* other : {&four, &turned}) EXPECT_THROW(requireSameTopology(three, *other, "smile.obj"), InputError);
  try {
    requireSameTopology(three, four, "smile.obj");
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(),
                 "smile.obj: 4 vertices and 1 polygons, the neutral mesh has 3 and 1; an expression must be the same "
                 "mesh, moved");
  }
}

TEST(Obj, NothingToRigIsRefused) {
  EXPECT_NE(refused(""), "");
  EXPECT_NE(refused("# a comment\n"), "");
  EXPECT_NE(refused(kTriangle).find("without faces"), std::string::npos);
  EXPECT_NE(refused("solid teapot\nfacet normal 0 0 1\n"), "");
}

TEST(Obj, WrittenAndReadAgainItIsTheSameMesh) {
  Mesh mesh = parseObj(
      "v 0.1 -2.5e-7 3\nv 1 0 0\nv 1 1 0\nv 0 1 1e10\nvt .5 .25\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/1 4/2\nusemtl eye\nf "
      "4/1 3/1 2/2\n",
      "m");
  mesh.positions(1, 1) = 1.0 / 3.0;
  const Mesh again = parseObj(formatObj(mesh, mesh.positions), "m");
  EXPECT_EQ(again.positions, mesh.positions);
  EXPECT_EQ(again.corner_vertices, mesh.corner_vertices);
  EXPECT_EQ(again.polygon_start, mesh.polygon_start);
  EXPECT_EQ(again.corner_texcoords, mesh.corner_texcoords);
  EXPECT_EQ(again.polygon_material, mesh.polygon_material);
}

TEST(Obj, IsWrittenWholeOrNotAtAll) {
  const test::TemporaryDir folder;
  const Mesh mesh = parseObj(std::string(kTriangle) + "f 1 2 3\n", "m");
  EXPECT_THROW(writeObj(folder / "no_such_folder/a.obj", mesh, mesh.positions), std::system_error);
  VertexPositions broken = mesh.positions;
  broken(0, 0) = std::nan("");
  EXPECT_THROW(writeObj(folder / "a.obj", mesh, broken), std::invalid_argument);
  EXPECT_THROW(writeObj(folder / "a.obj", mesh, broken.topRows(2)), std::invalid_argument);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  writeObj(folder / "a.obj", mesh, 2 * mesh.positions);
  writeObj(folder / "a.obj", mesh, 3 * mesh.positions);
  EXPECT_EQ(readMesh(folder / "a.obj").positions, 3 * mesh.positions);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "no temporary file is left";
}

TEST(Obj, OnlyRegularFilesOfAKnownKindAreRead) {
  const test::TemporaryDir folder;
  EXPECT_THROW(readMesh(folder / "absent.obj"), std::system_error);
  std::filesystem::create_directory(folder / "folder.obj");
  EXPECT_THROW(readMesh(folder / "folder.obj"), InputError);
  ASSERT_EQ(mkfifo((folder / "pipe.obj").c_str(), 0600), 0);
  EXPECT_THROW(readMesh(folder / "pipe.obj"), InputError);
  EXPECT_THROW(readMesh("/dev/zero"), InputError);
  std::ofstream(folder / "head.fbx") << "Kaydara";
  EXPECT_THROW(readMesh(folder / "head.fbx"), InputError);
}

TEST(Obj, ComponentsAreNumberedByFirstVertex) {
  const Mesh mesh = parseObj("v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv 1 0 1\nv 0 1 1\nv 7 7 7\nf 1 3 4\nf 2 5 6\n", "m");
  EXPECT_EQ(connectedComponents(mesh), (std::vector<std::uint32_t>{0, 1, 0, 0, 1, 1, 2}));
}

TEST(Obj, PolygonsAreCutIntoFans) {
  const Mesh mesh = parseObj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 3 4\n", "m");
  EXPECT_EQ(triangulate(mesh), (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 2, 3}}));
}

TEST(Obj, PublicHeadIsReadAsPublished) {
  VOLTO_REQUIRE_DATA(data);
  const Mesh mesh = readMesh(data / "meshes/ict/neutral.obj");
  EXPECT_EQ(mesh.vertexCount(), 26'719U);
  EXPECT_EQ(mesh.polygonCount(), 26'384U);
  EXPECT_EQ(triangulate(mesh).size(), 2U * 25'836U + 548U);
  EXPECT_EQ(mesh.positions.row(0), Eigen::RowVector3d(0.0, -2.482510, 11.838700));
}

}  // namespace
}  // namespace volto::rig
