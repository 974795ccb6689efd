// What is wrong is told in one line, with the exit status for it, and nothing half-written stays behind.
#include <cmath>
#include <cstdlib>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

using Json = nlohmann::json;

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> result;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) result.push_back(line);
  return result;
}

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> result;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) result.push_back(cell);
  return result;
}

std::string joined(const std::vector<std::string>& parts, const char* separator) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : separator) + part;
  return text;
}

class BadLandmarks : public World {
 protected:
  std::string csv() const { return openFaceCsv(syntheticPerformance({.frames = 20})); }

  // In every verb that reads a performance.
  void expectRefusedEverywhere(const std::string& file, int status, const std::string& said) const {
    expectRefused(volto({"track", file, "-o", output("w.csv"), "--mask", output("m.csv")}), status, "track", said);
    expectRefused(volto({"bake", file, "--rig", rig(), "--csv", output("w.csv"), "--obj", output("obj")}), status,
                  "bake", said);
    expectRefused(volto({"replay", file, "--rig", rig(), "--publish", endpoint(), "--speed", "max"}), status, "replay",
                  said);
    expectRefused(volto({"inspect", file}), status, "inspect", said);
  }

  // One cell of the file replaced, in data row `row` (0 is the first).
  std::string withCell(std::size_t row, const std::string& column, const std::string& value) const {
    std::vector<std::string> rows = lines(csv());
    const std::vector<std::string> header = cells(rows[0]);
    std::vector<std::string> changed = cells(rows[row + 1]);
    for (std::size_t i = 0; i < header.size(); ++i) {
      if (header[i] == " " + column || header[i] == column) changed[i] = value;
    }
    rows[row + 1] = joined(changed, ",");
    return joined(rows, "\n") + "\n";
  }
};

TEST_F(BadLandmarks, AMissingFile) { expectRefusedEverywhere(path("none.csv"), 66, "none.csv"); }
TEST_F(BadLandmarks, AFolderInPlaceOfAFile) { expectRefusedEverywhere(folder_.path().string(), 66, "is a folder"); }
TEST_F(BadLandmarks, AnEmptyFile) { expectRefusedEverywhere(write("empty.csv", ""), 65, "empty.csv"); }

TEST_F(BadLandmarks, AFileCutInTheMiddleOfARow) {
  const std::string text = csv();
  expectRefusedEverywhere(write("cut.csv", text.substr(0, text.size() - 700)), 65, "cut.csv:21");
  expectRefusedEverywhere(write("cut.csv", text.substr(0, 500)), 65, "cut.csv:1");  // in the header
}

TEST_F(BadLandmarks, BinaryGarbage) {
  std::string garbage;
  for (unsigned i = 0, state = 1; i < 5000; ++i)
    garbage += static_cast<char>((state = state * 1103515245U + 12345U) >> 16U);
  expectRefusedEverywhere(write("garbage.csv", garbage), 65, "garbage.csv");
}

TEST_F(BadLandmarks, SixtySevenColumnsOfX) {
  std::vector<std::string> rows = lines(csv());
  for (std::string& row : rows) {
    std::vector<std::string> all = cells(row);
    all.erase(all.begin() + 5 + 67);  // x_67
    row = joined(all, ",");
  }
  expectRefusedEverywhere(write("narrow.csv", joined(rows, "\n") + "\n"), 65, "x_67");
}

TEST_F(BadLandmarks, LandmarksThatAreNotFinite) {
  expectRefusedEverywhere(write("nan.csv", withCell(3, "x_30", "nan")), 65, "nan.csv:5");
  expectRefusedEverywhere(write("inf.csv", withCell(3, "Y_8", "-inf")), 65, "inf.csv:5");
  expectRefusedEverywhere(write("large.csv", withCell(3, "y_8", "1e999")), 65, "large.csv:5");
}

TEST_F(BadLandmarks, TimeThatRunsBackward) {
  expectRefusedEverywhere(write("backward.csv", withCell(10, "timestamp", "0.05")), 65, "backward.csv:12");
}

TEST_F(BadLandmarks, OpenFaceFileWithoutLandmarks) {
  expectRefusedEverywhere(write("au.csv", "frame,timestamp,confidence,success,AU01_r,AU02_r\n0,0.0,0.98,1,0.1,0.2\n"),
                          65, "no landmarks");
}

TEST_F(BadLandmarks, ANeutralWithoutAFace) {
  expectRefused(volto({"track", performance(), "-o", output("w.csv"), "--neutral",
                       write("n.csv", withCell(0, "timestamp", "nan"))}),
                65, "track", "n.csv");
  expectRefused(volto({"track", performance(), "-o", output("w.csv"), "--neutral", write("l.csv", liveLinkCsv(5))}), 65,
                "track", "l.csv");
  expectRefused(volto({"track", performance(), "-o", output("w.csv"), "--neutral", path("none.csv")}), 66, "track",
                "none.csv");
}

class BadRig : public World {};

TEST_F(BadRig, MissingEmptyOrSomethingElse) {
  expectRefused(volto({"inspect", path("none.rig")}), 66, "inspect", "none.rig");
  expectRefused(volto({"inspect", write("empty.rig", "")}), 65, "inspect", "empty.rig");
  expectRefused(volto({"bake", performance(), "--rig", write("empty.rig", ""), "--csv", output("w.csv")}), 65, "bake",
                "empty.rig");
  expectRefused(volto({"bake", performance(), "--rig", headMesh(), "--csv", output("w.csv")}), 65, "bake",
                "volto_head.obj");
  expectRefused(volto({"bake", performance(), "--rig", path("none.rig"), "--csv", output("w.csv")}), 66, "bake",
                "none.rig");
}

TEST_F(BadRig, CutAnywhere) {
  const std::string whole = readFile(rig());
  ASSERT_GT(whole.size(), 1000U);
  for (const double part : {0.00001, 0.001, 0.1, 0.37, 0.5, 0.9, 0.9999}) {
    const std::string cut =
        write("cut.rig", whole.substr(0, static_cast<std::size_t>(static_cast<double>(whole.size()) * part)));
    expectRefused(volto({"inspect", cut}), 65, "inspect", "cut.rig");
    expectRefused(volto({"bake", performance(5), "--rig", cut, "--csv", output("w.csv")}), 65, "bake", "cut.rig");
  }
  expectRefused(volto({"inspect", write("cut.rig", whole.substr(0, whole.size() - 1))}), 65, "inspect", "cut.rig");
}

TEST_F(BadRig, WithFlippedBits) {
  const std::string whole = readFile(rig());
  for (std::size_t i = 0; i < 16; ++i) {
    std::string flipped = whole;
    flipped[whole.size() * i / 16 + 5] ^= static_cast<char>(1U << (i % 8));
    expectRefused(volto({"inspect", write("flipped.rig", flipped)}), 65, "inspect", "flipped.rig");
  }
}

class BadMesh : public World {
 protected:
  void expectMeshRefused(const std::string& text, const std::string& said) const {
    const std::string mesh = write("head.obj", text);
    expectRefused(volto({"rig", mesh, "--points", headPoints(), "-o", output("c.rig")}), 65, "rig", said);
    expectRefused(volto({"inspect", mesh}), 65, "inspect", said);
  }
};

TEST_F(BadMesh, WithoutFaces) { expectMeshRefused("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "head.obj"); }
TEST_F(BadMesh, WithAnIndexOutOfRange) { expectMeshRefused("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "head.obj:4"); }
TEST_F(BadMesh, WithANegativeIndexOutOfRange) {
  expectMeshRefused("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", "head.obj:4");
}
TEST_F(BadMesh, WithAVertexThatIsNotFinite) {
  expectMeshRefused("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "head.obj:2");
}
TEST_F(BadMesh, Empty) {
  expectRefused(volto({"rig", write("head.obj", ""), "--points", headPoints(), "-o", output("c.rig")}), 65, "rig",
                "head.obj");
}
TEST_F(BadMesh, Missing) {
  expectRefused(volto({"rig", path("none.obj"), "--points", headPoints(), "-o", output("c.rig")}), 66, "rig",
                "none.obj");
}

class BadPoints : public World {
 protected:
  Json points() const { return Json::parse(readFile(headPoints())); }
  void expectPointsRefused(const std::string& json, const std::string& said) const {
    const Finished run = volto({"rig", headMesh(), "--points", write("p.json", json), "-o", output("c.rig")});
    expectRefused(run, 65, "rig", said);
    EXPECT_NE(run.err.find("p.json"), std::string::npos) << run.err;  // which of the two files is at fault
  }
};

TEST_F(BadPoints, SomeMissingAreFitted) {
  Json json = points();
  json["feature_points"].erase("8.3");
  json["feature_points"].erase("12.14");
  const Finished run = volto({"rig", headMesh(), "--points", write("p.json", json.dump()), "-o", output("c.rig")});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.err.find("2 feature points fitted to the 82 given"), std::string::npos) << run.err;
}

TEST_F(BadPoints, Repeated) {
  Json json = points();
  json["feature_points"]["8.3"] = json["feature_points"]["8.4"];
  expectPointsRefused(json.dump(), "8.3");
}

TEST_F(BadPoints, OutOfRange) {
  Json json = points();
  json["feature_points"]["8.3"] = 4000000000U;
  expectPointsRefused(json.dump(), "8.3");
  json["feature_points"]["8.3"] = -1;
  expectPointsRefused(json.dump(), "8.3");
}

TEST_F(BadPoints, AllInOnePlace) {
  Json json = points();
  for (auto& point : json["feature_points"]) point = {1.0, 2.0, 3.0};
  expectPointsRefused(json.dump(), "in one place");
}

TEST_F(BadPoints, NotJsonOrNotPoints) {
  expectPointsRefused("{\"feature_points\": {\"2.1\": 4", "p.json");
  expectPointsRefused("", "p.json");
  expectPointsRefused("[1, 2]", "feature_points");
  expectPointsRefused(R"({"feature_points": {"2.99": 4}})", "2.99");
  expectPointsRefused(R"({"feature_points": {"2.1": "chin"}})", "2.1");
  expectPointsRefused(std::string(100'000, '['), "p.json");
  expectRefused(volto({"rig", headMesh(), "--points", path("none.json"), "-o", output("c.rig")}), 66, "rig",
                "none.json");
}

class BadDefinition : public World {
 protected:
  void expectDefinitionRefused(const std::string& json, const std::string& said) const {
    const Finished run = volto({"rig", headMesh(), "--points", headPoints(), "--regions", write("r.json", json), "-o", output("c.rig")});
    expectRefused(run, 65, "rig", said);
    EXPECT_NE(run.err.find("r.json"), std::string::npos) << run.err;
  }
};

TEST_F(BadDefinition, UnknownKeysAndBadValuesAreNamed) {
  expectDefinitionRefused(R"({"fade_ot": 1})", "did you mean \"fade_out\"?");
  expectDefinitionRefused(R"({"regions": [{"triangle": 3, "stiffness": 99}]})", "regions[0].stiffness");
  expectDefinitionRefused("{\n\"fade_out\": 1,\n}", "line 3");
  expectDefinitionRefused(R"({"parts": [{"vertex": 4000000000, "follows": "jaw"}]})", "vertex 4000000000");
  expectDefinitionRefused(R"({"subdivision": {"vertices": [4000000000]}})", "vertex 4000000000");
}

TEST_F(BadDefinition, AnExampleOfAnotherMeshIsNamed) {
  const std::string folder = path("examples");
  std::filesystem::create_directory(folder);
  write("examples/smile.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expectRefused(volto({"rig", headMesh(), "--points", headPoints(), "--subdivide", "auto:10", "--examples", folder, "-o", output("c.rig")}),
                65, "rig", "smile.obj");
  expectRefused(volto({"rig", headMesh(), "--points", headPoints(), "--subdivide", "auto:10", "--examples", path("none"), "-o", output("c.rig")}),
                66, "rig", "none");
}

TEST_F(BadDefinition, WhatWasSavedRebuildsTheSameRig) {
  ASSERT_EQ(volto({"rig", headMesh(), "--points", headPoints(), "--subdivide", "1", "--save-definition", output("r.json"), "-o", output("a.rig")}).status, 0);
  const Finished again = volto({"rig", headMesh(), "--regions", output("r.json"), "-o", output("b.rig")});
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(readFile(output("a.rig")), readFile(output("b.rig")));
}

}  // namespace
}  // namespace volto::test
