// The threads of a live pipeline, fed by datagrams (no model needed) and by a video (public test material).
#include "tools/pipeline/live.h"

#include <arpa/inet.h>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <mutex>
#include <netinet/in.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

#include "capture/detection/model_manifest.h"
#include "capture/face_choice.h"
#include "capture/video/video_source.h"
#include "protocol/subscriber.h"
#include "protocol/take_reader.h"
#include "tests/retarget/synthetic_rig.h"
#include "tests/support/test_data.h"
#include "tests/tools/synthetic_performance.h"
#include "tools/pipeline/character.h"

namespace volto::pipeline {
namespace {

using namespace std::chrono_literals;

// An OpenSeeFace record of a frame with iBUG's points.
std::vector<std::byte> record(const LandmarkFrame& frame) {
  std::vector<std::byte> out(capture::kOpenSeeFaceRecordBytes);
  const auto put = [&](std::size_t offset, auto value) { std::memcpy(out.data() + offset, &value, sizeof value); };
  put(0, static_cast<double>(frame.t_capture_ns) * 1e-9);
  put(12, 640.0F), put(16, 480.0F), put(20, 1.0F), put(24, 1.0F);
  for (std::size_t i = 0; i < 66; ++i) {
    const std::size_t ibug = i < 48    ? i
                             : i < 53  ? i + 1
                             : i < 58  ? i + 2
                             : i == 58 ? 48
                             : i < 62  ? i + 2
                             : i == 62 ? 54
                                       : i + 2;
    put(73 + 4 * i, 0.9F);
    put(345 + 8 * i, frame.points_px[ibug][0]);
    put(349 + 8 * i, frame.points_px[ibug][1]);
  }
  return out;
}

class LiveTest : public ::testing::Test {
 protected:
  LiveTest() : publisher(options(dir)) {}

  static protocol::PublisherOptions options(const test::TemporaryDir& dir) {
    protocol::PublisherOptions out;
    out.endpoint = "ipc://" + (dir / "live").string();
    return out;
  }
  // Remembers what went out.
  LiveOptions watched() {
    LiveOptions out;
    out.look = [this](const LiveFrame& frame) {
      const std::lock_guard lock(mutex);
      masks.push_back(frame.mask);
    };
    return out;
  }
  std::size_t seen() {
    const std::lock_guard lock(mutex);
    return masks.size();
  }

  test::TemporaryDir dir;
  protocol::Publisher publisher;
  rig::Rig rig = test::syntheticRig();
  std::mutex mutex;
  std::vector<MaskFrame> masks;
};

class LiveDatagrams : public LiveTest {
 protected:
  LiveDatagrams() : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    input.name = "udp://test";
    input.datagrams = std::make_unique<capture::LandmarkDatagrams>(
        capture::DatagramOptions{.host = "127.0.0.1", .port = 0, .choice = {}});
    port_ = input.datagrams->port();
  }
  ~LiveDatagrams() override { ::close(socket_); }

  void send(const std::vector<std::byte>& bytes) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port_);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
  }
  // A performance in real time.
  void perform(std::size_t frames) {
    for (const LandmarkFrame& frame : test::syntheticPerformance({.frames = frames, .rate = 50, .with_3d = false})) {
      send(record(frame));
      std::this_thread::sleep_for(20ms);
    }
  }

  LiveInput input;

 private:
  int socket_;
  std::uint16_t port_ = 0;
};

TEST_F(LiveDatagrams, ReachTheAvatarAndSilenceLeadsBackToNeutral) {
  Live live(rig, std::move(input), publisher, watched());
  live.start();
  perform(30);
  std::this_thread::sleep_for(1200ms);  // nobody sends: held, eased, gone
  live.stop();
  const LiveReport report = live.report();
  EXPECT_GE(report.datagrams.frames, 20U);
  EXPECT_EQ(report.faces, report.datagrams.frames - report.stages[1].dropped);
  ASSERT_FALSE(masks.empty());
  EXPECT_EQ(masks[masks.size() / 4].state, TrackingState::tracking);
  EXPECT_EQ(masks.back().state, TrackingState::no_face);
  for (const float weight : masks.back().arkit_weights) EXPECT_EQ(weight, 0);
  EXPECT_TRUE(live.neutral().has_value());
}

TEST_F(LiveDatagrams, ACalibrationTakesTheNextSecondAsRest) {
  LiveOptions options = watched();
  options.calibration_s = 0.2;
  Live live(rig, std::move(input), publisher, options);
  live.start();
  live.recalibrate();
  perform(30);
  live.stop();
  EXPECT_EQ(live.report().calibrations, 1U);
}

TEST_F(LiveDatagrams, TheMeshIsDeformedOnlyForThoseWhoAskForIt) {
  publisher.setCharacter(characterOf(rig, true));
  LiveOptions options;
  options.mesh_on_demand = true;
  std::atomic<std::size_t> without{0}, with{0};
  options.look = [&](const LiveFrame& frame) { ++(frame.avatar.vertices.empty() ? without : with); };
  Live live(rig, std::move(input), publisher, options);
  live.start();
  perform(10);
  EXPECT_EQ(with, 0U);
  EXPECT_GT(without, 0U);
  protocol::SubscriberOptions asking;
  asking.endpoint = publisher.endpoint();
  asking.topics = {"mesh/"};
  protocol::Subscriber subscriber(asking);
  ASSERT_TRUE(publisher.waitForSubscriber(protocol::MessageKind::mesh, 3000));
  perform(10);
  protocol::ReceivedMessage message;
  EXPECT_TRUE(subscriber.receive(message, 1000));
  live.stop();
  EXPECT_GT(with, 0U);
}

TEST_F(LiveDatagrams, StoppingTakesLessThanASecondWithAndWithoutInput) {
  Live live(rig, std::move(input), publisher, watched());
  live.start();
  std::this_thread::sleep_for(30ms);
  const auto before = std::chrono::steady_clock::now();
  live.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - before, 1s);
  EXPECT_NO_THROW(live.stop()) << "again";
}

class LiveVideo : public LiveTest {
 protected:
  LiveInput open(const std::filesystem::path& data, const capture::VideoOptions& options = {},
                 const char* video = "head-pose-face-detection-male.gif", const char* face = "front") {
    LiveInput input;
    input.name = "video";
    input.live = false;
    const std::vector<std::filesystem::path> folders = {data / "models"};
    const auto faces = capture::findModel(capture::ModelManifest::Task::faces, "yunet", folders);
    const auto points = capture::findModel(capture::ModelManifest::Task::landmarks, "pfld_68", folders);
    input.finder.emplace(
        capture::FaceDetector(faces.manifest, capture::readModelBytes(faces, false), faces.path.string()),
        capture::LandmarkModel(points.manifest, capture::readModelBytes(points, false), points.path.string()),
        capture::FaceFinderOptions{.choice = capture::parseFaceChoice(face)});
    input.images = capture::openVideo(data / "video" / video, options);
    return input;
  }
  std::vector<LandmarkFrame> record(const std::filesystem::path& data, const std::string& name) {
    {
      protocol::TakeHeader header;
      header.name = name;
      protocol::TakeWriter take((dir / name).string(), header);
      LiveOptions options;
      options.every_frame = true;
      Live live(rig, open(data), publisher, options, &take);
      live.start();
      while (!live.waitForEnd(100ms)) {
      }
      live.stop();
      EXPECT_TRUE(take.finish().ok());
    }
    protocol::TakeReader reader((dir / name).string());
    protocol::LandmarkMessage message;
    std::vector<LandmarkFrame> out;
    while (reader.next(message)) out.push_back(message.frame);
    return out;
  }
};

TEST_F(LiveVideo, EveryFrameIsTrackedInOrderAndTwiceTheSame) {
  VOLTO_REQUIRE_DATA(data);
  const std::vector<LandmarkFrame> first = record(data, "a.take"), second = record(data, "b.take");
  ASSERT_EQ(first.size(), 62U);
  ASSERT_EQ(second.size(), first.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].capture_seq, i + 1);
    EXPECT_TRUE(first[i].face_present);
    EXPECT_EQ(first[i].t_capture_ns, second[i].t_capture_ns) << "the file's own times";
    EXPECT_EQ(first[i].points_px, second[i].points_px) << "frame " << i;
  }
}

// One laughs from the first picture on, two lean their heads far over.
TEST_F(LiveVideo, BothGifsAreTrackedInEveryFrameAndNoHeadJumps) {
  VOLTO_REQUIRE_DATA(data);
  struct Case {
    const char *video, *face;
    double farthest_roll_deg;
  };
  for (const Case& one : {Case{"head-pose-face-detection-male.gif", "front", 0},
                          Case{"head-pose-face-detection-female-and-male.gif", "1", 40},
                          Case{"head-pose-face-detection-female-and-male.gif", "2", 35}}) {
    masks.clear();
    LiveOptions options = watched();
    options.every_frame = true;
    options.tracking.tracker.from_pixels = true;
    Live live(rig, open(data, {}, one.video, one.face), publisher, options);
    live.start();
    while (!live.waitForEnd(100ms)) {
    }
    live.stop();
    EXPECT_EQ(live.report().faces, live.report().frames_sent) << one.video << " " << one.face;
    ASSERT_FALSE(masks.empty());
    double farthest = 0;
    for (std::size_t i = 0; i < masks.size(); ++i) {
      EXPECT_EQ(masks[i].state, TrackingState::tracking) << one.video << " " << one.face << " frame " << i;
      farthest = std::max(farthest, std::abs(masks[i].head.roll_rad) * 57.2958);
      if (i == 0) continue;
      const HeadPose &a = masks[i - 1].head, &b = masks[i].head;
      for (const float step_rad : {b.yaw_rad - a.yaw_rad, b.pitch_rad - a.pitch_rad, b.roll_rad - a.roll_rad})
        EXPECT_LT(std::abs(step_rad) * 57.2958, 8) << one.video << " " << one.face << " frame " << i;
    }
    EXPECT_GT(farthest, one.farthest_roll_deg) << one.video << " " << one.face;
  }
}

TEST_F(LiveVideo, IsStoppedInTheMiddle) {
  VOLTO_REQUIRE_DATA(data);
  Live live(rig, open(data, {.loop = true}), publisher, watched());
  live.start();
  while (seen() < 3) std::this_thread::sleep_for(5ms);
  const auto before = std::chrono::steady_clock::now();
  live.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - before, 1s);
}

}  // namespace
}  // namespace volto::pipeline
