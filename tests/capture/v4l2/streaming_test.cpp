// What a healthy camera gives.
#include <gtest/gtest.h>

#include "tests/capture/v4l2/camera_stage.h"
#include "tests/retarget/allocation_counter.h"

namespace volto::capture {
namespace {

TEST(CameraStream, SaysWhatWasAgreed) {
  Stage stage("camera \"Desk Camera\"");
  ASSERT_EQ(stage.take(3), 3);
  const SourceInfo& info = stage.source->info();
  EXPECT_EQ(info.name, "Desk Camera");
  EXPECT_EQ(info.location, "/dev/video0");
  EXPECT_EQ(info.format, "YUYV");
  EXPECT_EQ(info.width, 640);
  EXPECT_EQ(info.height, 480);
  EXPECT_DOUBLE_EQ(info.rate_hz, 30.0);
  EXPECT_EQ(stage.source->state(), SourceState::streaming);
  EXPECT_EQ(stage.source->notice(), "");
}

class CameraFormat : public testing::TestWithParam<const char*> {};

TEST_P(CameraFormat, ShowsTheTrueColours) {
  const std::string name = GetParam();
  Stage stage("formats " + name + " 320x240@30");
  ASSERT_EQ(stage.take(2), 2);
  EXPECT_EQ(stage.source->info().format, name);
  ASSERT_EQ(stage.image.bgr.size(), 3U * 320 * 240);
  // Within what 8-bit luminance and colour can say; JPEG rounds once more.
  EXPECT_LE(colourError(stage.image), name == "MJPG" ? 4 : 2);
}
INSTANTIATE_TEST_SUITE_P(All, CameraFormat, testing::Values("YUYV", "NV12", "MJPG"));

TEST(CameraStream, GreyIsTheSameInAllThreeChannels) {
  Stage stage("formats GREY 320x240@30");
  ASSERT_EQ(stage.take(1), 1);
  for (std::size_t i = 0; i < stage.image.bgr.size(); i += 3) {
    ASSERT_EQ(stage.image.bgr[i], stage.image.bgr[i + 1]);
    ASSERT_EQ(stage.image.bgr[i], stage.image.bgr[i + 2]);
  }
}

TEST(CameraStream, MjpgWhenTheRawFormatIsTooSlow) {
  CameraOptions options;
  options.width = 1280;
  options.height = 720;
  Stage stage("", options);
  EXPECT_EQ(stage.source->info().format, "MJPG");
  EXPECT_DOUBLE_EQ(stage.source->info().rate_hz, 30.0);
}

TEST(CameraStream, AnswersWithTheNearestSizeAndRate) {
  CameraOptions options;
  options.width = 600;
  options.height = 400;
  options.rate_hz = 20;
  Stage stage("", options);
  EXPECT_EQ(stage.source->info().width, 640);
  EXPECT_DOUBLE_EQ(stage.source->info().rate_hz, 15.0);
}

TEST(CameraStream, TellsTheTruthWhenTheDriverAdjustsAndSaysYes) {
  Stage stage("s_fmt adjust 320x180\ns_parm adjust 1/15");
  ASSERT_EQ(stage.take(2), 2);
  EXPECT_EQ(stage.source->info().width, 320);
  EXPECT_EQ(stage.source->info().height, 180);
  EXPECT_EQ(stage.image.height, 180);
  EXPECT_DOUBLE_EQ(stage.source->info().rate_hz, 15.0);
}

TEST(CameraStream, TimesAreTheDriversAndRise) {
  Stage stage("");
  std::int64_t last = 0;
  for (int i = 0; i < 60; ++i) {
    ASSERT_EQ(stage.take(1), 1);
    EXPECT_GT(stage.image.t_capture_ns, last);
    if (i > 0) {
      EXPECT_NEAR(static_cast<double>(stage.image.t_capture_ns - last), 1e9 / 30, 1e4);
    }
    last = stage.image.t_capture_ns;
    EXPECT_EQ(stage.image.capture_seq, static_cast<std::uint64_t>(i));
  }
  EXPECT_EQ(stage.counters().bad_timestamps, 0U);
  EXPECT_NEAR(stage.source->info().delivered_hz, 30.0, 0.1);
}

TEST(CameraStream, TheNewestPictureWinsAndThoseBeforeItAreCounted) {
  Stage stage("");
  ASSERT_EQ(stage.take(10), 10);
  stage.system.sleep(100 * kMs);  // three pictures' time
  ASSERT_EQ(stage.next(0), Next::frame);
  // The corner tells the picture's number (its brightness as BT.601 spreads it).
  const int corner = static_cast<int>(stage.image.bgr[0]);
  const auto number = static_cast<std::uint64_t>(corner * 219 / 255);
  EXPECT_NEAR(static_cast<double>(number), static_cast<double>(stage.camera().pictures_made), 1.0);
  EXPECT_EQ(stage.counters().dropped, 2U);
  EXPECT_EQ(stage.image.capture_seq, 12U);
  EXPECT_LE(stage.system.nowNs() - stage.image.t_capture_ns, 34 * kMs);
}

TEST(CameraStream, AStarvedQueueLosesPicturesAndEveryOneIsCounted) {
  Stage stage("");
  ASSERT_EQ(stage.take(10), 10);
  for (int i = 0; i < 5; ++i) {
    stage.system.sleep(700 * kMs);  // the driver's four buffers are full long before
    ASSERT_EQ(stage.next(0), Next::frame);
  }
  ASSERT_EQ(stage.take(1), 1);
  const SourceCounters& counters = stage.counters();
  EXPECT_EQ(counters.captured + counters.dropped + counters.sequence_gaps, stage.camera().pictures_made);
  EXPECT_EQ(counters.sequence_gaps, stage.camera().pictures_lost);
  EXPECT_GT(counters.sequence_gaps, 50U);
  EXPECT_EQ(counters.stalls, 0U) << "it was us who did not look";
}

TEST(CameraStream, ATimeoutOfNothingOnlyLooks) {
  Stage stage("");
  const std::int64_t before = stage.system.nowNs();
  EXPECT_EQ(stage.next(0), Next::nothing);
  EXPECT_LT(stage.system.nowNs() - before, kMs);
}

TEST(CameraStream, WaitingTakesOneLookAndOneSleepAPicture) {
  Stage stage("");
  ASSERT_EQ(stage.take(10), 10);
  const std::uint64_t before = stage.system.polls;
  ASSERT_EQ(stage.take(300), 300);
  EXPECT_LE(stage.system.polls - before, 310U);
}

// Passes everything on and knows how much of the allocations were the fake camera's own.
class CountingSystem final : public v4l2::System {
 public:
  explicit CountingSystem(v4l2::System& inner) : inner_(inner) {}
  std::size_t own = 0;

  int open(const char* path) override {
    return counted([&] { return inner_.open(path); });
  }
  void close(int fd) override { inner_.close(fd); }
  int ioctl(int fd, unsigned long request, void* argument) override {
    return counted([&] { return inner_.ioctl(fd, request, argument); });
  }
  void* map(int fd, std::size_t length, std::int64_t offset) override { return inner_.map(fd, length, offset); }
  void unmap(void* address, std::size_t length) override { inner_.unmap(address, length); }
  int poll(pollfd* fds, std::size_t count, int timeout_ms) override {
    return counted([&] { return inner_.poll(fds, count, timeout_ms); });
  }
  std::int64_t nowNs() override { return inner_.nowNs(); }
  std::vector<v4l2::VideoNode> listNodes() override { return inner_.listNodes(); }
  int watch() override { return inner_.watch(); }
  void clearWatch() override { inner_.clearWatch(); }
  std::string holderOf(const std::string& path) override { return inner_.holderOf(path); }
  std::string groupOf(const std::string& path) override { return inner_.groupOf(path); }

 private:
  template <class F>
  int counted(F call) {
    const std::size_t before = test::allocationCount();
    const int result = call();
    own += test::allocationCount() - before;
    return result;
  }
  v4l2::System& inner_;
};

TEST(CameraStream, NoPictureAllocates) {
  for (const char* const format : {"YUYV", "MJPG"}) {
    fake::VirtualSystem fake(std::string("formats ") + format + " 320x240@30\nmjpg extraneous p=0.2\ndrop p=0.1");
    CountingSystem system(fake);
    const std::unique_ptr<ImageSource> source = openCamera({}, system);
    Image image;
    const auto take = [&](int pictures) {
      while (pictures > 0) pictures -= source->next(image, std::chrono::seconds(1)) == Next::frame ? 1 : 0;
    };
    take(100);
    const std::size_t before = test::allocationCount() - system.own;
    take(500);
    EXPECT_EQ(test::allocationCount() - system.own - before, 0U) << format;
  }
}

}  // namespace
}  // namespace volto::capture
