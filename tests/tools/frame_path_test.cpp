#include "tools/pipeline/frame_path.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "protocol/codec.h"
#include "tests/retarget/allocation_counter.h"
#include "tests/retarget/synthetic_rig.h"
#include "tests/tools/synthetic_performance.h"

namespace volto::pipeline {
namespace {

Performance performanceOf(std::vector<LandmarkFrame> frames) {
  Performance performance;
  performance.landmarks = std::move(frames);
  return performance;
}

TrackingOptions offline(const Performance& performance) {
  TrackingOptions options;
  options.neutral = neutralOf(performance, options.tracker);
  return options;
}

TEST(FramePath, FromLandmarksToEncodedMessagesAllocatesNothingPerFrame) {
  const Performance performance = performanceOf(test::syntheticPerformance({.frames = 240}));
  const rig::Rig rig = test::syntheticRig();
  // With a neutral given, and learning it on the way.
  for (const TrackingOptions& options : {offline(performance), TrackingOptions{}}) {
    FramePath path(rig, options);
    protocol::Encoder weights, mesh(1U << 20U), mask, landmarks;
    const auto frame = [&](std::size_t i) {
      path.push(performance.landmarks[i]);
      const protocol::Stamp stamp{.epoch = 1, .seq = i + 1};
      for (const protocol::Result& result :
           {weights.encodeWeights(stamp, 1, path.avatar()), mesh.encodeMesh(stamp, 1, path.avatar()),
            mask.encode(stamp, path.mask()), landmarks.encode(stamp, performance.landmarks[i])}) {
        if (!result) return result;
      }
      return protocol::Result();
    };
    constexpr std::size_t kWarmUp = 60;
    for (std::size_t i = 0; i < kWarmUp; ++i) ASSERT_EQ(frame(i).problem, "");
    std::size_t refused = 0;
    const std::size_t before = test::allocationCount();
    for (std::size_t i = kWarmUp; i < performance.frameCount(); ++i) refused += frame(i) ? 0 : 1;
    EXPECT_EQ(test::allocationCount() - before, 0U) << (options.neutral ? "neutral given" : "neutral learnt");
    EXPECT_EQ(refused, 0U);
  }
}

TEST(FramePath, RestartedItGivesTheSameBitsAgain) {
  const Performance performance = performanceOf(test::syntheticPerformance({.frames = 90}));
  const rig::Rig rig = test::syntheticRig();
  FramePath path(rig, offline(performance));
  std::vector<std::vector<float>> first;
  std::vector<std::vector<std::array<float, 3>>> vertices;
  for (std::size_t i = 0; i < performance.frameCount(); ++i) {
    path.push(performance, i);
    first.push_back(path.avatar().weights);
    vertices.push_back(path.avatar().vertices);
  }
  path.restart();
  for (std::size_t i = 0; i < performance.frameCount(); ++i) {
    path.push(performance, i);
    ASSERT_EQ(path.avatar().weights, first[i]) << "frame " << i;
    ASSERT_EQ(path.avatar().vertices, vertices[i]) << "frame " << i;
  }
}

TEST(FramePath, TheJawThatOpensIsSeenAsAnOpeningJaw) {
  const Performance performance = performanceOf(test::syntheticPerformance({.frames = 240}));
  Tracking tracking(offline(performance));
  const std::size_t jaw = *arkitBlendshapeIndex("jawOpen");
  double xy = 0, xx = 0, yy = 0, x_mean = 0, y_mean = 0;
  std::vector<std::pair<double, double>> pairs;
  MaskFrame mask;
  for (std::size_t i = 0; i < performance.frameCount(); ++i) {
    tracking.push(performance, i, mask);
    pairs.emplace_back(static_cast<double>(mask.arkit_weights[jaw]),
                       static_cast<double>(test::syntheticJawOpen(static_cast<double>(performance.time(i)) * 1e-9)));
    x_mean += pairs.back().first / 240;
    y_mean += pairs.back().second / 240;
  }
  for (const auto& [x, y] : pairs) {
    xy += (x - x_mean) * (y - y_mean);
    xx += (x - x_mean) * (x - x_mean);
    yy += (y - y_mean) * (y - y_mean);
  }
  EXPECT_GT(xy / std::sqrt(xx * yy), 0.9);
}

TEST(FramePath, RecordedWeightsReachTheShapesOfTheSameNameUnchanged) {
  Performance performance;
  performance.format = PerformanceFormat::live_link_csv;
  MaskFrame mask;
  mask.state = TrackingState::tracking;
  const std::size_t tongue = *arkitBlendshapeIndex("tongueOut"), puff = *arkitBlendshapeIndex("cheekPuff");
  mask.arkit_weights[tongue] = 0.75F;
  mask.arkit_observed[tongue] = true;
  performance.masks = {mask};
  const rig::Rig rig = test::syntheticRig();
  FramePath path(rig, {});
  path.push(performance, 0);
  EXPECT_EQ(path.avatar().weights[tongue], 0.75F);
  EXPECT_EQ(path.avatar().observed[tongue], 1);
  EXPECT_EQ(path.avatar().observed[puff], 0);
}

}  // namespace
}  // namespace volto::pipeline
