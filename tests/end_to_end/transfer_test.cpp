// volto transfer, import and animate: expressions from one character to another, into a set of its own, and played.
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "rig/rig_file.h"
#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

namespace fs = std::filesystem;

class Transfer : public World {
 protected:
  // The shipped head with its mouth lifted, and once as it is: the eyes stay, since a GLB file's eyes only turn.
  std::string examples() const {
    const rig::Mesh head = rig::readMesh(headMesh());
    fs::create_directories(path("examples"));
    rig::VertexPositions moved = head.positions;
    for (Eigen::Index v = 0; v < moved.rows(); ++v)
      moved(v, 1) += 0.1 * std::exp(-(std::pow(moved(v, 0), 2) + std::pow(moved(v, 1) + 5, 2)) / 2);
    rig::writeObj(path("examples/lift.obj"), head, moved);
    rig::writeObj(path("examples/still.obj"), head, head.positions);
    return path("examples");
  }
};

TEST_F(Transfer, OneMeshOutPerMeshInUnderTheSameName) {
  for (const std::string method : {"mask", "deformation"}) {
    const Finished run = volto({"transfer", "--source", rig(), "--examples", examples(), "--target", rig(), "-o",
                                path("out_" + method), "--method", method});
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.out.find("note: still does not move on the source"), std::string::npos) << run.out;
    const rig::Mesh head = rig::readMesh(headMesh());
    const rig::Mesh lift = rig::readMesh(path("out_" + method + "/lift.obj"));
    const rig::Mesh still = rig::readMesh(path("out_" + method + "/still.obj"));
    EXPECT_EQ(lift.corner_vertices, head.corner_vertices);
    EXPECT_GT((lift.positions - head.positions).rowwise().norm().maxCoeff(), 0.02);
    EXPECT_LT((still.positions - head.positions).rowwise().norm().maxCoeff(), 1e-5);
  }
}

TEST_F(Transfer, WhatCannotBeTransferredIsNamed) {
  const auto complaint = [&](std::vector<std::string> arguments, int status) {
    arguments.insert(arguments.begin(), "transfer");
    const Finished run = volto(arguments);
    EXPECT_EQ(run.status, status) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    return run.err;
  };
  const std::string good = examples();
  EXPECT_NE(complaint({"--source", rig(), "--examples", good, "--target", headMesh(), "-o", path("o")}, 65)
                .find("is a mesh that is not rigged; make its rig with volto rig"),
            std::string::npos);
  EXPECT_NE(complaint({"--source", rig(), "--examples", path("none"), "--target", rig(), "-o", path("o")}, 66)
                .find("no such folder or file"),
            std::string::npos);
  EXPECT_NE(complaint({"--source", rig(), "--examples", good, "--target", rig(), "-o", good}, 2).find("would be lost"),
            std::string::npos);
  EXPECT_NE(
      complaint({"--source", rig(), "--examples", good, "--target", rig(), "-o", path("o"), "--method", "magic"}, 2)
          .find("use mask or deformation"),
      std::string::npos);
  fs::create_directories(path("other"));
  writeFile(path("other/smile.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(complaint({"--source", rig(), "--examples", path("other"), "--target", rig(), "-o", path("o")}, 65)
                .find("smile.obj: 3 vertices"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(path("o")));
}

TEST_F(Transfer, MotionsOfTheMaskAreExamplesToo) {
  const Finished run = volto({"transfer", "--examples", "table", "--target", rig(), "-o", path("table")});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("52 expressions of the mask"), std::string::npos);
  // The shipped head's shapes were made of the same table.
  writeFile(path("s.script"), "to 0.1: mouthSmileLeft 1\nto 0.1: mouthSmileLeft 0, jawOpen 1\n");
  ASSERT_EQ(
      volto({"animate", path("s.script"), "--rig", rig(), "--rate", "10", "--obj", path("o"), "--take", path("s.take")})
          .status,
      0);
  const auto farthest = [&](const std::string& a, const std::string& b) {
    return (rig::readMesh(path(a)).positions - rig::readMesh(path(b)).positions).rowwise().norm().maxCoeff();
  };
  EXPECT_LT(farthest("table/mouthSmileLeft.obj", "o/frame_000001.obj"), 2e-3);  // the head is 20 wide
  EXPECT_LT(farthest("table/jawOpen.obj", "o/frame_000002.obj"), 2e-3);
  ASSERT_EQ(
      volto({"transfer", "--examples", path("s.take"), "--target", rig(), "-o", path("take"), "--every", "2"}).status,
      0);
  EXPECT_LT(farthest("take/frame_000002.obj", "o/frame_000002.obj"), 2e-2);
  EXPECT_FALSE(fs::exists(path("take/frame_000001.obj")));

  const Finished no_mesh =
      volto({"transfer", "--examples", "table", "--target", rig(), "-o", path("x"), "--method", "deformation"});
  EXPECT_EQ(no_mesh.status, 2);
  EXPECT_NE(no_mesh.err.find("use --method mask"), std::string::npos);
  const Finished no_source = volto({"transfer", "--examples", examples(), "--target", rig(), "-o", path("x")});
  EXPECT_EQ(no_source.status, 2);
  EXPECT_NE(no_source.err.find("--source S.rig is missing"), std::string::npos);
  writeFile(path("text.take"), "no take");
  EXPECT_EQ(volto({"transfer", "--examples", path("text.take"), "--target", rig(), "-o", path("x")}).status, 65);
  EXPECT_FALSE(fs::exists(path("x")));
}

TEST_F(Transfer, SetOfItsOwnComesBackFromGlbWhereItWas) {
  ASSERT_EQ(volto({"import", examples(), "--rig", rig(), "-o", path("own.rig")}).status, 0);
  ASSERT_EQ(volto({"export", path("own.rig"), "-o", path("own.glb")}).status, 0);
  const Finished again = volto({"import", path("own.glb"), "--rig", rig(), "-o", path("again.rig")});
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_NE(again.out.find("2 blendshapes"), std::string::npos);
  EXPECT_NE(again.out.find("note: still moves nothing; kept as an empty shape"), std::string::npos);
  for (const std::string name : {"own", "again"})
    ASSERT_EQ(volto({"export", path(name + ".rig"), "-o", path(name) + "/"}).status, 0);
  const rig::Mesh own = rig::readMesh(path("own/lift.obj")), back = rig::readMesh(path("again/lift.obj"));
  EXPECT_LT((own.positions - back.positions).rowwise().norm().maxCoeff(), 2e-4);
  // And it is what was imported, but for contacts.
  const rig::Mesh artist = rig::readMesh(path("examples/lift.obj"));
  EXPECT_LT((own.positions - artist.positions).rowwise().norm().mean(), 1e-3);
}

TEST_F(Transfer, FilesWithoutShapesAreRefused) {
  const rig::Rig character = rig::readRig(rig());
  writeFile(path("text.glb"), "no model");
  const Finished text = volto({"import", path("text.glb"), "--rig", rig(), "-o", path("o.rig")});
  EXPECT_EQ(text.status, 65);
  const Finished mesh = volto({"import", headMesh(), "--rig", rig(), "-o", path("o.rig")});
  EXPECT_EQ(mesh.status, 65);
  EXPECT_NE(mesh.err.find("give a folder of meshes, or a .glb"), std::string::npos);
  EXPECT_FALSE(fs::exists(path("o.rig")));
}

TEST_F(Transfer, ScriptGivesTheSameFramesInTakeAndTable) {
  writeFile(path("a.script"), "to 0.5: jawOpen 0.8, headYaw 10\nneutral 0.5 smooth\n");
  const Finished run =
      volto({"animate", path("a.script"), "--rig", rig(), "--take", path("a.take"), "--csv", path("a.csv")});
  ASSERT_EQ(run.status, 0) << run.err;
  ASSERT_EQ(volto({"bake", path("a.take"), "--rig", rig(), "--csv", path("b.csv")}).status, 0);
  std::istringstream a(readFile(path("a.csv"))), b(readFile(path("b.csv")));
  std::string row_a, row_b;
  std::size_t rows = 0;
  while (std::getline(a, row_a)) {
    ASSERT_TRUE(std::getline(b, row_b));
    if (rows++ == 0) continue;
    std::istringstream cells_a(row_a), cells_b(row_b);
    std::string x, y;
    for (int k = 0; k < 52 && std::getline(cells_a, x, ',') && std::getline(cells_b, y, ','); ++k)
      EXPECT_NEAR(std::atof(x.c_str()), std::atof(y.c_str()), 1e-3) << "row " << rows << " cell " << k;
  }
  EXPECT_EQ(rows, 62U);  // header, 61 frames

  const Finished wrong = volto({"animate", path("a.script"), "--rig", rig()});
  EXPECT_EQ(wrong.status, 2);
  writeFile(path("b.script"), "to 1: jawOpne 1\n");
  const Finished misspelt = volto({"animate", path("b.script"), "--rig", rig(), "--csv", path("c.csv")});
  EXPECT_EQ(misspelt.status, 65);
  EXPECT_NE(misspelt.err.find("did you mean jawOpen?"), std::string::npos) << misspelt.err;
  EXPECT_FALSE(fs::exists(path("c.csv")));
}

}  // namespace
}  // namespace volto::test
