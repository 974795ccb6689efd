#include "transfer/mesh_set.h"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "rig/errors.h"
#include "rig/mesh_io.h"
#include "rig/obj_series.h"
#include "tests/transfer/sheet.h"

namespace volto::transfer {
namespace {

struct ExampleFolder : ::testing::Test {
  std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) /
      (std::string("examples_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
  Sheet sheet = makeSheet(6, 4, 0.4);

  void SetUp() override {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  void put(const std::string& name, const rig::Mesh& mesh, const rig::VertexPositions& positions) const {
    rig::writeObj(folder / name, mesh, positions);
  }
  std::string refusal() const {
    try {
      readMeshSet(folder, sheet.mesh);
    } catch (const rig::InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(ExampleFolder, MeshesAreReadInOrderOfNames) {
  put("smile.obj", sheet.mesh, curled(sheet, 0.5));
  put("blink.obj", sheet.mesh, closed(sheet, 1.0));
  std::ofstream(folder / "notes.txt") << "not a mesh\n";
  const MeshSet set = readMeshSet(folder, sheet.mesh);
  EXPECT_EQ(set.names, (std::vector<std::string>{"blink", "smile"}));
  EXPECT_LT((set.positions[1] - curled(sheet, 0.5)).norm(), 1e-6);
}

TEST_F(ExampleFolder, MeshOfAnotherVertexCountIsNamedWithBothCounts) {
  put("smile.obj", sheet.mesh, curled(sheet, 0.5));
  const Sheet other = makeSheet(8, 4, 0.4);
  put("frown.obj", other.mesh, other.mesh.positions);
  EXPECT_NE(refusal().find("frown.obj"), std::string::npos) << refusal();
  EXPECT_NE(refusal().find(std::to_string(other.mesh.vertexCount())), std::string::npos) << refusal();
  EXPECT_NE(refusal().find(std::to_string(sheet.mesh.vertexCount())), std::string::npos) << refusal();
}

TEST_F(ExampleFolder, MeshWithVerticesInAnotherOrderIsRefused) {
  rig::Mesh shuffled = sheet.mesh;
  std::swap(shuffled.corner_vertices[0], shuffled.corner_vertices[1]);
  put("smile.obj", shuffled, shuffled.positions);
  EXPECT_NE(refusal().find("joined in another way"), std::string::npos) << refusal();
}

TEST_F(ExampleFolder, FolderWithoutMeshesIsRefused) { EXPECT_NE(refusal().find("no meshes"), std::string::npos); }

TEST_F(ExampleFolder, ExampleThatIsTheNeutralIsReportedAsStill) {
  put("nothing.obj", sheet.mesh, sheet.mesh.positions);
  put("smile.obj", sheet.mesh, curled(sheet, 0.5));
  EXPECT_EQ(stillMeshes(readMeshSet(folder, sheet.mesh), sheet.mesh), std::vector<std::string>{"nothing"});
}

// --- OBJ files that differ in their vertices alone (rig/obj_series.h)

struct Series : ExampleFolder {
  rig::ObjSeries series{sheet.mesh};

  // A file of the sheet's polygons after `vertices`.
  std::filesystem::path file(const std::string& name, const std::string& vertices) const {
    std::ofstream out(folder / name, std::ios::binary);
    out << vertices;
    for (std::size_t p = 0; p < sheet.mesh.polygonCount(); ++p) {
      out << 'f';
      for (std::uint32_t c = sheet.mesh.polygon_start[p]; c < sheet.mesh.polygon_start[p + 1]; ++c)
        out << ' ' << sheet.mesh.corner_vertices[c] + 1;
      out << '\n';
    }
    return folder / name;
  }
  // Every vertex on a line of its own, written so.
  std::string vertices(const std::string& line) const {
    std::string out;
    for (std::size_t v = 0; v < sheet.mesh.vertexCount(); ++v) out += line + '\n';
    return out;
  }
};

TEST_F(Series, SecondFileIsReadTheShortWayToTheSameBits) {
  for (const char* name : {"a.obj", "b.obj", "c.obj"}) put(name, sheet.mesh, curled(sheet, 0.3 + 0.1 * name[0]));
  for (const char* name : {"a.obj", "b.obj", "c.obj"})
    EXPECT_EQ(series.read(folder / name), rig::readMesh(folder / name).positions) << name;
  EXPECT_EQ(series.shortReads(), 2U);
}

TEST_F(Series, NumbersAreTheSameHoweverTheyAreWritten) {
  series.read(file("first.obj", vertices("v 0 0 0")));
  std::size_t short_reads = 0;
  // Short: as programs write coordinates. Others go the long way.
  for (const auto& [line, is_short] : std::initializer_list<std::pair<std::string, bool>>{
           {"v 1.5 -0.000000 12", true},
           {"v 0.1 -0.30000000000000004 123456.789012345", true},
           {"v 5. .5 -.5", true},
           {"v 0.000000000000001 999999999999999 1234567890.12345", true},
           {"v 1e-3 2 3", false},
           {"v  1 2 3", false},
           {"v +1 2 3", false},
           {"v 1 2 3 0.5 0.5 0.5", false},
           {"v 1 2 3\r", false},
           {"v 1 2 3 # nothing", false}}) {
    const auto path = file("next.obj", vertices(line));
    EXPECT_EQ(series.read(path), rig::readMesh(path).positions) << line;
    short_reads += is_short ? 1 : 0;
    EXPECT_EQ(series.shortReads(), short_reads) << line;
  }
}

TEST_F(Series, WhatIsOddIsRefusedAsByTheReaderItself) {
  const std::string good = vertices("v 0 0 0");
  series.read(file("first.obj", good));
  for (const std::string& odd :
       {good + "v 0 0 0\n", good.substr(8), vertices("v 0 0"), vertices("v 0 x 0"), vertices("v 0 0 nan"), "f 1 2 9999\n" + good}) {
    const auto path = file("odd.obj", odd);
    std::string expected;
    try {
      rig::requireSameTopology(sheet.mesh, rig::readMesh(path), path.string());
    } catch (const rig::InputError& error) {
      expected = error.what();
    }
    ASSERT_FALSE(expected.empty()) << odd.substr(0, 20);
    try {
      series.read(path);
      ADD_FAILURE() << "was read: " << odd.substr(0, 20);
    } catch (const rig::InputError& error) {
      EXPECT_EQ(error.what(), expected);
    }
  }
  EXPECT_EQ(series.shortReads(), 0U);
}

TEST_F(Series, CommentsBeforeTheVerticesMayDiffer) {
  series.read(file("smile.obj", "# smile\n\n" + vertices("v 0 0 0")));
  EXPECT_EQ(series.read(file("blink.obj", "# a blink\n" + vertices("v 1 2 3")))(0, 1), 2);
  EXPECT_EQ(series.shortReads(), 1U);
  // What could be read in two ways is left to the reader itself.
  EXPECT_EQ(series.read(file("long.obj", "# a \\\n" + vertices("v 1 2 3")))(0, 1), 2);
  EXPECT_EQ(series.shortReads(), 1U);
}

}  // namespace
}  // namespace volto::transfer
