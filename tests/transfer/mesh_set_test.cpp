#include "transfer/mesh_set.h"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "rig/errors.h"
#include "rig/mesh_io.h"
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

}  // namespace
}  // namespace volto::transfer
