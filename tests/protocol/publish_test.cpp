// Publisher and Subscriber together, and each against peers that do not behave.
#include <algorithm>
#include <atomic>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <functional>
#include <map>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <zmq.h>

#include "protocol/clock.h"
#include "protocol/curve.h"
#include "protocol/publisher.h"
#include "protocol/subscriber.h"
#include "tests/protocol/samples.h"
#include "tests/support/test_data.h"

namespace volto::protocol {
namespace {

using test::sampleAvatar;
using test::sampleCharacter;
using test::sampleLandmarks;
using test::sampleMask;
using test::sampleStamp;

// A bare ZeroMQ socket, for peers that are not ours.
class RawSocket {
 public:
  explicit RawSocket(int type) : context_(zmq_ctx_new()), socket_(zmq_socket(context_, type)) {
    const int linger = 0, timeout = 2000;
    zmq_setsockopt(socket_, ZMQ_LINGER, &linger, sizeof(linger));
    zmq_setsockopt(socket_, ZMQ_RCVTIMEO, &timeout, sizeof(timeout));
  }
  ~RawSocket() {
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }
  RawSocket(const RawSocket&) = delete;
  RawSocket& operator=(const RawSocket&) = delete;
  void* get() const { return socket_; }
  void set(int option, int value) { zmq_setsockopt(socket_, option, &value, sizeof(value)); }
  bool connect(const std::string& address) { return zmq_connect(socket_, address.c_str()) == 0; }
  bool bind(const std::string& address) { return zmq_bind(socket_, address.c_str()) == 0; }
  void subscribe(std::string_view prefix) { zmq_setsockopt(socket_, ZMQ_SUBSCRIBE, prefix.data(), prefix.size()); }
  void send(std::string_view part, bool more = false) {
    zmq_send(socket_, part.data(), part.size(), more ? ZMQ_SNDMORE : 0);
  }
  // All parts of the next message; none on timeout.
  std::vector<std::string> receive() {
    std::vector<std::string> parts;
    int more = 1;
    while (more != 0) {
      zmq_msg_t message;
      zmq_msg_init(&message);
      if (zmq_msg_recv(&message, socket_, 0) < 0) return {};
      parts.emplace_back(static_cast<const char*>(zmq_msg_data(&message)), zmq_msg_size(&message));
      more = zmq_msg_more(&message);
      zmq_msg_close(&message);
    }
    return parts;
  }

 private:
  void* context_;
  void* socket_;
};

std::string_view textOf(Bytes bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

class PublishTest : public ::testing::Test {
 protected:
  PublisherOptions publisherAt(const std::string& name, WhenFull when_full = WhenFull::wait) {
    PublisherOptions options;
    options.endpoint = "ipc://" + (dir_ / name).string();
    options.source = "camera";
    options.when_full = when_full;
    return options;
  }

  static SubscriberOptions subscriberTo(const Publisher& publisher, std::vector<std::string> topics,
                                        int high_water_mark = 1000) {
    SubscriberOptions options;
    options.endpoint = publisher.endpoint();
    options.topics = std::move(topics);
    options.receive_high_water_mark = high_water_mark;
    return options;
  }

  // The next message of one kind; the others are passed over.
  static bool next(Subscriber& subscriber, MessageKind kind, ReceivedMessage& message, int timeout_ms = 3000) {
    const std::int64_t deadline = monotonicNs() + timeout_ms * 1'000'000LL;
    while (monotonicNs() < deadline) {
      if (subscriber.receive(message, 50) && message.kind == kind) return true;
    }
    return false;
  }

  static bool eventually(const std::function<bool()>& condition, int timeout_ms = 3000) {
    for (int waited = 0; waited < timeout_ms; waited += 5) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return condition();
  }

  ::volto::test::TemporaryDir dir_;
};

TEST_F(PublishTest, EveryFrameArrivesInOrderOverIpcAndTcp) {
  for (const bool tcp : {false, true}) {
    PublisherOptions options = publisherAt("a", WhenFull::lossless);
    if (tcp) options.endpoint = "tcp://127.0.0.1:0";
    Publisher publisher(options);
    const Character anna = sampleCharacter(100);
    publisher.setCharacter(anna);
    Subscriber subscriber(subscriberTo(publisher, {"weights/", "mesh/"}));
    ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::weights, 3000));
    ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::mesh, 3000));
    std::thread sender([&] {
      for (std::uint64_t n = 1; n <= 300; ++n) publisher.push(sampleAvatar(n, 100));
    });
    ReceivedMessage message;
    AvatarMessage avatar;
    std::map<MessageKind, std::uint64_t> count;
    while (count[MessageKind::weights] < 300 || count[MessageKind::mesh] < 300) {
      ASSERT_TRUE(subscriber.receive(message, 3000))
          << count[MessageKind::weights] << " weights, " << count[MessageKind::mesh] << " meshes";
      const std::uint64_t n = ++count[message.kind];
      EXPECT_EQ(message.stamp.seq, n);
      EXPECT_EQ(message.stamp.capture_seq, n);
      EXPECT_EQ(message.stamp.epoch, publisher.epoch());
      EXPECT_GT(message.stamp.t_publish_ns, 0);
      EXPECT_LE(message.stamp.t_publish_ns, message.t_receive_ns);
      EXPECT_NEAR(static_cast<double>(message.stamp.t_realtime_ns), static_cast<double>(realtimeNs()), 60e9);
      if (message.kind == MessageKind::mesh) {
        ASSERT_TRUE(decodeMesh(message.payload, avatar).ok());
        EXPECT_EQ(avatar.frame.vertices, sampleAvatar(n, 100).vertices);
      } else {
        ASSERT_TRUE(decodeWeights(message.payload, avatar).ok());
        EXPECT_EQ(avatar.character_id, characterId(anna));
        EXPECT_EQ(message.topic, "weights/anna/");
        EXPECT_EQ(message.name, "anna");
      }
    }
    sender.join();
    EXPECT_EQ(subscriber.counters().lost, 0U);
    EXPECT_EQ(subscriber.counters().invalid, 0U) << subscriber.lastProblem();
  }
}

TEST_F(PublishTest, LandmarksAndMasksAreStreamsOfTheSource) {
  Publisher publisher(publisherAt("a"));
  Subscriber subscriber(subscriberTo(publisher, {"landmarks/camera/", "mask/camera/"}));
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::landmarks, 3000));
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::mask, 3000));
  publisher.push(sampleLandmarks(3));
  publisher.push(sampleMask(3));
  ReceivedMessage message;
  ASSERT_TRUE(subscriber.receive(message, 3000));
  EXPECT_EQ(message.topic, "landmarks/camera/");
  ASSERT_TRUE(subscriber.receive(message, 3000));
  EXPECT_EQ(message.topic, "mask/camera/");
  MaskMessage mask;
  ASSERT_TRUE(decode(message.payload, mask).ok());
  EXPECT_EQ(mask.frame.displacement_fapu, sampleMask(3).displacement_fapu);
}

TEST_F(PublishTest, AFrameSentByItsCallerIsGoneWhenTheCallReturnsAndNewcomersAreStillNoticed) {
  Publisher publisher(publisherAt("a", WhenFull::newest_wins));
  publisher.setCharacter(sampleCharacter(50));
  Subscriber all(subscriberTo(publisher, {"landmarks/", "mask/", "weights/", "mesh/"}));
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::mesh, 3000));
  ASSERT_TRUE(eventually([&] { return publisher.wantsMesh() && publisher.wants(MessageKind::weights); }));
  ReceivedMessage message;
  for (int i = 1; i <= 50; ++i) {
    const std::uint64_t before = publisher.counters().sent;
    publisher.send(sampleLandmarks(3), sampleMask(3), sampleAvatar(i, 50));
    EXPECT_GE(publisher.counters().sent, before + 4);
    for (const MessageKind kind :
         {MessageKind::landmarks, MessageKind::mask, MessageKind::weights, MessageKind::mesh}) {
      ASSERT_TRUE(all.receive(message, 3000)) << i;
      EXPECT_EQ(message.kind, kind);
    }
  }
  EXPECT_EQ(publisher.counters().replaced, 0U);
  // Sending goes on all the time while others come and ask, and while another thread pushes.
  std::atomic<bool> stop{false};
  std::thread sender([&] {
    while (!stop) publisher.send(sampleLandmarks(3), sampleMask(3), sampleAvatar(1, 50));
  });
  std::thread pusher([&] {
    while (!stop) publisher.push(sampleMask(3));
  });
  for (int i = 0; i < 5; ++i) {
    Subscriber late(subscriberTo(publisher, {"character/", "status/"}));
    EXPECT_TRUE(next(late, MessageKind::character, message)) << i;
    EXPECT_TRUE(next(late, MessageKind::status, message)) << i;
  }
  stop = true;
  sender.join();
  pusher.join();
}

TEST_F(PublishTest, StatusComesTwiceASecondThoughNothingHappens) {
  Publisher publisher(publisherAt("a"));
  StatusReport report;
  report.state = PipelineState::no_signal;
  report.frames_in = 17;
  report.source = "camera:/dev/video7";
  publisher.setReport(report);
  Subscriber subscriber(subscriberTo(publisher, {"status/"}));
  ReceivedMessage message;
  StatusMessage status;
  ASSERT_TRUE(subscriber.receive(message, 1000)) << "silence";
  const std::int64_t first = message.stamp.t_publish_ns;
  ASSERT_TRUE(subscriber.receive(message, 1000));
  EXPECT_GT(message.stamp.t_publish_ns - first, 400'000'000);
  EXPECT_LE(message.stamp.t_publish_ns - first, 1'000'000'000) << "at least once a second";
  ASSERT_TRUE(decode(message.payload, status).ok());
  EXPECT_EQ(status.report.state, PipelineState::no_signal);
  EXPECT_EQ(status.report.frames_in, 17U);
  EXPECT_EQ(status.report.source, "camera:/dev/video7");
  EXPECT_EQ(status.report.clients, 1U);
  EXPECT_EQ(status.report.stages.back().name, "publish");
}

TEST_F(PublishTest, LastStatusSaysGoodbye) {
  auto publisher = std::make_unique<Publisher>(publisherAt("a"));
  Subscriber subscriber(subscriberTo(*publisher, {"status/"}));
  ReceivedMessage message;
  ASSERT_TRUE(subscriber.receive(message, 2000));
  publisher.reset();
  StatusMessage status;
  while (subscriber.receive(message, 500)) ASSERT_TRUE(decode(message.payload, status).ok());
  EXPECT_EQ(status.report.state, PipelineState::stopping);
}

TEST_F(PublishTest, LateJoinerGetsTheCharacterWithoutAsking) {
  Publisher publisher(publisherAt("a"));
  const Character anna = sampleCharacter(200);
  publisher.setCharacter(anna);
  for (int joiner = 0; joiner < 3; ++joiner) {
    Subscriber subscriber(subscriberTo(publisher, {"weights/", "character/"}));
    const std::int64_t start = monotonicNs();
    ReceivedMessage message;
    ASSERT_TRUE(next(subscriber, MessageKind::character, message));
    // Half a second between two, at most: that is the rate limit.
    EXPECT_LT(monotonicNs() - start, 1'000'000'000) << "joiner " << joiner;
    CharacterMessage character;
    ASSERT_TRUE(decode(message.payload, character).ok());
    EXPECT_EQ(character.character.neutral, anna.neutral);
    EXPECT_EQ(character.character_id, characterId(anna));
  }
}

TEST_F(PublishTest, LateJoinerMayAskForTheCharacter) {
  for (const bool tcp : {false, true}) {
    PublisherOptions options = publisherAt("a");
    if (tcp) options.endpoint = "tcp://127.0.0.1:0";
    Publisher publisher(options);
    publisher.setCharacter(sampleCharacter(200, "anna"));
    publisher.setCharacter(sampleCharacter(20, "bob"));
    Subscriber subscriber(subscriberTo(publisher, {"weights/"}));
    const std::int64_t start = monotonicNs();
    std::vector<CharacterMessage> found = subscriber.requestCharacters("anna", 3000);
    EXPECT_LT(monotonicNs() - start, 1'000'000'000);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].character.neutral.size(), 200U);
    found = subscriber.requestCharacters("", 3000);
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[1].character.name, "bob");
    EXPECT_TRUE(subscriber.requestCharacters("carol", 300).empty());
  }
}

TEST_F(PublishTest, PlainRequestSocketOfAnyLanguageIsAnswered) {
  Publisher publisher(publisherAt("a"));
  publisher.setCharacter(sampleCharacter());
  RawSocket request(ZMQ_REQ);
  ASSERT_TRUE(request.connect(publisher.endpoint() + ".snapshot"));
  request.send("character/");
  const std::vector<std::string> reply = request.receive();
  ASSERT_EQ(reply.size(), 3U);
  EXPECT_EQ(reply[0], "character/anna/");
  EXPECT_EQ(reply[1].substr(4, 4), "VCHR");
  EXPECT_EQ(reply[2], "");
}

TEST_F(PublishTest, SnapshotRequestsAreRateLimitedPerPeer) {
  Publisher publisher(publisherAt("a"));
  publisher.setCharacter(sampleCharacter());
  RawSocket flood(ZMQ_DEALER);
  ASSERT_TRUE(flood.connect(publisher.endpoint() + ".snapshot"));
  for (int i = 0; i < 200; ++i) flood.send("character/");
  for (int i = 0; i < 5; ++i) flood.send("give me everything");
  EXPECT_TRUE(eventually([&] { return publisher.counters().bad_requests >= 195; }))
      << publisher.counters().bad_requests;
  EXPECT_LE(publisher.counters().snapshots, 10U);
  // Others are served all the same.
  Subscriber other(subscriberTo(publisher, {"status/"}));
  EXPECT_EQ(other.requestCharacters("", 2000).size(), 1U);
}

TEST_F(PublishTest, MeshIsMadeOnlyForThoseWhoWantIt) {
  Publisher publisher(publisherAt("a"));
  publisher.setCharacter(sampleCharacter(50));
  EXPECT_FALSE(publisher.wantsMesh());
  {
    Subscriber weights(subscriberTo(publisher, {"weights/"}));
    ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::weights, 3000));
    EXPECT_FALSE(publisher.wantsMesh());
    Subscriber mesh(subscriberTo(publisher, {"mesh/anna/"}));
    ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::mesh, 3000));
    EXPECT_TRUE(publisher.wantsMesh());
    Subscriber second(subscriberTo(publisher, {"mesh/"}));
    Subscriber other(subscriberTo(publisher, {"mesh/bob/"}));
  }
  EXPECT_TRUE(eventually([&] { return !publisher.wantsMesh(); })) << "it is not forgotten when the last one leaves";
  const std::uint64_t before = publisher.counters().sent;
  publisher.push(sampleAvatar(1, 50));
  publisher.flush();
  EXPECT_LE(publisher.counters().sent, before + 2);  // weights, and perhaps a status
}

TEST_F(PublishTest, CharacterIsReplacedUnderItsNumber) {
  Publisher publisher(publisherAt("a"));
  const std::size_t number = publisher.setCharacter(sampleCharacter(50));
  EXPECT_EQ(publisher.setCharacter(sampleCharacter(5, "bob")), number + 1);
  EXPECT_EQ(publisher.setCharacter(sampleCharacter(60)), number);
  publisher.push(sampleAvatar(1, 50), number);
  EXPECT_EQ(publisher.counters().refused, 1U) << "a frame of the former mesh";
  publisher.push(sampleAvatar(1, 60), number);
  publisher.push(sampleAvatar(1), 7);
  EXPECT_EQ(publisher.counters().refused, 2U);
  Character bad = sampleCharacter();
  bad.triangles[0][0] = 99;
  EXPECT_THROW(publisher.setCharacter(bad), SetupError);
}

TEST_F(PublishTest, BadFrameIsRefusedCountedAndTheNextOneGoesOut) {
  Publisher publisher(publisherAt("a"));
  Subscriber subscriber(subscriberTo(publisher, {"landmarks/"}));
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::landmarks, 3000));
  LandmarkFrame bad = sampleLandmarks();
  bad.points_px[3][0] = std::numeric_limits<float>::quiet_NaN();
  publisher.push(bad);
  publisher.push(sampleLandmarks(2));
  ReceivedMessage message;
  ASSERT_TRUE(subscriber.receive(message, 3000));
  EXPECT_EQ(message.stamp.capture_seq, 2U);
  EXPECT_EQ(message.stamp.seq, 1U);
  EXPECT_EQ(publisher.counters().refused, 1U);
}

TEST_F(PublishTest, SubscriberThatDoesNotReadSlowsNobodyDown) {
  for (const bool tcp : {false, true}) {
    PublisherOptions options = publisherAt("a", WhenFull::wait);
    if (tcp) options.endpoint = "tcp://127.0.0.1:0";
    Publisher publisher(options);
    publisher.setCharacter(sampleCharacter(5000));
    Subscriber stalled(subscriberTo(publisher, {"mesh/"}, 4));
    Subscriber reading(subscriberTo(publisher, {"weights/"}));
    ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::mesh, 3000));
    ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::weights, 3000));
    const AvatarFrame frame = sampleAvatar(1, 5000);
    std::atomic<bool> done = false;
    std::atomic<std::uint64_t> got = 0;
    std::thread reader([&] {
      ReceivedMessage message;
      while (!done) got += reading.receive(message, 20) ? 1 : 0;
    });
    const std::int64_t start = monotonicNs();
    std::int64_t worst = 0;
    for (int i = 0; i < 300; ++i) {
      const std::int64_t before = monotonicNs();
      publisher.push(frame);
      worst = std::max(worst, monotonicNs() - before);
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
    publisher.flush();
    EXPECT_LT(monotonicNs() - start, 10'000'000'000);
    EXPECT_LT(worst, 1'000'000'000) << "push waited for a subscriber";
    EXPECT_TRUE(eventually([&] { return got >= 250; }, 1000)) << got;
    done = true;
    reader.join();
    // What is left for the one that slept is a few frames, not all of the past: its queue, ours, and what the kernel
    // holds.
    ReceivedMessage message;
    std::uint64_t stale = 0;
    while (stalled.receive(message, 100)) ++stale;
    EXPECT_LT(stale, 40U);
    EXPECT_GT(stale, 0U);
  }
}

TEST_F(PublishTest, LiveTheNewestFrameWinsAndDropsAreCounted) {
  Publisher publisher(publisherAt("a", WhenFull::newest_wins));
  Subscriber subscriber(subscriberTo(publisher, {"landmarks/"}, 30'000));
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::landmarks, 3000));
  constexpr std::uint64_t kFrames = 20'000;
  const LandmarkFrame frame = sampleLandmarks();
  for (std::uint64_t n = 1; n < kFrames; ++n) publisher.push(frame);
  publisher.flush();
  // Let the pipe to the subscriber, which holds four messages, run empty.
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  publisher.push(sampleLandmarks(kFrames));
  publisher.flush();
  ReceivedMessage message;
  std::uint64_t last = 0, got = 0;
  while (last != kFrames && subscriber.receive(message, 1000)) {
    last = message.stamp.capture_seq;
    ++got;
  }
  EXPECT_EQ(last, kFrames) << "the last frame is the one that counts";
  const PublisherCounters counters = publisher.counters();
  EXPECT_GT(counters.replaced, 0U);
  EXPECT_EQ(counters.refused, 0U);
  EXPECT_LE(got + counters.replaced, kFrames);
}

TEST_F(PublishTest, RendererSeesTheNewestAndNothingStale) {
  Publisher publisher(publisherAt("a", WhenFull::wait));
  SubscriberOptions options = subscriberTo(publisher, {"landmarks/", "mask/"}, 64);
  options.newest_only = true;
  options.max_age_ms = 800;
  Subscriber subscriber(options);
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::landmarks, 3000));
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::mask, 3000));
  ReceivedMessage message;
  for (std::uint64_t n = 1; n <= 3; ++n) publisher.push(sampleLandmarks(n));
  publisher.push(sampleMask(1));
  publisher.flush();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  ASSERT_TRUE(subscriber.receive(message, 1000));
  EXPECT_EQ(message.kind, MessageKind::landmarks);
  EXPECT_EQ(message.stamp.seq, 3U);
  EXPECT_EQ(message.lost_before, 0U) << "what was passed over was not lost";
  EXPECT_EQ(subscriber.counters().superseded, 2U);
  ASSERT_TRUE(subscriber.receive(message, 1000));
  EXPECT_EQ(message.kind, MessageKind::mask) << "each topic has a newest of its own";
  publisher.push(sampleLandmarks(4));
  publisher.flush();
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_FALSE(subscriber.receive(message, 50));
  EXPECT_EQ(subscriber.counters().stale, 1U);
}

TEST_F(PublishTest, RestartOfThePublisherIsNoticedWithinASecond) {
  auto publisher = std::make_unique<Publisher>(publisherAt("a"));
  Subscriber subscriber(subscriberTo(*publisher, {"status/"}));
  ReceivedMessage message;
  ASSERT_TRUE(subscriber.receive(message, 2000));
  EXPECT_FALSE(message.new_epoch);
  EXPECT_TRUE(subscriber.connected());
  const std::uint64_t first = publisher->epoch();
  publisher.reset();
  publisher = std::make_unique<Publisher>(publisherAt("a"));
  const std::int64_t start = monotonicNs();
  while (message.stamp.epoch == first) ASSERT_TRUE(subscriber.receive(message, 2000));
  EXPECT_LT(monotonicNs() - start, 1'500'000'000);
  EXPECT_TRUE(message.new_epoch);
  EXPECT_EQ(message.stamp.epoch, publisher->epoch());
  EXPECT_EQ(message.lost_before, 0U);
  EXPECT_EQ(subscriber.counters().epochs, 2U);
}

// ---- endpoints
// ---------------------------------------------------------------------------------------------------------------------

TEST_F(PublishTest, EndpointInUseIsRefused) {
  const Publisher first(publisherAt("a"));
  try {
    const Publisher second(publisherAt("a"));
    FAIL() << "two publishers on one path";
  } catch (const SetupError& e) {
    EXPECT_EQ(e.exitStatus(), 69);
    EXPECT_NE(std::string(e.what()).find("in use by process"), std::string::npos) << e.what();
  }
  PublisherOptions tcp = publisherAt("a");
  tcp.endpoint = "tcp://127.0.0.1:0";
  const Publisher third(tcp);
  tcp.endpoint = third.endpoint();
  try {
    const Publisher fourth(tcp);
    FAIL() << "two publishers on one port";
  } catch (const SetupError& e) {
    EXPECT_EQ(e.exitStatus(), 69);
    EXPECT_EQ(std::string(e.what()),
              third.endpoint() + ": in use; stop the program that holds it or choose another endpoint");
  }
  // And the first is still there.
  Subscriber subscriber(subscriberTo(first, {"status/"}));
  ReceivedMessage message;
  EXPECT_TRUE(subscriber.receive(message, 2000));
}

TEST_F(PublishTest, SocketsAreThisUsersAlone) {
  const Publisher publisher(publisherAt("a"));
  for (const char* name : {"a", "a.snapshot", "a.lock"}) {
    const auto permissions = std::filesystem::status(dir_ / name).permissions();
    EXPECT_EQ(permissions & (std::filesystem::perms::group_all | std::filesystem::perms::others_all),
              std::filesystem::perms::none)
        << name;
  }
}

TEST_F(PublishTest, PublicAddressWantsKeys) {
  for (const std::string endpoint : {"tcp://0.0.0.0:0", "tcp://*:0", "tcp://[::]:0"}) {
    PublisherOptions options;
    options.endpoint = endpoint;
    try {
      const Publisher publisher(options);
      FAIL() << endpoint;
    } catch (const SetupError& e) {
      EXPECT_EQ(e.exitStatus(), 2);
      EXPECT_NE(std::string(e.what()).find("CURVE"), std::string::npos) << e.what();
    }
  }
  SubscriberOptions remote;
  remote.endpoint = "tcp://192.0.2.1:5570";
  EXPECT_THROW(Subscriber subscriber(remote), SetupError);
}

TEST_F(PublishTest, OnlyListedKeysConnect) {
  for (const char* name : {"server", "friend", "stranger"}) writeCurveKeys(dir_ / name, generateCurveKeys());
  std::ofstream(dir_ / "allowed") << "# renderers\n" << readCurvePublicKey(dir_ / "friend.pub") << " the stage\n";
  PublisherOptions options;
  options.endpoint = "tcp://127.0.0.1:0";
  options.curve_key_file = dir_ / "server";
  options.curve_allow_file = dir_ / "allowed";
  Publisher publisher(options);
  publisher.setCharacter(sampleCharacter());
  const auto connectAs = [&](const std::string& who) {
    SubscriberOptions how;
    how.endpoint = publisher.endpoint();
    how.topics = {"status/", "weights/", "character/"};
    how.curve_server_public_key_file = dir_ / "server.pub";
    how.curve_key_file = dir_ / who;
    return how;
  };
  Subscriber stranger(connectAs("stranger"));
  Subscriber listed(connectAs("friend"));
  SubscriberOptions without = connectAs("friend");
  without.curve_key_file = without.curve_server_public_key_file = "";
  Subscriber plain(without);
  ReceivedMessage message;
  ASSERT_TRUE(listed.receive(message, 3000)) << "the listed key is refused";
  EXPECT_EQ(listed.requestCharacters("", 3000).size(), 1U);
  EXPECT_FALSE(stranger.receive(message, 700));
  EXPECT_FALSE(plain.receive(message, 100));
  EXPECT_GE(publisher.counters().denied, 1U);
}

// ---- peers that do not behave
// ------------------------------------------------------------------------------------------------------

// A publisher of anything.
class RawPublisher {
 public:
  explicit RawPublisher(const std::string& path) : socket_(ZMQ_XPUB), address_("ipc://" + path) {
    socket_.set(ZMQ_SNDHWM, 0);
    EXPECT_TRUE(socket_.bind(address_));
  }
  const std::string& address() const { return address_; }
  void awaitSubscription(const std::string& prefix) {
    while (true) {
      const std::vector<std::string> parts = socket_.receive();
      ASSERT_FALSE(parts.empty()) << "nobody subscribes";
      if (parts[0] == std::string(1, '\1') + prefix) return;
    }
  }
  void send(std::string_view topic, std::string_view payload) {
    socket_.send(topic, true);
    socket_.send(payload);
  }
  RawSocket& raw() { return socket_; }

 private:
  RawSocket socket_;
  std::string address_;
};

TEST_F(PublishTest, HostileMessagesAreCountedAndGoodOnesStillArrive) {
  RawPublisher hostile(dir_ / "h");
  SubscriberOptions options;
  options.endpoint = hostile.address();
  options.topics = {"weights/"};
  options.receive_high_water_mark = 10'000;
  Subscriber subscriber(options);
  hostile.awaitSubscription("weights/");
  Encoder encoder;
  ASSERT_TRUE(encoder.encodeWeights(sampleStamp(1), 1, sampleAvatar()).ok());
  const std::string good(textOf(encoder.bytes()));
  std::uint64_t bad = 0;
  const auto sendBad = [&](std::string_view topic, std::string_view payload) {
    hostile.send(topic, payload);
    ++bad;
  };
  sendBad("weights/anna/", "");
  sendBad("weights/anna/", "x");
  sendBad("weights/anna/", std::string(100'000, '\xFF'));
  sendBad("weights/", good);
  sendBad("weights/a\nb/", good);
  sendBad("weights/" + std::string(10'000, 'x') + "/", good);
  hostile.raw().send("weights/anna/");
  ++bad;
  hostile.raw().send("weights/anna/", true);
  hostile.raw().send(good, true);
  hostile.raw().send("more");
  ++bad;
  ASSERT_TRUE(encoder.encode(sampleStamp(1), sampleMask()).ok());
  sendBad("weights/anna/", textOf(encoder.bytes()));
  std::uint32_t random = 12'345;
  for (int i = 0; i < 2000; ++i) {
    std::string mutant = good;
    random = random * 1'664'525U + 1'013'904'223U;
    mutant[(random >> 8U) % 64] ^= static_cast<char>(1U + (random >> 24U) % 255);  // vtable, offsets, stamp
    hostile.send("weights/mutant/", mutant);
  }
  // A mutant may have brought another epoch, so the good one comes from a publisher that has just started.
  Stamp fresh = sampleStamp(1);
  fresh.epoch = 4711;
  ASSERT_TRUE(encoder.encodeWeights(fresh, 1, sampleAvatar()).ok());
  hostile.send("weights/anna/", textOf(encoder.bytes()));
  ReceivedMessage message;
  bool arrived = false;
  while (subscriber.receive(message, 500)) arrived = arrived || message.topic == "weights/anna/";
  EXPECT_TRUE(arrived);
  const SubscriberCounters& counters = subscriber.counters();
  EXPECT_GE(counters.invalid, bad);
  EXPECT_EQ(counters.invalid + counters.received, bad + 2001) << "each is counted";
  EXPECT_EQ(counters.delivered + counters.out_of_order, counters.received);
}

TEST_F(PublishTest, LossOrderAndReplayAreSeenInTheSequence) {
  RawPublisher raw(dir_ / "h");
  SubscriberOptions options;
  options.endpoint = raw.address();
  options.topics = {"weights/"};
  options.receive_high_water_mark = 100;
  Subscriber subscriber(options);
  raw.awaitSubscription("weights/");
  Encoder encoder;
  const auto send = [&](std::uint64_t epoch, std::uint64_t seq) {
    Stamp stamp = sampleStamp(seq);
    stamp.epoch = epoch;
    ASSERT_TRUE(encoder.encodeWeights(stamp, 1, sampleAvatar()).ok());
    raw.send("weights/anna/", textOf(encoder.bytes()));
  };
  // epoch, seq, delivered, lost before
  struct Step {
    std::uint64_t epoch, seq;
    bool delivered;
    std::uint64_t lost;
    bool new_epoch;
  };
  const std::vector<Step> steps{{1, 10, true, 0, false},  {1, 11, true, 0, false},  {1, 15, true, 3, false},
                                {1, 15, false, 0, false}, {1, 12, false, 0, false}, {1, 16, true, 0, false},
                                {2, 1, true, 0, true},    {1, 17, false, 0, false}, {2, 3, true, 1, false}};
  ReceivedMessage message;
  for (const Step& step : steps) {
    send(step.epoch, step.seq);
    const bool got = subscriber.receive(message, step.delivered ? 2000 : 100);
    ASSERT_EQ(got, step.delivered) << step.epoch << " " << step.seq;
    if (!got) continue;
    EXPECT_EQ(message.stamp.seq, step.seq);
    EXPECT_EQ(message.lost_before, step.lost);
    EXPECT_EQ(message.new_epoch, step.new_epoch);
  }
  EXPECT_EQ(subscriber.counters().lost, 4U);
  EXPECT_EQ(subscriber.counters().out_of_order, 3U);
  EXPECT_EQ(subscriber.counters().epochs, 2U);
}

TEST_F(PublishTest, SubscriberComesBackAfterAnOversizeMessage) {
  RawPublisher hostile(dir_ / "h");
  SubscriberOptions options;
  options.endpoint = hostile.address();
  options.topics = {"weights/"};
  options.receive_high_water_mark = 100;
  Subscriber subscriber(options);
  hostile.awaitSubscription("weights/");
  hostile.send("weights/anna/", std::string(kMaxInboundBytes + 1, 'x'));
  // Left to itself, ZeroMQ would never connect again.
  Encoder encoder;
  ReceivedMessage message;
  bool arrived = false;
  for (std::uint64_t seq = 1; seq < 60 && !arrived; ++seq) {
    ASSERT_TRUE(encoder.encodeWeights(sampleStamp(seq), 1, sampleAvatar()).ok());
    hostile.send("weights/anna/", textOf(encoder.bytes()));
    arrived = subscriber.receive(message, 50);
  }
  EXPECT_TRUE(arrived);
  EXPECT_GE(subscriber.counters().reconnects, 1U);
}

TEST_F(PublishTest, ClientThatSendsTooMuchIsThrownOutAndOthersStay) {
  Publisher publisher(publisherAt("a"));
  Subscriber good(subscriberTo(publisher, {"landmarks/"}));
  ASSERT_TRUE(publisher.waitForSubscriber(MessageKind::landmarks, 3000));
  RawSocket bad(ZMQ_XSUB);
  ASSERT_TRUE(bad.connect(publisher.endpoint()));
  bad.send(std::string("\1") + std::string(1000, 't'));
  bad.send(std::string("\1mask/"));
  RawSocket odd(ZMQ_XSUB);
  ASSERT_TRUE(odd.connect(publisher.endpoint()));
  odd.send("\2 what?");
  odd.send("");
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  publisher.push(sampleLandmarks(1));
  ReceivedMessage message;
  EXPECT_TRUE(next(good, MessageKind::landmarks, message));
}

TEST_F(PublishTest, BytesOfOtherProtocolsAndHalfOpenConnectionsDoNoHarm) {
  Publisher publisher(publisherAt("a"));
  std::vector<int> sockets;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, (dir_ / "a").c_str());
  for (int i = 0; i < 50; ++i) {
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
    sockets.push_back(fd);
    if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) continue;
    const std::string_view garbage = i % 3 == 0   ? "GET / HTTP/1.1\r\nHost: evil\r\n\r\n"
                                     : i % 3 == 1 ? std::string_view("\x16\x03\x01\x02\x00", 5)
                                                  : "";
    [[maybe_unused]] const ssize_t n = ::send(fd, garbage.data(), garbage.size(), MSG_NOSIGNAL);
  }
  Subscriber subscriber(subscriberTo(publisher, {"status/"}));
  ReceivedMessage message;
  EXPECT_TRUE(subscriber.receive(message, 2000));
  for (const int fd : sockets) close(fd);
}

TEST_F(PublishTest, StartingAndStoppingFiftyTimesLeavesNothingBehind) {
  const auto openFiles = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  { const Publisher warm_up(publisherAt("a")); }
  const auto before = openFiles();
  for (int i = 0; i < 50; ++i) {
    Publisher publisher(publisherAt("a"));
    publisher.setCharacter(sampleCharacter());
    publisher.push(sampleAvatar());
  }
  EXPECT_EQ(openFiles(), before);
}

// ---- keys
// --------------------------------------------------------------------------------------------------------------------------

class CurveTest : public PublishTest {
 protected:
  std::string problemOf(const std::string& path) {
    try {
      (void)readCurveKeys(path);
    } catch (const SetupError& e) {
      EXPECT_EQ(e.exitStatus(), 78);
      return e.what();
    }
    return "";
  }
};

TEST_F(CurveTest, KeysAreWrittenForTheOwnerAloneAndReadBack) {
  const CurveKeys keys = generateCurveKeys();
  const std::string path = dir_ / "key";
  writeCurveKeys(path, keys);
  EXPECT_EQ(std::filesystem::status(path).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(readCurveKeys(path).secret_key, keys.secret_key);
  EXPECT_EQ(readCurvePublicKey(path + ".pub"), keys.public_key);
  EXPECT_THROW(writeCurveKeys(path, keys), SetupError) << "never overwritten";
}

TEST_F(CurveTest, KeyFileThatOthersMayReadIsRefused) {
  const std::string path = dir_ / "key";
  writeCurveKeys(path, generateCurveKeys());
  std::filesystem::permissions(path, std::filesystem::perms::group_read, std::filesystem::perm_options::add);
  EXPECT_NE(problemOf(path).find("chmod 600"), std::string::npos);
}

TEST_F(CurveTest, BadKeyFilesAreRefusedWithAReason) {
  const std::string path = dir_ / "key";
  EXPECT_NE(problemOf(path).find("cannot be read"), std::string::npos);
  const CurveKeys a = generateCurveKeys(), b = generateCurveKeys();
  const std::map<std::string, std::string> files{
      {"", "missing"},
      {"public " + a.public_key + "\n", "missing"},
      {"public short\nsecret shorter\n", ":1: expected"},
      {"public " + a.public_key + "\nsecret " + b.secret_key + "\n", "does not belong"},
      {"public rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7\nsecret JTKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6\n",
       "manual of ZeroMQ"},
  };
  for (const auto& [content, reason] : files) {
    std::ofstream(path, std::ios::trunc) << content;
    std::filesystem::permissions(path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    EXPECT_NE(problemOf(path).find(reason), std::string::npos) << problemOf(path) << " for " << content;
  }
  std::ofstream(path, std::ios::trunc) << "# nobody\n";
  EXPECT_THROW((void)readCurveAllowList(path), SetupError);
}

}  // namespace
}  // namespace volto::protocol
