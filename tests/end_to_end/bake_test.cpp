// volto rig and volto bake: files that are the same, byte for byte, run after run.
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

namespace fs = std::filesystem;

class Bake : public World {
 protected:
  static void expectSameFolders(const fs::path& a, const fs::path& b, std::size_t count) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(a)) names.insert(entry.path().filename().string());
    EXPECT_EQ(names.size(), count);
    for (const std::string& name : names) EXPECT_EQ(readFile(a / name), readFile(b / name)) << name;
    EXPECT_EQ(static_cast<std::size_t>(std::distance(fs::directory_iterator(b), fs::directory_iterator())), count);
  }
};

TEST_F(Bake, RiggingTwiceGivesIdenticalBytes) {
  const Finished run = volto({"rig", headMesh(), "--points", headPoints(), "-o", output("again.rig")});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(readFile(output("again.rig")), readFile(rig()));
}

TEST_F(Bake, BakingTwiceGivesIdenticalBytes) {
  const std::string input = performance(30);
  for (const std::string round : {"a", "b"}) {
    const Finished run = volto({"bake", input, "--rig", rig(), "--obj", path("obj_" + round), "--csv",
                                path(round + ".csv"), "--png", path("png_" + round), "--glb", path(round + ".glb"),
                                "--livelink", path(round + "_phone.csv"), "--every", "10"});
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(run.out + run.err, "");
  }
  EXPECT_EQ(readFile(path("a.glb")), readFile(path("b.glb")));
  EXPECT_EQ(readFile(path("a_phone.csv")), readFile(path("b_phone.csv")));
  EXPECT_EQ(readFile(path("a.csv")), readFile(path("b.csv")));
  expectSameFolders(path("obj_a"), path("obj_b"), 4);  // three frames and their materials
  expectSameFolders(path("png_a"), path("png_b"), 3);
}

TEST_F(Bake, MeshKeepsTheArtistsVerticesAndFaces) {
  ASSERT_EQ(volto({"bake", performance(4), "--rig", rig(), "--obj", path("obj")}).status, 0);
  const auto count = [](const std::string& text, const std::string& keyword) {
    std::size_t found = text.rfind(keyword, 0) == 0 ? 1 : 0;
    for (std::size_t at = text.find("\n" + keyword); at != std::string::npos; at = text.find("\n" + keyword, at + 1))
      ++found;
    return found;
  };
  const std::string artist = readFile(headMesh()), baked = readFile(path("obj/frame_000003.obj"));
  EXPECT_GT(count(artist, "v "), 1000U);
  EXPECT_EQ(count(baked, "v "), count(artist, "v "));
  EXPECT_EQ(count(baked, "f "), count(artist, "f "));
}

// What other programs open: the number of an accessor, a name or a node in the JSON of a GLB file.
std::size_t countOf(const std::string& text, const std::string& wanted) {
  std::size_t found = 0;
  for (std::size_t at = text.find(wanted); at != std::string::npos; at = text.find(wanted, at + wanted.size())) ++found;
  return found;
}

TEST_F(Bake, GlbHoldsTheShapesTheEyesAndThePerformance) {
  const Finished run = volto({"export", rig(), "-o", path("head.glb"), "--take", performance(12)});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.out + run.err, "");
  const std::string bytes = readFile(path("head.glb"));
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  for (const char* name :
       {"\"jawOpen\"", "\"tongueOut\"", "\"leftEye\"", "\"rightEye\"", "\"_VOLTO_VERTEX\"", "\"iris\"", "\"weights\""})
    EXPECT_GT(countOf(bytes, name), 0U) << name;
  EXPECT_EQ(volto({"bake", path("performance.csv"), "--rig", rig(), "--glb", path("same.glb")}).status, 0);
  EXPECT_EQ(readFile(path("same.glb")), bytes) << "export --take and bake --glb make the same file";
  const Finished inspected = volto({"inspect", path("head.glb")});
  EXPECT_EQ(inspected.status, 0) << inspected.err;
  EXPECT_NE(inspected.out.find("kind: mesh"), std::string::npos);
}

TEST_F(Bake, ExportedShapesAreOneFileEach) {
  const Finished run = volto({"export", rig(), "-o", path("shapes/")});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(std::distance(fs::directory_iterator(path("shapes")), {}), 54) << "neutral, 52 shapes, materials";
  EXPECT_EQ(readFile(path("shapes/jawOpen.obj")).rfind("mtllib materials.mtl\n", 0), 0U);
}

TEST_F(Bake, ExportSaysWhatItCannotDo) {
  expectRefused(volto({"export", rig(), "-o", output("head.fbx")}), 2, "export", ".glb");
  expectRefused(volto({"export", rig(), "-o", output("shapes") + "/", "--take", performance(2)}), 2, "export",
                "--take");
  expectRefused(volto({"export", path("absent.rig"), "-o", output("head.glb")}), 66, "export", "absent.rig");
  expectRefused(volto({"export", performance(2), "-o", output("head.glb")}), 65, "export", "performance.csv");
}

TEST_F(Bake, LiveLinkFileIsAPerformanceAgain) {
  ASSERT_EQ(
      volto({"bake", performance(30), "--rig", rig(), "--livelink", path("phone.csv"), "--csv", path("a.csv")}).status,
      0);
  const std::string text = readFile(path("phone.csv"));
  EXPECT_EQ(text.rfind("Timecode,BlendShapeCount,EyeBlinkLeft,", 0), 0U);
  const Finished inspected = volto({"inspect", path("phone.csv"), "--json"});
  ASSERT_EQ(inspected.status, 0) << inspected.err;
  EXPECT_NE(inspected.out.find("\"frames\": 30"), std::string::npos) << inspected.out;
}

TEST_F(Bake, ContactSheetIsOnePicture) {
  const Finished run =
      volto({"bake", performance(60), "--rig", rig(), "--png", path("sheet.png"), "--view", "three-quarter"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(readFile(path("sheet.png")).substr(1, 3), "PNG");
}

TEST_F(Bake, AnimationHoldsTheFramesOfTheStretchAskedFor) {
  const std::string input = performance(60);  // at 60 a second
  const Finished run = volto({"bake", input, "--rig", rig(), "--png", path("moves.png"), "--animate", "--size", "48",
                              "--every", "2", "--from", "0.2", "--to", "0.5"});
  ASSERT_EQ(run.status, 0) << run.err;
  const std::string bytes = readFile(path("moves.png"));
  const std::size_t control = bytes.find("acTL");
  ASSERT_NE(control, std::string::npos);
  // acTL: number of frames, big-endian. Frames 12, 14 .. 30 lie in the stretch.
  EXPECT_EQ(bytes.substr(control + 4, 4), std::string("\0\0\0\x0A", 4));
}

TEST_F(Bake, StretchWithoutAFrameIsWrongUsage) {
  const Finished run = volto({"bake", performance(10), "--rig", rig(), "--csv", path("w.csv"), "--from", "7"});
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_FALSE(std::filesystem::exists(path("w.csv")));
}

TEST_F(Bake, AnimationWithoutAPictureIsWrongUsage) {
  EXPECT_EQ(volto({"bake", performance(10), "--rig", rig(), "--csv", path("w.csv"), "--animate"}).status, 2);
}

TEST_F(Bake, EveryNthRowIsTheRowOfTheWholeBake) {
  const std::string input = performance(21);
  ASSERT_EQ(volto({"bake", input, "--rig", rig(), "--csv", path("all.csv")}).status, 0);
  const Finished some = volto({"bake", input, "--rig", rig(), "--csv", "-", "--every", "10"});
  ASSERT_EQ(some.status, 0);
  const std::string all = readFile(path("all.csv"));
  std::istringstream rows(some.out);
  int count = 0;
  for (std::string row; std::getline(rows, row); ++count) EXPECT_NE(all.find(row + "\n"), std::string::npos);
  EXPECT_EQ(count, 4);  // header, frames 0, 10, 20
}

TEST_F(Bake, LiveLinkWeightsReachTheCharacterUnchanged) {
  const Finished run = volto({"bake", write("l.csv", liveLinkCsv(10)), "--rig", rig(), "--csv", "-"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find(",0.500000"), std::string::npos);
}

}  // namespace
}  // namespace volto::test
