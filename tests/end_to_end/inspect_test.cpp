// volto inspect: what a file is.
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "protocol/take_writer.h"
#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

using Json = nlohmann::json;

class Inspect : public World {
 protected:
  static Json inspect(const std::string& file) {
    const Finished run = volto({"inspect", file, "--json"});
    EXPECT_EQ(run.status, 0) << run.err;
    return Json::parse(run.out);
  }
};

TEST_F(Inspect, FeaturePointsOfARigAreThoseThatItWasRiggedWith) {
  const Json rig = inspect(this->rig());
  EXPECT_EQ(rig["kind"], "rig");
  const Json given = Json::parse(readFile(headPoints()))["feature_points"];
  ASSERT_EQ(rig["feature_points"].size(), 84U);
  // Positions of the mesh file itself.
  std::vector<std::array<double, 3>> vertices;
  std::ifstream mesh(headMesh());
  for (std::string line; std::getline(mesh, line);) {
    std::array<double, 3> v{};
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &v[0], &v[1], &v[2]) == 3) vertices.push_back(v);
  }
  EXPECT_EQ(rig["vertices"], vertices.size());
  for (const auto& [id, point] : rig["feature_points"].items()) {
    if (given[id].is_number()) {
      EXPECT_EQ(point["vertex"], given[id]) << id;
    }
    if (!point["vertex"].is_number()) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(point["position"][axis].get<double>(), vertices[point["vertex"].get<std::size_t>()][axis], 1e-4)
          << id;
    }
  }
}

TEST_F(Inspect, APictureShowsTheMaskTheRegionsAndTheWorstExpression) {
  const Finished run = volto({"inspect", this->rig(), "--picture", path("health.png")});
  ASSERT_EQ(run.status, 0) << run.err;
  const std::string png = readFile(path("health.png"));
  EXPECT_EQ(png.substr(1, 3), "PNG");
  EXPECT_GT(png.size(), 50'000U);
  expectRefused(volto({"inspect", headMesh(), "--picture", output("other.png")}), 65, "inspect", "show a rig");
}

TEST_F(Inspect, RigTellsItsHealth) {
  const Json rig = inspect(this->rig());
  for (const char* unit : {"IRISD0", "ES0", "ENS0", "MNS0", "MW0"})
    EXPECT_GT(rig["fapu"][unit].get<double>(), 0.0) << unit;
  const Json& kinds = rig["association"];
  EXPECT_EQ(kinds["ray"].get<int>() + kinds["geodesic"].get<int>() + kinds["rigid_part"].get<int>() +
                kinds["outside"].get<int>(),
            rig["vertices"].get<int>());
  EXPECT_EQ(rig["blendshapes"].size(), 52U);
  EXPECT_GT(rig["operator"]["nonzeros"].get<int>(), 0);
  EXPECT_EQ(rig["operator"]["rows"], rig["vertices"]);
  const Json& health = rig["health"];
  EXPECT_EQ(health["regions"]["each"].size(), 136U);
  EXPECT_LT(health["smoothness"]["border_jump"].get<double>(), 0.1);
  EXPECT_EQ(health["unassigned"]["count"], 0);
  EXPECT_EQ(health["expressions"]["shapes"], 52);
  const Finished words = volto({"inspect", this->rig()});
  EXPECT_EQ(words.status, 0);
  EXPECT_NE(words.out.find("kind: rig"), std::string::npos);
}

TEST_F(Inspect, TakeTellsFramesAndGaps) {
  auto frames = syntheticPerformance({.frames = 61});
  frames.erase(frames.begin() + 20, frames.begin() + 23);
  {
    protocol::TakeHeader header;
    header.name = "demo";
    header.layout = "ibug68";
    protocol::TakeWriter writer(path("t.take"), header);
    for (const LandmarkFrame& frame : frames) ASSERT_TRUE(writer.append(frame, "webcam").ok());
    ASSERT_TRUE(writer.finish().ok());
  }
  const Json take = inspect(path("t.take"));
  EXPECT_EQ(take["kind"], "take");
  EXPECT_EQ(take["name"], "demo");
  EXPECT_EQ(take["layout"], "ibug68");
  EXPECT_EQ(take["frames"], 58);
  EXPECT_EQ(take["gaps"], 3);
  EXPECT_NEAR(take["duration_s"].get<double>(), 1.0, 1e-6);
  EXPECT_TRUE(take["finished"].get<bool>());
  EXPECT_TRUE(take["problems"].empty());
}

TEST_F(Inspect, MeshesAndCsvFilesToo) {
  const Json mesh = inspect(headMesh());
  EXPECT_EQ(mesh["kind"], "mesh");
  EXPECT_GT(mesh["components"].get<int>(), 2);  // skin and two eyeballs at least
  const Json open_face = inspect(performance(60));
  EXPECT_EQ(open_face["kind"], "OpenFace CSV");
  EXPECT_EQ(open_face["frames"], 60);
  EXPECT_TRUE(open_face["has_3d"].get<bool>());
  EXPECT_NEAR(open_face["frames_per_second"].get<double>(), 60.0, 0.5);
  const Json live_link = inspect(write("l.csv", liveLinkCsv(30)));
  EXPECT_EQ(live_link["kind"], "Live Link Face CSV");
  EXPECT_EQ(live_link["shapes"], 52);
}

TEST_F(Inspect, AFileOfNoKnownKindIsRefused) {
  expectRefused(volto({"inspect", write("notes.txt", "buy milk\n")}), 65, "inspect", "notes.txt");
  expectRefused(volto({"inspect", write("empty", "")}), 65, "inspect", "empty");
}

}  // namespace
}  // namespace volto::test
