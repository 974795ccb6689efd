// What befalls a camera while it streams, and how long it takes to go on. Times are those of the virtual clock.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/capture/fake/troubles.h"
#include "tests/capture/v4l2/camera_stage.h"

namespace volto::capture {
namespace {

constexpr double kPeriod = 1.0 / 30;

TEST(Unplug, IsNoticedWithinAPictureAndFiftyMilliseconds) {
  Stage stage("");
  ASSERT_EQ(stage.take(30), 30);
  stage.system.world().apply("unplug");
  EXPECT_LE(stage.untilState(SourceState::no_signal), kPeriod + 0.050);
  EXPECT_EQ(stage.system.world().openFiles(), 0U) << "an open file keeps the node's number taken";
  EXPECT_EQ(stage.system.world().liveMaps(), 0U);
  EXPECT_TRUE(says(stage.source->notice(), {"gone"}));
  EXPECT_EQ(stage.counters().losses, 1U);
}

TEST(Unplug, IsNoticedWhileWaitingForAPicture) {
  Stage stage("at 30 unplug");
  ASSERT_EQ(stage.take(29), 29);
  const std::int64_t before = stage.system.nowNs();
  EXPECT_EQ(stage.next(5000), Next::nothing);
  EXPECT_EQ(stage.source->state(), SourceState::no_signal);
  EXPECT_LE(stage.system.nowNs() - before, 100 * kMs) << "not at the end of the timeout";
}

TEST(Unplug, WaitingForItsReturnCostsNothing) {
  Stage stage("at 30 unplug");
  ASSERT_EQ(stage.take(29), 29);
  const std::uint64_t before = stage.system.polls;
  stage.next(100);
  const std::int64_t deadline = stage.system.nowNs() + 60 * kSecond;
  while (stage.system.nowNs() < deadline) stage.next(1000);
  EXPECT_LE(stage.system.polls - before, 400U) << "in a minute";
}

TEST(Replug, StreamsAgainWithinASecondOfTheReturn) {
  Stage stage("");
  ASSERT_EQ(stage.take(30), 30);
  for (const std::int64_t away_s : {0, 1, 3, 20, 300}) {
    stage.system.world().apply("unplug");
    stage.untilState(SourceState::no_signal);
    const std::int64_t deadline = stage.system.nowNs() + away_s * kSecond;
    while (stage.system.nowNs() < deadline) stage.next(100);
    stage.system.world().apply("replug");
    EXPECT_LE(stage.untilState(SourceState::streaming), 1.0) << "after " << away_s << " s";
    EXPECT_EQ(stage.source->info().location, "/dev/video0");
    EXPECT_EQ(stage.take(30), 30);
  }
  EXPECT_EQ(stage.counters().reconnects, 5U);
}

TEST(Replug, WithoutEventsItIsFoundByLookingWithinASecond) {
  Stage stage("");
  stage.system.watch_works = false;
  ASSERT_EQ(stage.take(30), 30);
  stage.system.world().apply("unplug");
  stage.untilState(SourceState::no_signal);
  for (int i = 0; i < 200; ++i) stage.next(100);
  stage.system.world().apply("replug as video5");
  EXPECT_LE(stage.untilState(SourceState::streaming), 1.0);
}

TEST(Replug, IsFoundUnderAnotherNumberThoughAnotherCameraTookItsOwn) {
  Stage stage(
      "camera Mine as video0 bus usb-1 by-id usb-Mine_77-video-index0\n"
      "camera Other as none bus usb-2 by-id usb-Other_12-video-index0\n");
  ASSERT_EQ(stage.take(5), 5);
  stage.system.world().apply("unplug", 0);
  stage.untilState(SourceState::no_signal);
  stage.system.world().apply("replug as video0", 1);
  EXPECT_EQ(stage.untilState(SourceState::streaming, 8), 1e9) << "the other camera is not it";
  stage.system.world().apply("replug as video3 bus usb-9", 0);  // another port, too
  EXPECT_LE(stage.untilState(SourceState::streaming), 1.0);
  EXPECT_EQ(stage.source->info().location, "/dev/video3");
  EXPECT_EQ(stage.source->info().name, "Mine");
}

TEST(Replug, OfTwoOfTheSameMakeTheOneInTheSamePort) {
  Stage stage(
      "camera Twin as video0 bus usb-1\n"
      "camera Twin as video2 bus usb-2\n",
      [] {
        CameraOptions options;
        options.camera = "/dev/video2";
        return options;
      }());
  ASSERT_EQ(stage.take(5), 5);
  stage.system.world().apply("unplug", 1);
  stage.untilState(SourceState::no_signal);
  stage.system.world().apply("unplug", 0);
  stage.system.world().apply("replug as video2", 0);
  stage.system.world().apply("replug as video0", 1);
  EXPECT_LE(stage.untilState(SourceState::streaming), 1.0);
  EXPECT_EQ(stage.source->info().location, "/dev/video0");
}

TEST(Replug, WaitsForThePermissionThatTheSystemGivesAMomentLater) {
  Stage stage("");
  ASSERT_EQ(stage.take(5), 5);
  stage.system.world().apply("unplug");
  stage.untilState(SourceState::no_signal);
  stage.system.world().apply("open EACCES");
  stage.system.world().apply("replug as video0");
  stage.next(200);
  EXPECT_TRUE(says(stage.source->notice(), {"permission"}));
  stage.system.world().apply("chmod");
  EXPECT_LE(stage.untilState(SourceState::streaming), 0.2);
}

// Of this process, as the kernel counts them.
struct Resources {
  std::size_t files, maps, threads;
  bool operator==(const Resources&) const = default;
};

Resources resources() {
  const auto entries = [](const char* folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
  };
  std::ifstream maps("/proc/self/maps");
  std::size_t camera_maps = 0;
  for (std::string line; std::getline(maps, line);)
    camera_maps += line.find("fake camera") != std::string::npos ? 1 : 0;
  return {entries("/proc/self/fd"), camera_maps, entries("/proc/self/task")};
}

TEST(Replug, AThousandTimesLeavesFilesMappingsAndThreadsEqual) {
  Stage stage("formats YUYV 64x48@30");
  ASSERT_EQ(stage.take(3), 3);
  const std::size_t files = stage.system.world().openFiles(), maps = stage.system.world().liveMaps();
  const Resources before = resources();
  EXPECT_EQ(before.maps, 4U) << "four buffers";
  double worst_noticed_s = 0, worst_back_s = 0;
  for (int i = 0; i < 1000; ++i) {
    stage.system.world().apply("unplug");
    const double noticed_s = stage.untilState(SourceState::no_signal);
    ASSERT_LE(noticed_s, kPeriod + 0.050);
    stage.system.world().apply("replug as video" + std::to_string(i % 3));
    const double back_s = stage.untilState(SourceState::streaming);
    ASSERT_LE(back_s, 1.0) << "cycle " << i;
    worst_noticed_s = std::max(worst_noticed_s, noticed_s);
    worst_back_s = std::max(worst_back_s, back_s);
  }
  std::printf("unplug noticed after at most %.1f ms, pictures again after at most %.1f ms (virtual time)\n",
              1e3 * worst_noticed_s, 1e3 * worst_back_s);
  EXPECT_EQ(stage.system.world().openFiles(), files);
  EXPECT_EQ(stage.system.world().liveMaps(), maps);
  EXPECT_EQ(resources(), before);
  EXPECT_EQ(stage.counters().losses, 1000U);
  EXPECT_EQ(stage.counters().reconnects, 1000U);
}

TEST(Freeze, IsSaidWithinHalfASecondAndEndsWithinASecondOfItsEnd) {
  Stage stage("at 2s freeze 2500ms");
  ASSERT_EQ(stage.take(60), 60);
  const std::int64_t last = stage.image.t_capture_ns;
  stage.untilState(SourceState::stalled);
  EXPECT_LE(stage.system.nowNs() - last, 520 * kMs);
  EXPECT_TRUE(says(stage.source->notice(), {"sends nothing"}));
  stage.untilState(SourceState::streaming);
  EXPECT_LE(stage.system.nowNs() - last, 2500 * kMs + kSecond);
  EXPECT_EQ(stage.counters().stalls, 1U);
  EXPECT_EQ(stage.counters().restarts, 1U);
  EXPECT_EQ(stage.source->notice(), "");
}

TEST(Freeze, ThatOnlyARestartEndsIsRestarted) {
  Stage stage("at 30 freeze streamoff");
  ASSERT_EQ(stage.take(29), 29);
  EXPECT_LE(stage.untilPictures(31), 2.6);
  EXPECT_EQ(stage.counters().restarts, 1U);
  EXPECT_EQ(stage.counters().losses, 0U);
}

TEST(Freeze, ThatOnlyOpeningEndsIsReopenedAfterThreeRestarts) {
  Stage stage("at 30 freeze reopen");
  ASSERT_EQ(stage.take(29), 29);
  EXPECT_LE(stage.untilPictures(31), 9.0);
  EXPECT_EQ(stage.counters().restarts, 3U);
  EXPECT_EQ(stage.counters().losses, 1U);
  EXPECT_EQ(stage.counters().reconnects, 1U);
}

TEST(Freeze, ASlowCameraIsNotAFrozenOne) {
  Stage stage("formats YUYV 64x48@1");
  EXPECT_EQ(stage.take(20), 20);
  EXPECT_EQ(stage.counters().stalls, 0U);
  EXPECT_EQ(stage.counters().restarts, 0U);
}

TEST(QueueError, OnceIsARestartOfAFewPictures) {
  Stage stage("at 30 dqbuf EIO 1");
  ASSERT_EQ(stage.take(29), 29);
  EXPECT_LE(stage.untilPictures(31), 0.2);
  EXPECT_EQ(stage.counters().restarts, 1U);
}

TEST(QueueError, FatalUntilTheStreamIsStoppedIsOvercome) {
  Stage stage("at 30 fatal");
  ASSERT_EQ(stage.take(29), 29);
  EXPECT_LE(stage.untilPictures(31), 1.0);
  EXPECT_EQ(stage.counters().restarts, 1U);
  EXPECT_EQ(stage.source->state(), SourceState::streaming);
}

TEST(QueueError, ForEverEndsInPatientRetriesAndNotInACircle) {
  Stage stage("at 30 dqbuf EIO forever");
  ASSERT_EQ(stage.take(29), 29);
  stage.untilState(SourceState::no_signal);
  const std::uint64_t polls = stage.system.polls;
  const SourceCounters before = stage.counters();
  const std::int64_t deadline = stage.system.nowNs() + 60 * kSecond;
  while (stage.system.nowNs() < deadline) stage.next(1000);
  EXPECT_LE(stage.system.polls - polls, 600U);
  EXPECT_LE(stage.counters().restarts - before.restarts, 80U);
  stage.system.world().apply("ok");
  EXPECT_LE(stage.untilState(SourceState::streaming), 6.0);
}

TEST(QueueError, ABufferThatDoesNotExistIsNotRead) {
  Stage stage("at 30 dqbuf index 77 1");
  ASSERT_EQ(stage.take(29), 29);
  EXPECT_LE(stage.untilPictures(32), 1.0);
  EXPECT_EQ(stage.counters().restarts, 1U);
}

TEST(QueueError, ARefusedBufferRestartsTheStream) {
  Stage stage("at 30 qbuf EIO 1");
  ASSERT_EQ(stage.take(29), 29);
  EXPECT_LE(stage.untilPictures(35), 1.0);
  EXPECT_GE(stage.counters().restarts, 1U);
}

class WrongLength : public testing::TestWithParam<const char*> {};

TEST_P(WrongLength, IsCountedAndNotShown) {
  Stage stage(std::string("at 30 bytesused ") + GetParam() + " 5");
  ASSERT_EQ(stage.take(100), 100);
  EXPECT_EQ(stage.counters().corrupt, 5U);
  EXPECT_EQ(stage.counters().restarts, 0U);
}
INSTANTIATE_TEST_SUITE_P(All, WrongLength, testing::Values("0", "short", "length+1"));

TEST(DamagedPictures, OneInTwentyIsLeftOutExactly) {
  Stage stage("formats YUYV 64x48@30\nflag_error p=0.05");
  ASSERT_EQ(stage.take(950), 950);
  const SourceCounters& counters = stage.counters();
  EXPECT_GT(counters.corrupt, 20U);
  EXPECT_EQ(counters.captured + counters.corrupt + counters.dropped, stage.camera().pictures_made);
  EXPECT_EQ(counters.restarts, 0U);
}

TEST(DamagedPictures, NothingElseIsARestartThenNoSignalAndLittleWork) {
  Stage stage("formats MJPG 640x480@30\nat 30 mjpg garbage");
  ASSERT_EQ(stage.take(29), 29);
  EXPECT_LE(stage.untilState(SourceState::no_signal), 1.2) << "thirty pictures";
  EXPECT_TRUE(says(stage.source->notice(), {"broken pictures"}));
  const std::uint64_t before = stage.counters().corrupt;
  const std::int64_t deadline = stage.system.nowNs() + 60 * kSecond;
  while (stage.system.nowNs() < deadline) stage.next(1000);
  EXPECT_LE(stage.counters().corrupt - before, 1800U * 9 / 10);
  stage.system.world().apply("ok");
  EXPECT_LE(stage.untilState(SourceState::streaming), 6.5);
}

TEST(DamagedPictures, OnePercentOfBrokenJpegCostsOnePercentOfThePictures) {
  Stage stage("formats MJPG 64x48@30\nmjpg truncate p=0.01");
  ASSERT_EQ(stage.take(1000), 1000);
  EXPECT_EQ(stage.counters().captured + stage.counters().corrupt, stage.camera().pictures_made);
  EXPECT_LE(stage.counters().corrupt, 20U);
  EXPECT_GE(stage.counters().corrupt, 3U);
  EXPECT_EQ(stage.counters().restarts, 0U);
}

TEST(LostPictures, AreCountedFromTheSequenceNumbers) {
  Stage stage("formats YUYV 64x48@30\ndrop p=0.3");
  ASSERT_EQ(stage.take(700), 700);
  const std::uint64_t after_last = stage.camera().pictures_made - 1 - stage.image.capture_seq;
  EXPECT_EQ(stage.counters().sequence_gaps, stage.camera().pictures_lost - after_last);
  EXPECT_EQ(stage.image.capture_seq + 1, stage.counters().captured + stage.counters().sequence_gaps);
  EXPECT_EQ(stage.source->notice(), "") << "lost is not slow";
}

TEST(LostPictures, TheSequenceNumberMayWrapOrStandStill) {
  Stage wrap("at 30 seq wrap");
  ASSERT_EQ(wrap.take(29), 29);
  ASSERT_EQ(wrap.take(1), 1);
  const std::uint64_t at_jump = wrap.counters().sequence_gaps;
  ASSERT_EQ(wrap.take(60), 60);
  EXPECT_EQ(wrap.counters().sequence_gaps, at_jump) << "from 0xffffffff to 0 is one step";
  EXPECT_LE(at_jump, 1U);
  Stage stuck("seq stuck");
  ASSERT_EQ(stuck.take(30), 30);
  EXPECT_EQ(stuck.counters().sequence_gaps, 0U);
  EXPECT_EQ(stuck.image.capture_seq, 29U);
}

class LyingClock : public testing::TestWithParam<const char*> {};

TEST_P(LyingClock, IsReplacedByTheTimeOfArrivalAndCounted) {
  Stage stage(std::string("at 30 ts ") + GetParam());
  std::int64_t last = 0;
  for (int i = 0; i < 90; ++i) {
    ASSERT_EQ(stage.take(1), 1);
    ASSERT_GT(stage.image.t_capture_ns, last);
    if (last != 0) {
      EXPECT_NEAR(static_cast<double>(stage.image.t_capture_ns - last) * 1e-6, 1000.0 / 30, 4.0) << "picture " << i;
    }
    last = stage.image.t_capture_ns;
  }
  EXPECT_GE(stage.counters().bad_timestamps, 55U);
}
INSTANTIATE_TEST_SUITE_P(All, LyingClock, testing::Values("+3600s", "-1s", "0", "realtime", "stuck", "-50s"));

TEST(Clock, TwoLiesAreForgiven) {
  Stage stage("at 30 ts +3600s 2");
  ASSERT_EQ(stage.take(300), 300);
  EXPECT_EQ(stage.counters().bad_timestamps, 2U);
}

TEST(Rate, HalfOfWhatWasAgreedIsSaidWithinThreeSecondsWithWhatToDo) {
  Stage stage("at 10s fps 15\nat 30s fps 30");
  stage.until([&] { return stage.seconds() > 10; });
  EXPECT_EQ(stage.source->notice(), "");
  EXPECT_LE(stage.until([&] { return !stage.source->notice().empty(); }), 3.0);
  EXPECT_TRUE(says(stage.source->notice(), {"of 30.0 fps", "exposure_dynamic_framerate=0"}));
  stage.until([&] { return stage.seconds() > 20; });
  EXPECT_NEAR(stage.source->info().delivered_hz, 15.0, 0.1);
  stage.until([&] { return stage.seconds() > 30.1; });
  EXPECT_LE(stage.until([&] { return stage.source->notice().empty(); }), 3.0);
  EXPECT_EQ(stage.counters().stalls, 0U);
}

TEST(SpuriousWakeups, DoNotMakeItRunInCircles) {
  Stage stage("at 30 pollin spurious forever\nat 30 freeze 1s");
  ASSERT_EQ(stage.take(29), 29);
  const std::uint64_t before = stage.system.polls;
  stage.untilState(SourceState::stalled);
  EXPECT_LE(stage.system.polls - before, 1200U);
}

TEST(Busy, WhileItWasAwayIsWaitedOutAndTheHolderNamed) {
  Stage stage("");
  ASSERT_EQ(stage.take(5), 5);
  stage.system.world().apply("unplug");
  stage.untilState(SourceState::no_signal);
  stage.system.holder = "pid 99 (other)";
  stage.system.world().apply("busy");
  stage.system.world().apply("replug as video0");
  stage.next(500);
  EXPECT_TRUE(says(stage.source->notice(), {"pid 99 (other)"}));
  stage.system.world().apply("free");
  EXPECT_LE(stage.untilState(SourceState::streaming), 6.0);
}

// Anything may happen at any time: nothing is left open, nothing hangs, and when all is well again pictures come.
TEST(RandomTrouble, IsSurvivedFiveHundredTimes) {
  std::uint32_t seed = 1;
  const auto random = [&seed](std::size_t below) {
    seed = seed * 1664525U + 1013904223U;
    return (seed >> 8) % below;
  };
  for (int round = 0; round < 500; ++round) {
    std::string script = random(2) == 0 ? "formats YUYV 64x48@30\n" : "formats MJPG 64x48@30\n";
    const std::size_t faults = 1 + random(6);
    for (std::size_t i = 0; i < faults; ++i)
      script += "at " + std::to_string(random(200)) + " " +
                std::string(fake::kTroubles[random(fake::kTroubles.size())]) + "\n";
    Stage stage(script);
    const std::int64_t deadline = stage.system.nowNs() + 12 * kSecond;
    while (stage.system.nowNs() < deadline) {
      const std::int64_t before = stage.system.nowNs();
      stage.next(200);
      ASSERT_LE(stage.system.nowNs() - before, 2 * kSecond) << script;
    }
    ASSERT_LE(stage.system.polls, 20'000U) << script;
    stage.system.world().endScript();
    stage.system.world().apply("ok");
    if (stage.camera().spec.number < 0) stage.system.world().apply("replug as video0");
    ASSERT_LE(stage.untilState(SourceState::streaming, 20), 15.0) << script;
    ASSERT_EQ(stage.take(10), 10) << script;
    stage.source.reset();
    ASSERT_EQ(stage.system.world().openFiles(), 0U) << script;
    ASSERT_EQ(stage.system.world().liveMaps(), 0U) << script;
  }
}

}  // namespace
}  // namespace volto::capture
