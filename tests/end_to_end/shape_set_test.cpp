// Sets of blendshapes: a character gets the shapes of another set, and weights are written in another set's names.
#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

class ShapeSets : public World {
 protected:
  // The cells of a CSV file's last row under their names.
  static std::map<std::string, std::string> lastRow(const std::string& text) {
    std::istringstream lines(text);
    std::string header, line, last;
    std::getline(lines, header);
    while (std::getline(lines, line)) last = line;
    std::map<std::string, std::string> out;
    std::istringstream names(header), cells(last);
    for (std::string name, cell; std::getline(names, name, ',') && std::getline(cells, cell, ',');) out[name] = cell;
    return out;
  }
  double number(const std::map<std::string, std::string>& row, const std::string& name) const {
    const auto found = row.find(name);
    return found == row.end() || found->second.empty() ? -1 : std::stod(found->second);
  }
  void script(const std::string& text) const { writeFile(path("s.script"), text); }
};

TEST_F(ShapeSets, WeightsAreWrittenInTheNamesOfAnotherSet) {
  script("to 0.1: eyeBlinkLeft 0.5, browInnerUp 0.4\n");
  const auto rowAs = [&](const std::string& set) {
    const Finished run = volto({"animate", path("s.script"), "--rig", rig(), "--csv", "-", "--weights-as", set});
    EXPECT_EQ(run.status, 0) << run.err;
    return lastRow(run.out);
  };
  const auto ict = rowAs("ict"), facs = rowAs("facs"), vrm = rowAs("vrm0");
  EXPECT_NEAR(number(ict, "eyeBlink_L"), 0.5, 1e-3);
  EXPECT_NEAR(number(ict, "browInnerUp_L"), 0.4, 1e-3);
  EXPECT_NEAR(number(ict, "browInnerUp_R"), 0.4, 1e-3);
  EXPECT_NEAR(number(facs, "AU01"), 0.4, 1e-3);
  EXPECT_NEAR(number(facs, "AU45"), 0.25, 1e-3);  // one unit for both eyes
  EXPECT_NEAR(number(vrm, "blink_l"), 0.5, 1e-3);
  EXPECT_EQ(number(vrm, "neutral"), -1);  // means nothing: an empty cell
  writeFile(path("own.csv"), "shape,arkit,weight\nwink,eyeBlinkLeft,1\n");
  EXPECT_NEAR(number(rowAs(path("own.csv")), "wink"), 0.5, 1e-3);
}

TEST_F(ShapeSets, ACharacterGetsTheShapesOfASetAndIsUnderstoodByThem) {
  ASSERT_EQ(volto({"import", "ict", "--rig", rig(), "-o", path("ict.rig")}).status, 0);
  const auto smiling = [&](const std::string& name, const std::string& character) {
    script("to 0.1: " + name + " 1\n");
    EXPECT_EQ(volto({"animate", path("s.script"), "--rig", character, "--rate", "10", "--obj", path(name)}).status, 0);
    return rig::readMesh(path(name + "/frame_000001.obj")).positions;
  };
  const rig::VertexPositions a = smiling("mouthSmile_L", path("ict.rig")), b = smiling("mouthSmileLeft", rig());
  EXPECT_LT((a - b).rowwise().norm().maxCoeff(), 2e-3);  // contacts hold again; the head is 20 wide
  // Its weights are ARKit's again in a Live Link Face file.
  script("to 0.1: mouthSmile_L 0.6\n");
  const Finished run = volto({"animate", path("s.script"), "--rig", path("ict.rig"), "--livelink", "-"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NEAR(number(lastRow(run.out), "MouthSmileLeft"), 0.6, 1e-6);
  EXPECT_EQ(number(lastRow(run.out), "MouthSmileRight"), 0.0);
}

TEST_F(ShapeSets, ARecordingDrivesTheShapesOfItsOwnSet) {
  ASSERT_EQ(volto({"import", "ict", "--rig", rig(), "-o", path("ict.rig")}).status, 0);
  script("to 0.5: eyeBlinkLeft 0.8, jawOpen 0.5\nhold 0.2\n");
  ASSERT_EQ(volto({"animate", path("s.script"), "--rig", rig(), "--take", path("s.take")}).status, 0);
  const Finished run = volto({"bake", path("s.take"), "--rig", path("ict.rig"), "--csv", "-"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto row = lastRow(run.out);
  EXPECT_NEAR(number(row, "eyeBlink_L"), 0.8, 0.05);
  EXPECT_NEAR(number(row, "eyeBlink_R"), 0.0, 0.05);
  EXPECT_NEAR(number(row, "jawOpen"), 0.5, 0.05);
}

TEST_F(ShapeSets, SubscribersGetTheNamesAndWeightsOfAnotherSet) {
  script("hold 0.1\nto 0.1: eyeBlinkLeft 0.8, eyeBlinkRight 0.8\nhold 0.6\n");
  ASSERT_EQ(volto({"animate", path("s.script"), "--rig", rig(), "--take", path("s.take")}).status, 0);
  Process listener({listenProgram(), endpoint("names"), "--wait", "30", "--json", "--count", "30"});
  const Finished replayed = volto({"replay", path("s.take"), "--rig", rig(), "--weights-as", "vrm1", "--publish",
                                   endpoint("names"), "--wait", "20", "--lossless"});
  EXPECT_EQ(replayed.status, 0) << replayed.err;
  const Finished heard = listener.wait();
  ASSERT_EQ(heard.status, 0) << heard.err;
  const std::string last = heard.out.substr(heard.out.rfind("\n{") + 1);
  EXPECT_EQ(last.find("eyeBlinkLeft"), std::string::npos) << last;
  const std::size_t at = last.find("\"blinkLeft\":");
  ASSERT_NE(at, std::string::npos) << last;
  EXPECT_NEAR(std::stod(last.substr(at + 12)), 0.8, 0.1) << last;
}

TEST_F(ShapeSets, WhatIsNoSetIsNamed) {
  script("to 0.1: jawOpen 1\n");
  const auto complaint = [&](std::vector<std::string> arguments, int status) {
    const Finished run = volto(arguments);
    EXPECT_EQ(run.status, status) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    return run.err;
  };
  const auto live = [&](const std::string& flag, const std::string& set) {
    return complaint({"run", "udp://127.0.0.1:11998", "--rig", rig(), flag, set}, 2);
  };
  EXPECT_NE(live("--weights-as", "vmr1").find("did you mean vrm1?"), std::string::npos);
  EXPECT_NE(live("--shapes-mean", "ict").find("--weights-as"), std::string::npos);
  const std::vector<std::string> animate{"animate", path("s.script"), "--rig", rig(), "--csv", path("w.csv")};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), animate.begin(), animate.end());
    return more;
  };
  EXPECT_NE(complaint(with({"--weights-as", "vmr1"}), 2).find("did you mean vrm1?"), std::string::npos);
  EXPECT_NE(complaint(with({"--weights-as", path("none.csv")}), 66).find("none.csv"), std::string::npos);
  writeFile(path("bad.csv"), "shape,arkit,weight\nyawn,jawOpne,1\n");
  EXPECT_NE(complaint(with({"--weights-as", path("bad.csv")}), 65)
                .find("bad.csv:2: shape \"jawOpne\" is no ARKit blendshape; did you mean jawOpen?"),
            std::string::npos);
  EXPECT_NE(complaint({"animate", path("s.script"), "--rig", rig(), "--take", path("t.take"), "--weights-as", "ict"}, 2)
                .find("it needs --csv"),
            std::string::npos);
  EXPECT_NE(complaint({"import", "vrm2", "--rig", rig(), "-o", path("o.rig")}, 2).find("did you mean vrm"),
            std::string::npos);
  writeFile(path("own.csv"), "shape,arkit,weight\nyawn,jawOpen,1\nsmirk,mouthSmileLeft,1\n");
  ASSERT_EQ(volto({"import", path("own.csv"), "--rig", rig(), "-o", path("own.rig")}).status, 0);
  script("to 0.1: yawn 0.5\n");
  const std::vector<std::string> own{"animate", path("s.script"), "--rig", path("own.rig"), "--livelink", "-"};
  EXPECT_NE(complaint(own, 65).find("say by --shapes-mean F.csv"), std::string::npos);
  std::vector<std::string> told = own;
  told.insert(told.end(), {"--shapes-mean", path("own.csv")});
  const Finished run = volto(told);
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NEAR(number(lastRow(run.out), "JawOpen"), 0.5, 1e-6);
  EXPECT_FALSE(std::filesystem::exists(path("w.csv")));
}

}  // namespace
}  // namespace volto::test
