// volto-listen as a process of its own.
#include <array>
#include <chrono>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sstream>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

#include "protocol/publisher.h"
#include "tests/protocol/samples.h"
#include "tests/support/test_data.h"

namespace volto::protocol {
namespace {

using test::sampleAvatar;
using test::sampleCharacter;

struct Finished {
  int status = -1;
  std::string out, err;
};

class ListenProcess {
 public:
  explicit ListenProcess(std::vector<std::string> arguments) {
    std::array<int, 2> out{}, err{};
    EXPECT_EQ(pipe2(out.data(), O_CLOEXEC), 0);
    EXPECT_EQ(pipe2(err.data(), O_CLOEXEC), 0);
    arguments.insert(arguments.begin(), VOLTO_LISTEN);
    std::vector<char*> argv;
    for (std::string& a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
    EXPECT_EQ(posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(out[1]);
    close(err[1]);
    out_ = out[0];
    err_ = err[0];
  }

  void signal(int number) const { kill(pid_, number); }

  Finished finish() {
    Finished f;
    f.out = readAll(out_);
    f.err = readAll(err_);
    int status = 0;
    waitpid(pid_, &status, 0);
    f.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return f;
  }

 private:
  static std::string readAll(int fd) {
    std::string text;
    std::array<char, 4096> part{};
    for (ssize_t n = 0; (n = read(fd, part.data(), part.size())) > 0;)
      text.append(part.data(), static_cast<std::size_t>(n));
    close(fd);
    return text;
  }
  pid_t pid_ = 0;
  int out_ = -1, err_ = -1;
};

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class ListenTest : public ::testing::Test {
 protected:
  ListenTest()
      : publisher_([this] {
          PublisherOptions options;
          options.endpoint = "ipc://" + (dir_ / "a").string();
          options.when_full = WhenFull::lossless;
          return options;
        }()) {
    publisher_.setCharacter(sampleCharacter(3));
  }
  void publish(std::uint64_t frames, MessageKind kind = MessageKind::weights) {
    ASSERT_TRUE(publisher_.waitForSubscriber(kind, 10'000));
    for (std::uint64_t n = 1; n <= frames; ++n) publisher_.push(sampleAvatar(n, 3));
    publisher_.flush();
  }

  ::volto::test::TemporaryDir dir_;
  Publisher publisher_;
};

TEST_F(ListenTest, OneJsonObjectALineWithNamesFromTheFirstOn) {
  ListenProcess listen({publisher_.endpoint(), "--json", "--count", "3", "--summary"});
  publish(3);
  const Finished f = listen.finish();
  EXPECT_EQ(f.status, 0) << f.err;
  const std::vector<std::string> lines = linesOf(f.out);
  ASSERT_EQ(lines.size(), 3U) << f.out;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string& line = lines[i];
    EXPECT_EQ(line.rfind("{\"stream\":\"weights/anna/\",\"seq\":" + std::to_string(i + 1) +
                             ",\"t_capture_ns\":" + std::to_string((i + 1) * 16'666'667) + ",\"t_publish_ns\":",
                         0),
              0U)
        << line;
    EXPECT_NE(line.find("\"jawOpen\":"), std::string::npos) << line;
    EXPECT_NE(line.find("\"eyeBlinkLeft\":0,"), std::string::npos) << line;
    EXPECT_NE(line.find("\"not_observed\":[\"tongueOut\"]"), std::string::npos) << line;
    EXPECT_NE(line.find("\"head\":{\"yaw_rad\":-0.2,"), std::string::npos) << line;
    EXPECT_EQ(line.back(), '}');
  }
  EXPECT_EQ(f.err.rfind("frames 3  lost 0  ", 0), 0U) << f.err;
}

TEST_F(ListenTest, MeshHasItsVertices) {
  ListenProcess listen({publisher_.endpoint(), "--json", "--mesh", "--count", "2"});
  publish(1, MessageKind::mesh);
  const Finished f = listen.finish();
  EXPECT_EQ(f.status, 0) << f.err;
  EXPECT_NE(f.out.find("\"vertices\":[[0,0.25,1],[1,1.25,1],[2,2.25,1]]}\n"), std::string::npos) << f.out;
}

TEST_F(ListenTest, TextLineSaysWhatMoves) {
  ListenProcess listen({publisher_.endpoint(), "--count", "1"});
  publish(1);
  const Finished f = listen.finish();
  EXPECT_EQ(f.out.rfind("weights/anna/ 1 tracking  yaw -11.5 pitch +1.1 roll -1.7  ", 0), 0U) << f.out;
}

TEST_F(ListenTest, InterruptEndsItCleanly) {
  for (const int number : {SIGINT, SIGTERM}) {
    ListenProcess listen({publisher_.endpoint(), "--summary"});
    publish(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    listen.signal(number);
    const Finished f = listen.finish();
    EXPECT_EQ(f.status, 0) << f.err;
    EXPECT_NE(f.err.find("frames "), std::string::npos) << f.err;
  }
}

TEST(ListenErrorTest, NobodyThereIsSaidInOneLine) {
  const Finished f = ListenProcess({"ipc:///tmp/volto-nobody-publishes-here", "--wait", "0.3"}).finish();
  EXPECT_EQ(f.status, 69);
  EXPECT_EQ(f.out, "");
  EXPECT_EQ(f.err,
            "volto-listen: ipc:///tmp/volto-nobody-publishes-here: nobody publishes there (waited 0.3 s); start 'volto "
            "run' or "
            "'volto replay'\n");
}

TEST(ListenErrorTest, WrongUsageIsStatusTwo) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"nonsense"}, {"tcp://192.0.2.1:5570"}, {"--count", "many"}, {"--no-such-option"}, {"ipc://a", "ipc://b"}}) {
    const Finished f = ListenProcess(arguments).finish();
    EXPECT_EQ(f.status, 2) << arguments[0];
    EXPECT_NE(f.err + f.out, "");
  }
  EXPECT_EQ(ListenProcess({"ipc://a", "--key", "/nonexistent", "--server-key", "/nonexistent"}).finish().status, 78);
}

}  // namespace
}  // namespace volto::protocol
