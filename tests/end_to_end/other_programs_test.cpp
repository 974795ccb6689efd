// What other programs make of Volto's files. Those that are not installed are passed over with a line.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "tests/end_to_end/world.h"
#include "tests/support/test_data.h"

namespace volto::test {
namespace {

// Where it is installed, or nothing.
std::string installed(const std::string& program) {
  std::istringstream folders(std::getenv("PATH") != nullptr ? std::getenv("PATH") : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const auto file = std::filesystem::path(folder) / program; std::filesystem::exists(file)) return file.string();
  return {};
}

class OtherPrograms : public World {
 protected:
  std::string helper(const std::string& name) const { return (sourceDir() / "tests/end_to_end" / name).string(); }
  // A smile, a turn of the head and a blink.
  std::string animatedGlb() const {
    writeFile(path("s.script"), "to 0.2: mouthSmileLeft 0.8, headYaw 10\nto 0.2 smooth: eyeBlinkLeft 1, jawOpen 0.4\n");
    const Finished run = volto({"animate", path("s.script"), "--rig", rig(), "--glb", path("s.glb"), "--rate", "30"});
    EXPECT_EQ(run.status, 0) << run.err;
    return path("s.glb");
  }
};

TEST_F(OtherPrograms, KhronosValidatorFindsNoErrors) {
  const std::string node = installed("node");
  if (node.empty()) GTEST_SKIP() << "node is not installed";
  if (Process({node, "-e", "require('gltf-validator')"}).wait().status != 0)
    GTEST_SKIP() << "npm's gltf-validator is not installed (NODE_PATH says where to look)";
  ASSERT_EQ(volto({"import", "vrm1", "--rig", rig(), "-o", path("vrm.rig")}).status, 0);
  ASSERT_EQ(volto({"export", path("vrm.rig"), "-o", path("vrm.glb")}).status, 0);
  Process validator({node, helper("gltf_validates.js"), animatedGlb(), path("vrm.glb")});
  const Finished run = validator.wait();
  EXPECT_EQ(run.status, 0) << run.out << run.err;
  EXPECT_EQ(run.out, "errors 0 warnings 0\nerrors 0 warnings 0\n");
}

TEST_F(OtherPrograms, BlenderFindsTheShapeKeysAndTheAnimationAndItsOwnFileIsReadBack) {
  const std::string program = installed("blender");
  if (program.empty()) GTEST_SKIP() << "blender is not installed";
  const std::string glb = animatedGlb();
  Process blender({program, "-b", "--factory-startup", "--python-exit-code", "9", "--python",
                   helper("blender_reads.py"), "--", glb, path("blender.glb")});
  const Finished run = blender.wait(std::chrono::seconds(100));
  ASSERT_EQ(run.status, 0) << run.out << run.err;
  ASSERT_NE(run.out.find("\ndone\n"), std::string::npos) << run.out << run.err;
  EXPECT_NE(run.out.find("\nkeys 52\n"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("\nnames eyeBlinkLeft,"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("\ncurves 52\n"), std::string::npos) << run.out;

  // What Blender wrote is the same set again, vertex by vertex of the artist's mesh.
  ASSERT_EQ(volto({"import", path("blender.glb"), "--rig", rig(), "-o", path("back.rig")}).status, 0);
  ASSERT_EQ(volto({"import", glb, "--rig", rig(), "-o", path("direct.rig")}).status, 0);
  const auto shown = [&](const std::string& name, const std::string& character) {
    EXPECT_EQ(volto({"animate", path("s.script"), "--rig", character, "--rate", "5", "--obj", path(name)}).status, 0);
    return rig::readMesh(path(name + "/frame_000001.obj")).positions;
  };
  const rig::VertexPositions back = shown("back", path("back.rig")), direct = shown("direct", path("direct.rig"));
  EXPECT_LT((back - direct).rowwise().norm().maxCoeff(), 1e-5);  // the head is 20 wide
}

TEST_F(OtherPrograms, AScriptIsTheSameFramesInTheTakeAndInTheGlb) {
  writeFile(path("s.script"),
            "repeat 4\n  to 0.4 smooth: jawOpen 0.7, mouthSmileRight 0.5\n  hold 0.1\n  neutral 0.5\nend\n");
  ASSERT_EQ(
      volto({"animate", path("s.script"), "--rig", rig(), "--take", path("s.take"), "--glb", path("s.glb")}).status, 0);
  ASSERT_EQ(volto({"bake", path("s.take"), "--rig", rig(), "--glb", path("take.glb")}).status, 0);
  ASSERT_EQ(volto({"bake", path("s.take"), "--rig", rig(), "--csv", path("take.csv")}).status, 0);
  EXPECT_EQ(std::filesystem::file_size(path("s.glb")), std::filesystem::file_size(path("take.glb")));
  const std::string a = readFile(path("s.glb")), b = readFile(path("take.glb"));
  // The weights of the animation: compared as numbers, where the two files differ at all.
  std::size_t different = 0;
  float worst = 0;
  for (std::size_t i = 0; i + 4 <= a.size() && i + 4 <= b.size(); i += 4) {
    float x = 0, y = 0;
    std::memcpy(&x, a.data() + i, 4);
    std::memcpy(&y, b.data() + i, 4);
    if (std::memcmp(&x, &y, 4) == 0) continue;
    ++different;
    worst = std::max(worst, std::abs(x - y));
  }
  RecordProperty("numbers_that_differ", std::to_string(different));
  EXPECT_LT(worst, 1e-3F) << different << " numbers differ";
}

TEST_F(OtherPrograms, ALiveLinkFaceRecordingComesOutAsItWentIn) {
  VOLTO_REQUIRE_DATA(data);
  const std::filesystem::path recording = data / "takes/livelink/talking_iPhone.csv";
  ASSERT_EQ(volto({"bake", recording.string(), "--rig", rig(), "--livelink", path("out.csv")}).status, 0);
  std::istringstream theirs(readFile(recording)), ours(readFile(path("out.csv")));
  const auto cells = [](std::istream& in) {
    std::vector<std::string> out;
    std::string line;
    std::getline(in, line);
    if (line.ends_with('\r')) line.pop_back();
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) out.push_back(cell);
    return out;
  };
  const auto frames = [](const std::string& timecode) {  // 60 a second
    int h = 0, m = 0, s = 0;
    double f = 0;
    EXPECT_EQ(std::sscanf(timecode.c_str(), "%d:%d:%d:%lf", &h, &m, &s, &f), 4) << timecode;
    return ((h * 60 + m) * 60 + s) * 60 + f;
  };
  std::vector<std::string> a = cells(theirs), b = cells(ours);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 2; i < a.size(); ++i) EXPECT_EQ(a[i], b[i]);
  double start_a = -1, start_b = -1, worst_time = 0, worst_weight = 0;
  std::size_t rows = 0;
  for (; !(a = cells(theirs)).empty(); ++rows) {
    b = cells(ours);
    ASSERT_EQ(b.size(), 63U);
    if (rows == 0) start_a = frames(a[0]), start_b = frames(b[0]);
    worst_time = std::max(worst_time, std::abs(frames(a[0]) - start_a - (frames(b[0]) - start_b)));
    for (std::size_t i = 2; i < 54; ++i)
      worst_weight = std::max(worst_weight, std::abs(std::stod(a[i]) - std::stod(b[i])));
  }
  EXPECT_GT(rows, 3000U);
  EXPECT_TRUE(cells(ours).empty());
  EXPECT_LT(worst_time, 0.0015);  // of a frame: the format has thousandths
  EXPECT_LT(worst_weight, 1e-6);
}

}  // namespace
}  // namespace volto::test
