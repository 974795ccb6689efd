// Processes that talk to each other: replay, record, volto-listen.
#include <chrono>
#include <csignal>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zmq.h>

#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

using Json = nlohmann::json;

class Stream : public World {
 protected:
  std::vector<std::string> replay(const std::string& input, std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments{voltoProgram(), "replay", input, "--rig", rig(), "--publish", endpoint()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  std::vector<std::string> listen(std::vector<std::string> more) const {
    std::vector<std::string> arguments{listenProgram(), endpoint(), "--wait", "30"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  static std::vector<Json> jsonLines(const std::string& text) {
    std::vector<Json> result;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) result.push_back(Json::parse(line));
    return result;
  }
};

TEST_F(Stream, EveryFrameOfAReplayReachesAListenerInAnotherProcess) {
  Process listener(listen({"--count", "90", "--json"}));
  Process player(replay(performance(90), {"--wait", "20", "--lossless"}));
  const Finished played = player.wait(), listened = listener.wait();
  ASSERT_EQ(played.status, 0) << played.err;
  EXPECT_EQ(played.out.rfind("90 frames in ", 0), 0U) << played.out;
  EXPECT_EQ(std::count(played.out.begin(), played.out.end(), '\n'), 1);
  ASSERT_EQ(listened.status, 0) << listened.err;
  const std::vector<Json> frames = jsonLines(listened.out);
  ASSERT_EQ(frames.size(), 90U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i]["seq"], i + 1);
    EXPECT_GE(frames[i]["t_publish_ns"].get<std::int64_t>(), frames[i]["t_capture_ns"].get<std::int64_t>());
    EXPECT_EQ(frames[i]["weights"].size(), 52U);
  }
  EXPECT_TRUE(frames.back()["weights"].contains("jawOpen"));
  EXPECT_TRUE(frames.back().contains("head"));
}

TEST_F(Stream, ALateJoinerLearnsTheNamesAndGetsTheMesh) {
  Process player(replay(performance(60), {"--loop"}));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  Process listener(listen({"--count", "60", "--json", "--mesh"}));
  const Finished listened = listener.wait();
  player.signal(SIGTERM);
  const Finished played = player.wait();
  EXPECT_EQ(played.status, 0) << played.err;
  ASSERT_EQ(listened.status, 0) << listened.err;
  bool named = false, mesh = false;
  for (const Json& frame : jsonLines(listened.out)) {
    const std::string stream = frame["stream"];
    named = named || (stream.starts_with("weights/") && frame["weights"].contains("jawOpen"));
    mesh = mesh || (stream.starts_with("mesh/") && frame["vertices"].size() > 1000);
  }
  EXPECT_TRUE(named);
  EXPECT_TRUE(mesh);
}

TEST_F(Stream, ARecordedReplayReplaysToTheSameWeights) {
  const std::string input = performance(60);
  Process recorder({voltoProgram(), "record", endpoint(), "-o", path("t.take")});
  Process player(replay(input, {"--wait", "20", "--lossless"}));
  const Finished played = player.wait();
  ASSERT_EQ(played.status, 0) << played.err;
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  recorder.signal(SIGTERM);
  const Finished recorded = recorder.wait();
  ASSERT_EQ(recorded.status, 0) << recorded.err;
  EXPECT_NE(recorded.out.find("; 0 lost on the way, 0 dropped"), std::string::npos) << recorded.out;

  const Finished inspected = volto({"inspect", path("t.take"), "--json"});
  const Json take = Json::parse(inspected.out);
  EXPECT_TRUE(take["finished"].get<bool>());
  EXPECT_EQ(take["frames"], 60);
  EXPECT_EQ(take["layout"], "ibug68");
  EXPECT_FALSE(std::filesystem::exists(path("t.take-wal")));

  const Finished first = volto({"bake", input, "--rig", rig(), "--csv", "-"});
  const Finished again = volto({"bake", path("t.take"), "--rig", rig(), "--csv", "-"});
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(first.out, again.out);
}

TEST_F(Stream, AnEndpointInUseIsUnavailable) {
  Process first(replay(performance(60), {"--loop"}));
  Process listener(listen({"--count", "1"}));
  ASSERT_EQ(listener.wait().status, 0);  // it is there
  Process second(replay(performance(60)));
  expectRefused(second.wait(), 69, "replay", "in use");
  first.signal(SIGTERM);
  EXPECT_EQ(first.wait().status, 0);
  Process third(replay(performance(5)));  // and free again
  EXPECT_EQ(third.wait().status, 0);
}

TEST_F(Stream, SigtermEndsAReplayCleanly) {
  for (const int number : {SIGTERM, SIGINT}) {
    Process player(replay(performance(60), {"--loop"}));
    Process listener(listen({"--count", "5", "--quiet"}));
    ASSERT_EQ(listener.wait().status, 0);
    player.signal(number);
    const Finished played = player.wait(std::chrono::seconds(5));
    EXPECT_EQ(played.status, 0) << played.err;
    EXPECT_NE(played.out.find(" frames in "), std::string::npos) << played.out;
    EXPECT_EQ(played.err, "");
  }
}

TEST_F(Stream, ARecordingIsNotReplacedWithoutForce) {
  const std::string take = write("t.take", "precious");
  const Finished refused = volto({"record", endpoint(), "-o", take, "--seconds", "1"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
  EXPECT_EQ(readFile(take), "precious");
}

TEST_F(Stream, RecordingNothingWritesNothing) {
  expectRefused(volto({"record", endpoint(), "-o", output("t.take"), "--seconds", "0.5"}), 69, "record",
                "nothing was received");
}

TEST_F(Stream, AMessageThatFailsTheVerifierIsRefusedAndCounted) {
  void* const context = zmq_ctx_new();
  void* const socket = zmq_socket(context, ZMQ_PUB);
  const int linger = 0;
  zmq_setsockopt(socket, ZMQ_LINGER, &linger, sizeof linger);
  ASSERT_EQ(zmq_bind(socket, endpoint().c_str()), 0);
  Process recorder({voltoProgram(), "record", endpoint(), "-o", output("t.take"), "--seconds", "3"});
  std::string payload(400, '\x5a');
  payload.replace(4, 4, "VOWT");
  for (int i = 0; i < 25; ++i) {
    zmq_send(socket, "weights/anna/", 13, ZMQ_SNDMORE);
    zmq_send(socket, payload.data(), payload.size(), 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const Finished recorded = recorder.wait();
  zmq_close(socket);
  zmq_ctx_term(context);
  expectRefused(recorded, 69, "record", "refused");
}

}  // namespace
}  // namespace volto::test
