// The shipped take on the shipped characters: everything from landmarks to mesh, looked at frame by frame.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "retarget/expression_health.h"
#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "tests/support/test_data.h"
#include "tools/pipeline/frame_path.h"

namespace volto::pipeline {
namespace {

class HeadTake : public ::testing::TestWithParam<const char*> {};

TEST_P(HeadTake, NothingFoldsOrPasses) {
  const auto folder = test::sourceDir() / "rig/assets";
  const std::string name = GetParam();
  std::ifstream file(folder / (name + ".points.json"));
  const std::string json{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const rig::Rig rig = rig::buildRig(rig::readMesh(folder / (name + ".obj")),
                                     rig::parseFeaturePoints(json, name + ".points.json"));
  const Performance performance = readPerformance(test::sourceDir() / "recordings/volto_take.take");
  TrackingOptions options;
  options.neutral = neutralOf(performance, options.tracker);
  FramePath path(rig, options, {.mesh = true, .weights = true});
  retarget::HealthMeasure measure(rig);
  std::size_t measured = 0, flipped = 0, degenerate = 0;
  double eyeball = 0, lids = 0, lips = 0;
  for (std::size_t frame = 0; frame < performance.frameCount(); ++frame) {
    path.push(performance, frame);
    if (frame % 6 != 0) continue;  // volto inspect --take measures all
    const retarget::PoseHealth pose = measure.measure(std::to_string(frame), path.avatar().vertices);
    ++measured;
    flipped += pose.flipped;
    degenerate += pose.degenerate;
    eyeball = std::max(eyeball, pose.eyeball_depth_es);
    lids = std::max(lids, pose.lids_depth_es);
    lips = std::max(lips, pose.lips_depth_es);
  }
  EXPECT_EQ(measured, 360U);
  EXPECT_EQ(flipped, 0U);
  EXPECT_EQ(degenerate, 0U);
  EXPECT_LT(eyeball, 0.005);
  EXPECT_LT(lids, 0.005);
  EXPECT_LT(lips, 0.005);
}

INSTANTIATE_TEST_SUITE_P(Of, HeadTake, ::testing::Values("volto_head", "volto_creature"),
                         [](const auto& which) { return std::string(which.param); });

}  // namespace
}  // namespace volto::pipeline
