#include "tools/pipeline/replay.h"

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "protocol/subscriber.h"
#include "tests/retarget/synthetic_rig.h"
#include "tests/support/test_data.h"
#include "tests/tools/synthetic_performance.h"
#include "tools/pipeline/character.h"
#include "tools/pipeline/pacer.h"

namespace volto::pipeline {
namespace {

// A publisher and one subscriber to everything in the same process, joined before the first frame.
class ReplayTest : public testing::Test {
 protected:
  ReplayTest() : rig_(test::syntheticRig({.skin_side = 12})) {
    performance_.source = "synthetic";
    performance_.landmarks = test::syntheticPerformance({.frames = 30});
    protocol::PublisherOptions options;
    options.endpoint = "ipc://" + (folder_ / "replay").string();
    options.source = "synthetic";
    options.when_full = protocol::WhenFull::lossless;
    publisher_ = std::make_unique<protocol::Publisher>(options);
    publisher_->setCharacter(characterOf(rig_));
    receiver_ = std::thread([this, endpoint = options.endpoint] { receive(endpoint); });
    for (const auto kind :
         {protocol::MessageKind::weights, protocol::MessageKind::mesh, protocol::MessageKind::landmarks}) {
      if (!publisher_->waitForSubscriber(kind, 5000)) ADD_FAILURE() << "nobody subscribed";
    }
  }

  ~ReplayTest() override { join(); }

  void join() {
    done_ = true;
    if (receiver_.joinable()) receiver_.join();
  }

  ReplayResult run(
      const ReplayOptions& options, std::function<bool()> stop = [] { return false; }) {
    FramePath path(rig_, {});
    ReplayResult result = replay(performance_, path, *publisher_, options, stop);
    publisher_->flush();
    join();
    return result;
  }

  void receive(const std::string& endpoint) {
    protocol::SubscriberOptions options;
    options.endpoint = endpoint;
    options.receive_high_water_mark = 1000;
    protocol::Subscriber subscriber(options);
    protocol::ReceivedMessage message;
    for (;;) {
      const bool ending = done_;
      if (!subscriber.receive(message, 300)) {
        if (ending) return;
        continue;
      }
      ++count_[static_cast<std::size_t>(message.kind)];
      if (message.kind == protocol::MessageKind::weights) {
        capture_times_.push_back(message.stamp.t_capture_ns);
        capture_seqs_.push_back(message.stamp.capture_seq);
        publish_times_.push_back(message.stamp.t_publish_ns);
      }
    }
  }

  std::uint64_t received(protocol::MessageKind kind) const { return count_[static_cast<std::size_t>(kind)]; }

  test::TemporaryDir folder_;
  rig::Rig rig_;
  Performance performance_;
  std::unique_ptr<protocol::Publisher> publisher_;
  std::thread receiver_;
  std::atomic<bool> done_{false};
  std::array<std::uint64_t, protocol::kMessageKindCount> count_{};
  std::vector<std::int64_t> capture_times_, publish_times_;
  std::vector<std::uint64_t> capture_seqs_;
};

TEST_F(ReplayTest, EveryFrameReachesTheSubscriberAtItsTime) {
  const ReplayResult result = run({});
  EXPECT_EQ(result.frames, 30U);
  EXPECT_EQ(result.dropped, 0U);
  EXPECT_EQ(received(protocol::MessageKind::weights), 30U);
  EXPECT_EQ(received(protocol::MessageKind::mesh), 30U);
  EXPECT_EQ(received(protocol::MessageKind::mask), 30U);
  EXPECT_EQ(received(protocol::MessageKind::landmarks), 30U);
  EXPECT_GE(received(protocol::MessageKind::character), 1U);
  ASSERT_EQ(capture_times_.size(), 30U);
  for (std::size_t i = 1; i < 30; ++i) {
    EXPECT_EQ(capture_times_[i] - capture_times_[i - 1], performance_.time(i) - performance_.time(i - 1)) << i;
    EXPECT_GE(publish_times_[i], capture_times_[i]);
  }
  EXPECT_GE(result.seconds, 0.9 * 29.0 / 60);
}

TEST_F(ReplayTest, AsFastAsCanBeStillSendsEveryFrame) {
  const ReplayResult result = run({.speed = 0});
  EXPECT_EQ(result.frames, 30U);
  EXPECT_EQ(result.sent.count(), 30U);
  EXPECT_EQ(received(protocol::MessageKind::weights), 30U);
  EXPECT_EQ(received(protocol::MessageKind::mesh), 30U);
}

TEST_F(ReplayTest, LoopGoesOnCountingUntilItIsStopped) {
  std::uint64_t asked = 0;
  const ReplayResult result = run({.speed = 0, .loop = true}, [&] { return ++asked > 200; });
  EXPECT_TRUE(result.stopped);
  EXPECT_GT(result.frames, 60U);
  ASSERT_EQ(capture_seqs_.size(), result.frames);
  for (std::size_t i = 1; i < capture_seqs_.size(); ++i) {
    ASSERT_EQ(capture_seqs_[i], capture_seqs_[i - 1] + 1) << "no gap where the take begins again";
    ASSERT_GT(capture_times_[i], capture_times_[i - 1]);
  }
}

TEST_F(ReplayTest, StopBeforeTheFirstFrameSendsNone) {
  const ReplayResult result = run({}, [] { return true; });
  EXPECT_TRUE(result.stopped);
  EXPECT_EQ(result.frames, 0U);
  EXPECT_EQ(result.rate(), 0.0);
}

}  // namespace
}  // namespace volto::pipeline
