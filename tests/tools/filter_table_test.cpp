// Jitter and lag of the filters in one table, for the settings that people choose: a made-up performance with a
// detector's noise, the shipped take of a real detector, and a picture that is held still before the networks.
//
//   live_test --gtest_filter=FilterTable.*
#include <cmath>
#include <cstdio>
#include <random>

#include <gtest/gtest.h>

#include "capture/detection/face_finder.h"
#include "capture/detection/model_manifest.h"
#include "capture/video/video_source.h"
#include "protocol/take_reader.h"
#include "tests/support/test_data.h"
#include "tests/tools/filter_measures.h"
#include "tests/tracker/synthetic_actor.h"

namespace volto::test {
namespace {

using namespace std::chrono_literals;

constexpr double kRate_hz = 25;
constexpr std::array<double, 5> kSettings = {0.5, 1, 2, 4, 8};

// The made-up performance: rest, twelve blinks, twelve openings of the jaw. Seconds.
constexpr double kRestFrom_s = 1, kRestTo_s = 13, kBlinksFrom_s = 14, kJawsFrom_s = 32, kEnd_s = 50;
constexpr double kSpacing_s = 1.43;  // no multiple of a frame: each move begins elsewhere between two frames
// As PFLD's landmarks shake on a picture that is held still under a camera's noise; there the face is half as large
// again.
constexpr double kNoise_px = 0.25;

double ramp(double t, double from, double to) { return std::clamp((t - from) / (to - from), 0.0, 1.0); }

ArkitWeights performance(double t_s) {
  double blink = 0, jaw = 0;
  for (int i = 0; i < 12; ++i) {
    const double b = t_s - kBlinksFrom_s - i * kSpacing_s, j = t_s - kJawsFrom_s - i * kSpacing_s;
    blink += ramp(b, 0, 0.09) * (1 - ramp(b, 0.13, 0.28));
    jaw += 0.6 * ramp(j, 0, 0.16) * (1 - ramp(j, 0.26, 0.45));
  }
  return expression({{"eyeBlinkLeft", static_cast<float>(blink)},
                     {"eyeBlinkRight", static_cast<float>(blink)},
                     {"jawOpen", static_cast<float>(jaw)},
                     {"mouthSmileLeft", 0.2F},
                     {"mouthSmileRight", 0.2F},
                     {"browInnerUp", 0.1F}});
}

struct Filtered {
  double smoothing;
  Tracked tracked;
  double mouth_frames, lid_frames;  // of the moving averages that are as smooth
};

class FilterTable : public ::testing::Test {
 protected:
  // Performed once for all tests.
  static void SetUpTestSuite() {
    SyntheticActor actor(7, kNoise_px);
    std::vector<LandmarkFrame> rest, frames;
    for (int i = 0; i < 50; ++i) rest.push_back(actor.frame(i / kRate_hz, {}));
    for (int i = 0; i < kEnd_s * kRate_hz; ++i) frames.push_back(actor.frame(i / kRate_hz, performance(i / kRate_hz)));
    neutral = tracker::neutralFromRest(rest);
    unfiltered = track(frames, 0, &neutral);
    settings.clear();
    for (const double smoothing : kSettings) {
      Filtered one{smoothing, track(frames, smoothing, &neutral), 0, 0};
      one.mouth_frames =
          equallySmooth(unfiltered, one.tracked, shapesOf(Region::mouth, unfiltered), kRestFrom_s, kRestTo_s);
      one.lid_frames =
          equallySmooth(unfiltered, one.tracked, shapesOf(Region::lids, unfiltered), kRestFrom_s, kRestTo_s);
      settings.push_back(std::move(one));
    }
  }
  static void TearDownTestSuite() { settings.clear(); }

  static void printJitter(const char* name, const Tracked& tracked, double from_s, double to_s) {
    std::printf("  %-12s", name);
    for (const Region region : {Region::lids, Region::brows, Region::mouth, Region::cheeks})
      std::printf("  %8.5f", jitter(tracked, shapesOf(region, tracked), from_s, to_s));
    std::printf("\n");
  }
  static void printLag(const char* what, double smoothing, const Lag& filter, const Lag& average, double frames) {
    std::printf(
        "  %-5g %-8s %6.1f ms (worst %5.1f), peak %3.0f %%;  moving average of %4.2f frames %6.1f ms, peak %3.0f %%\n",
        smoothing, what, 1e3 * filter.mean_s, 1e3 * filter.worst_s, 100 * filter.peak, frames, 1e3 * average.mean_s,
        100 * average.peak);
  }
  static std::string nameOf(double smoothing) {
    char text[24];
    std::snprintf(text, sizeof text, "%g", smoothing);
    return text;
  }

  static tracker::NeutralFace neutral;
  static Tracked unfiltered;
  static std::vector<Filtered> settings;
};
tracker::NeutralFace FilterTable::neutral;
Tracked FilterTable::unfiltered;
std::vector<Filtered> FilterTable::settings;

TEST_F(FilterTable, AFaceAtRestIsStiller) {
  std::printf("standard deviation at rest    lids     brows     mouth    cheeks\n");
  printJitter("unfiltered", unfiltered, kRestFrom_s, kRestTo_s);
  for (const Filtered& one : settings) {
    printJitter(nameOf(one.smoothing).c_str(), one.tracked, kRestFrom_s, kRestTo_s);
    for (const Region region : {Region::lids, Region::brows, Region::mouth, Region::cheeks}) {
      const auto shapes = shapesOf(region, unfiltered);
      EXPECT_LT(jitter(one.tracked, shapes, kRestFrom_s, kRestTo_s),
                (one.smoothing < 1 ? 0.8 : 0.67) * jitter(unfiltered, shapes, kRestFrom_s, kRestTo_s));
    }
  }
}

TEST_F(FilterTable, ABlinkAndAJawAreAtMostHalfAsLateAsByAMovingAverageThatIsAsSmooth) {
  const Signal lids = unfiltered.bothSides("eyeBlink");
  const Signal jaw = unfiltered.signal(*arkitBlendshapeIndex("jawOpen"));
  std::vector<Rise> blinks = rises(lids, 0.4), openings = rises(jaw, 0.2);
  ASSERT_EQ(blinks.size(), 12U);
  ASSERT_EQ(openings.size(), 12U);
  for (const Filtered& one : settings) {
    const Lag blink = lagBehind(lids, one.tracked.bothSides("eyeBlink"), blinks);
    const Lag blink_average = lagBehind(lids, movingAverage(lids, one.lid_frames), blinks);
    printLag("blink", one.smoothing, blink, blink_average, one.lid_frames);
    EXPECT_LE(blink.mean_s, 0.5 * blink_average.mean_s);
    EXPECT_EQ(blink.missed, 0);
    const Lag opening = lagBehind(jaw, one.tracked.signal(*arkitBlendshapeIndex("jawOpen")), openings);
    const Lag opening_average = lagBehind(jaw, movingAverage(jaw, one.mouth_frames), openings);
    printLag("jaw", one.smoothing, opening, opening_average, one.mouth_frames);
    EXPECT_LE(opening.mean_s, 0.5 * opening_average.mean_s);
    EXPECT_EQ(opening.missed, 0);
  }
}

// The whole tracker and not only its filters: how late is each move against the move itself, both at half of their own
// height? (How much of a jaw is jawOpen and how much the lips' shapes is another matter, tests/tracker/README.md.)
TEST_F(FilterTable, TheTrackerAsAWholeIsLessThanAPictureLate) {
  Signal lids, jaw;
  for (const double t_s : unfiltered.time_s) {
    const ArkitWeights truth = performance(t_s);
    lids.time_s.push_back(t_s);
    lids.value.push_back(truth[*arkitBlendshapeIndex("eyeBlinkLeft")]);
    jaw.value.push_back(truth[*arkitBlendshapeIndex("jawOpen")]);
  }
  jaw.time_s = lids.time_s;
  const auto lag = [](const Signal& truth, Signal tracked, double height) {
    const std::vector<Rise> moves = rises(truth, height);
    const double share = lagBehind(truth, tracked, moves).peak;
    for (double& v : tracked.value) v /= share;
    return lagBehind(truth, tracked, moves).mean_s;
  };
  for (const Filtered& one : settings) {
    const double blink_s = lag(lids, one.tracked.bothSides("eyeBlink"), 0.4);
    const double jaw_s = lag(jaw, one.tracked.signal(*arkitBlendshapeIndex("jawOpen")), 0.2);
    std::printf("  %-5g against the truth: blink %4.1f ms, jaw %4.1f ms\n", one.smoothing, 1e3 * blink_s, 1e3 * jaw_s);
    EXPECT_LT(std::abs(blink_s), 1 / kRate_hz);
    EXPECT_LT(std::abs(jaw_s), 1 / kRate_hz);
  }
}

TEST_F(FilterTable, OfARealDetectorToo) {
  std::vector<LandmarkFrame> frames;
  protocol::TakeReader reader((sourceDir() / "recordings/talking.take").string());
  protocol::LandmarkMessage message;
  while (reader.next(message)) frames.push_back(message.frame);
  ASSERT_EQ(frames.size(), 200U);
  const Tracked raw = track(frames, 0, nullptr);
  const Signal lids = raw.bothSides("eyeBlink"), jaw = raw.signal(*arkitBlendshapeIndex("jawOpen"));
  const std::vector<Rise> blinks = rises(lids, 0.4), openings = rises(jaw, 0.15);
  std::printf("%zu blinks, %zu openings of the jaw\n", blinks.size(), openings.size());
  ASSERT_GE(blinks.size(), 2U);
  ASSERT_GE(openings.size(), 3U);
  for (const Filtered& one : settings) {
    const Tracked filtered = track(frames, one.smoothing, nullptr);
    const Lag blink = lagBehind(lids, filtered.bothSides("eyeBlink"), blinks);
    const Lag blink_average = lagBehind(lids, movingAverage(lids, one.lid_frames), blinks);
    printLag("blink", one.smoothing, blink, blink_average, one.lid_frames);
    EXPECT_LE(blink.mean_s, 0.5 * blink_average.mean_s);
    const Lag opening = lagBehind(jaw, filtered.signal(*arkitBlendshapeIndex("jawOpen")), openings);
    const Lag opening_average = lagBehind(jaw, movingAverage(jaw, one.mouth_frames), openings);
    printLag("jaw", one.smoothing, opening, opening_average, one.mouth_frames);
    EXPECT_LE(opening.mean_s, 0.5 * opening_average.mean_s);
  }
}

// One picture again and again, each time with another noise of a camera (3 grey levels).
TEST_F(FilterTable, APictureThatIsHeldStillIsStiller) {
  VOLTO_REQUIRE_DATA(data);
  const std::vector<std::filesystem::path> folders = {data / "models"};
  const auto faces = capture::findModel(capture::ModelManifest::Task::faces, "yunet", folders);
  const auto points = capture::findModel(capture::ModelManifest::Task::landmarks, "pfld_68", folders);
  capture::FaceFinder finder(
      capture::FaceDetector(faces.manifest, capture::readModelBytes(faces, false), faces.path.string()),
      capture::LandmarkModel(points.manifest, capture::readModelBytes(points, false), points.path.string()), {});
  capture::Image picture, noisy;
  ASSERT_EQ(capture::openVideo(data / "video/talking_512x512_25fps.mp4")->next(picture, 1s), capture::Next::frame);
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 3);
  std::vector<LandmarkFrame> frames;
  for (int i = 0; i < 75; ++i) {
    noisy = picture;
    noisy.t_capture_ns = static_cast<std::int64_t>(i * 1e9 / kRate_hz);
    for (std::uint8_t& v : noisy.bgr)
      v = static_cast<std::uint8_t>(std::clamp(static_cast<float>(v) + noise(random), 0.0F, 255.0F));
    finder.push(noisy, frames.emplace_back());
    ASSERT_TRUE(frames.back().face_present);
  }
  const tracker::NeutralFace own = tracker::neutralFromRest(frames);
  std::printf("a held picture                lids     brows     mouth    cheeks\n");
  const Tracked raw = track(frames, 0, &own);
  printJitter("unfiltered", raw, 1, 3);
  for (const Filtered& one : settings) {
    const Tracked filtered = track(frames, one.smoothing, &own);
    printJitter(nameOf(one.smoothing).c_str(), filtered, 1, 3);
    const auto shapes = shapesOf(Region::mouth, raw);
    EXPECT_LT(jitter(filtered, shapes, 1, 3), jitter(raw, shapes, 1, 3));
  }
}

}  // namespace
}  // namespace volto::test
