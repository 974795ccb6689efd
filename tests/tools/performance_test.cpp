#include "tools/pipeline/performance.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "capture/errors.h"
#include "protocol/errors.h"
#include "protocol/take_writer.h"
#include "rig/errors.h"
#include "rig/expression_table.h"
#include "tests/support/test_data.h"
#include "tests/tools/synthetic_performance.h"

namespace volto::pipeline {
namespace {

std::filesystem::path write(const test::TemporaryDir& folder, const char* name, const std::string& text) {
  std::ofstream(folder / name, std::ios::binary) << text;
  return folder / name;
}

TEST(Performance, IsToldByWhatIsInTheFileAndNotByItsName) {
  test::TemporaryDir folder;
  const auto open_face = write(folder, "a.txt", test::openFaceCsv(test::syntheticPerformance({.frames = 3})));
  const auto live_link = write(folder, "b.take", test::liveLinkCsv(3));
  EXPECT_EQ(readPerformance(open_face).format, PerformanceFormat::openface_csv);
  EXPECT_EQ(readPerformance(live_link).format, PerformanceFormat::live_link_csv);
  EXPECT_EQ(readPerformance(open_face).source, "a");
}

TEST(Performance, TakeGivesBackTheFramesThatWereRecorded) {
  test::TemporaryDir folder;
  auto frames = test::syntheticPerformance({.frames = 10});
  frames.erase(frames.begin() + 4);  // a frame that the camera lost
  {
    protocol::TakeWriter writer((folder / "t.csv").string(), protocol::TakeHeader());
    for (const LandmarkFrame& frame : frames) ASSERT_TRUE(writer.append(frame, "webcam").ok());
    ASSERT_TRUE(writer.finish().ok());
  }
  const Performance performance = readPerformance(folder / "t.csv");
  EXPECT_EQ(performance.format, PerformanceFormat::take);
  EXPECT_EQ(performance.source, "webcam");
  ASSERT_EQ(performance.landmarks.size(), 9U);
  EXPECT_EQ(performance.landmarks[4].points_px, frames[4].points_px);
  EXPECT_EQ(performance.landmarks[4].points_camera_mm, frames[4].points_camera_mm);
  EXPECT_EQ(performance.time(8), frames[8].t_capture_ns);
  EXPECT_EQ(performance.gaps(), 1U);
  EXPECT_EQ(performance.lost, 0U);
  EXPECT_NEAR(performance.rate(), 60.0, 0.01);
  EXPECT_NEAR(performance.durationS(), 9.0 / 60, 1e-6);
}

TEST(Performance, TakeWithoutLandmarksIsPlayedFromItsMasks) {
  test::TemporaryDir folder;
  {
    protocol::TakeWriter writer((folder / "t.take").string(), protocol::TakeHeader());
    MaskFrame mask;
    for (int i = 0; i < 5; ++i) {
      mask.t_capture_ns = 9'000'000'000'123 + i * 10'000'000;
      mask.capture_seq = static_cast<std::uint64_t>(i);
      mask.state = TrackingState::tracking;
      mask.displacement_fapu[7] = {0.0F, 0.01F * static_cast<float>(i), 0.0F};
      ASSERT_TRUE(writer.append(mask, "anna").ok());
    }
    ASSERT_TRUE(writer.finish().ok());
  }
  const Performance performance = readPerformance(folder / "t.take");
  EXPECT_TRUE(performance.landmarks.empty());
  ASSERT_EQ(performance.masks.size(), 5U);
  EXPECT_FLOAT_EQ(performance.masks[3].displacement_fapu[7][1], 0.03F);
  EXPECT_EQ(performance.time(0), 0);  // whenever it was recorded, it begins at zero
  EXPECT_EQ(performance.time(3), 30'000'000);
}

TEST(Performance, LiveLinkWeightsGoStraightThroughTheTable) {
  test::TemporaryDir folder;
  const Performance performance = readPerformance(write(folder, "l.csv", test::liveLinkCsv(4)));
  ASSERT_EQ(performance.masks.size(), 4U);
  const MaskFrame& mask = performance.masks[2];
  const std::size_t jaw = *arkitBlendshapeIndex("jawOpen"), tongue = *arkitBlendshapeIndex("tongueOut");
  EXPECT_FLOAT_EQ(mask.arkit_weights[jaw], 0.5F);
  EXPECT_FLOAT_EQ(mask.arkit_weights[tongue], 0.5F);
  EXPECT_TRUE(mask.arkit_observed[tongue]);
  EXPECT_TRUE(mask.head.observed);
  EXPECT_GT(mask.head.rotation[3], 0.98F);  // the rotation says the same as the angles
  EXPECT_LT(mask.head.rotation[3], 0.9999F);
  const auto column = rig::ExpressionTable::standard().basis().col(static_cast<Eigen::Index>(jaw));
  const std::size_t chin = *rig::featurePointIndex("2.1");
  EXPECT_LT(column(static_cast<Eigen::Index>(3 * chin + 1)), -0.1);  // an opening jaw takes the chin down
  EXPECT_NEAR(static_cast<double>(mask.displacement_fapu[chin][1]),
              0.5 * column(static_cast<Eigen::Index>(3 * chin + 1)), 1e-5);
}

TEST(Performance, AFileCutInTheMiddleOfARowIsNotPassedOffAsWhole) {
  test::TemporaryDir folder;
  const std::string text = test::openFaceCsv(test::syntheticPerformance({.frames = 5}));
  try {
    readPerformance(write(folder, "cut.csv", text.substr(0, text.size() - 300)));
    FAIL() << "was read";
  } catch (const rig::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("cut.csv:6: "), std::string::npos) << error.what();
  }
}

TEST(Performance, BadFilesAreRefusedWithOneLineThatNamesThem) {
  test::TemporaryDir folder;
  for (const auto& [name, text] : {std::pair{"empty.csv", std::string()},
                                   {"garbage.csv", std::string("\x7f"
                                                               "ELF\x01\x02\x03 \xff\xfe,,",
                                                               12)},
                                   {"words.csv", std::string("hello\nworld\n")},
                                   {"header.csv", test::openFaceCsv({})}}) {
    try {
      readPerformance(write(folder, name, text));
      ADD_FAILURE() << name << " was read";
    } catch (const capture::InputError& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(readPerformance(folder / "none.csv"), std::system_error);
  const auto sqlite = write(folder, "s.take", std::string("SQLite format 3\0", 16) + std::string(50, '\0'));
  EXPECT_THROW(readPerformance(sqlite), protocol::SetupError);
}

}  // namespace
}  // namespace volto::pipeline
