// The whole chain on real pictures: needs the public test material with its models.
#include "capture/detection/face_finder.h"

#include <chrono>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "capture/detection/model_manifest.h"
#include "capture/video/video_source.h"
#include "tests/support/test_data.h"

namespace volto::capture {
namespace {

using namespace std::chrono_literals;

FaceFinder finderFrom(const std::filesystem::path& data, const FaceFinderOptions& options = {}) {
  const std::vector<std::filesystem::path> folders = {data / "models"};
  const ModelFile faces = findModel(ModelManifest::Task::faces, "yunet", folders);
  const ModelFile landmarks = findModel(ModelManifest::Task::landmarks, "pfld_68", folders);
  return {FaceDetector(faces.manifest, readModelBytes(faces, false), faces.path.string()),
          LandmarkModel(landmarks.manifest, readModelBytes(landmarks, false), landmarks.path.string()), options};
}

std::array<float, 2> middleOf(const LandmarkFrame& frame) {
  std::array<float, 2> sum{};
  for (const auto& p : frame.points_px)
    for (std::size_t c = 0; c < 2; ++c) sum[c] += p[c] / static_cast<float>(frame.points_px.size());
  return sum;
}

// Every `step`-th picture of a video.
std::vector<LandmarkFrame> follow(FaceFinder& finder, const std::filesystem::path& video, int step = 1) {
  std::vector<LandmarkFrame> out;
  const auto source = openVideo(video);
  Image image;
  for (int i = 0; source->next(image, 1s) == Next::frame; ++i)
    if (i % step == 0) finder.push(image, out.emplace_back());
  return out;
}

TEST(FaceFinder, FollowsTheTalkingFaceWithOneSearch) {
  VOLTO_REQUIRE_DATA(data);
  FaceFinder finder = finderFrom(data);
  const auto frames = follow(finder, data / "video/talking_512x512_25fps.mp4", 4);
  ASSERT_EQ(frames.size(), 50U);
  for (const LandmarkFrame& frame : frames) {
    EXPECT_TRUE(frame.face_present);
    EXPECT_GT(frame.confidence, 0.6);
    EXPECT_EQ(frame.image_width_px, 512);
  }
  EXPECT_EQ(finder.counters().searches, 1U) << "the detector searches the whole picture only when there is no face";
  EXPECT_EQ(finder.counters().losses, 0U);
}

TEST(FaceFinder, OfTwoFacesEachIsFollowedThroughTheTurnWithoutAJump) {
  VOLTO_REQUIRE_DATA(data);
  for (const int number : {1, 2}) {
    FaceFinderOptions options;
    options.choice = {.kind = FaceChoice::Kind::number, .number = number};
    FaceFinder finder = finderFrom(data, options);
    const auto frames = follow(finder, data / "video/head-pose-face-detection-female-and-male.gif");
    for (std::size_t i = 0; i < frames.size(); ++i) {
      ASSERT_TRUE(frames[i].face_present) << "face " << number << " frame " << i;
      const auto at = middleOf(frames[i]);
      EXPECT_EQ(at[0] > 240, number == 2) << "face " << number << " frame " << i;
      if (i == 0) continue;
      const auto before = middleOf(frames[i - 1]);
      EXPECT_LT(std::hypot(at[0] - before[0], at[1] - before[1]), 16) << "face " << number << " frame " << i;
    }
  }
}

TEST(FaceFinder, AThirdFaceThatIsNotThereIsNoFace) {
  VOLTO_REQUIRE_DATA(data);
  FaceFinderOptions options;
  options.choice = {.kind = FaceChoice::Kind::number, .number = 3};
  FaceFinder finder = finderFrom(data, options);
  const auto frames = follow(finder, data / "video/head-pose-face-detection-female-and-male.gif", 20);
  for (const LandmarkFrame& frame : frames) EXPECT_FALSE(frame.face_present);
}

TEST(FaceFinder, BlackAndNoiseShowNobodyAndAFaceThatVanishesIsLostWithinThreeFrames) {
  VOLTO_REQUIRE_DATA(data);
  FaceFinder finder = finderFrom(data);
  const auto source = openVideo(data / "video/talking_512x512_25fps.mp4");
  Image image;
  LandmarkFrame frame;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(source->next(image, 1s), Next::frame);
    finder.push(image, frame);
  }
  ASSERT_TRUE(frame.face_present);
  Image black = image;
  std::fill(black.bgr.begin(), black.bgr.end(), std::uint8_t{0});
  int until_lost = 0;
  for (; until_lost < 10 && frame.face_present; ++until_lost) {
    black.t_capture_ns += 40'000'000;
    finder.push(black, frame);
  }
  EXPECT_LE(until_lost, 3);
  EXPECT_TRUE(frame.points_px.empty());
  std::uint32_t random = 1;
  for (std::uint8_t& byte : black.bgr)
    byte = static_cast<std::uint8_t>((random = random * 1664525U + 1013904223U) >> 24U);
  finder.push(black, frame);
  EXPECT_FALSE(frame.face_present) << "noise is nobody";
  image.t_capture_ns = black.t_capture_ns + 40'000'000;
  finder.push(image, frame);
  EXPECT_TRUE(frame.face_present) << "found again at once";
}

TEST(FaceFinder, APictureOfAnotherSizeIsSearchedAnew) {
  VOLTO_REQUIRE_DATA(data);
  FaceFinder finder = finderFrom(data);
  Image image;
  LandmarkFrame frame;
  ASSERT_EQ(openVideo(data / "video/talking_512x512_25fps.mp4")->next(image, 1s), Next::frame);
  finder.push(image, frame);
  const auto large = middleOf(frame);
  Image half;
  half.resize(256, 256);
  for (std::size_t y = 0; y < 256; ++y)
    for (std::size_t x = 0; x < 256; ++x)
      for (std::size_t c = 0; c < 3; ++c) half.bgr[3 * (256 * y + x) + c] = image.bgr[3 * (512 * 2 * y + 2 * x) + c];
  half.t_capture_ns = image.t_capture_ns + 40'000'000;
  finder.push(half, frame);
  ASSERT_TRUE(frame.face_present);
  EXPECT_NEAR(middleOf(frame)[0], large[0] / 2, 3);
  EXPECT_NEAR(middleOf(frame)[1], large[1] / 2, 3);
}

TEST(FaceChoice, IsSaidInWords) {
  EXPECT_EQ(parseFaceChoice("front").kind, FaceChoice::Kind::in_front);
  EXPECT_EQ(parseFaceChoice("2").number, 2);
  EXPECT_EQ(parseFaceChoice("0.25,0.5").x, 0.25F);
  for (const char* bad : {"", "0", "-1", "2.5", "1.5,0", "0.5,", "left", "65", "nan,0"})
    EXPECT_THROW(parseFaceChoice(bad), std::invalid_argument) << bad;
}

}  // namespace
}  // namespace volto::capture
