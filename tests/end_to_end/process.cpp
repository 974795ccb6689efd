#include "tests/end_to_end/process.h"

#include <csignal>
#include <fcntl.h>
#include <fstream>
#include <spawn.h>
#include <sstream>
#include <stdexcept>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace volto::test {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kStep(5);

}  // namespace

Process::Process(const std::vector<std::string>& arguments, const std::string& input) {
  writeFile(folder_ / "in", input);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, (folder_ / "in").c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, (folder_ / "out").c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                   0600);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, (folder_ / "err").c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                   0600);
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int error = posix_spawn(&pid_, argv[0], &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) throw std::runtime_error("cannot start " + arguments[0]);
}

Process::~Process() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void Process::signal(int number) const {
  if (pid_ > 0) kill(pid_, number);
}

Finished Process::wait(std::chrono::milliseconds limit) {
  Finished finished;
  int status = 0;
  const auto end = Clock::now() + limit;
  pid_t ended = 0;
  while (ended == 0 && Clock::now() < end) {
    ended = waitpid(pid_, &status, WNOHANG);
    if (ended == 0) std::this_thread::sleep_for(kStep);
  }
  if (ended == pid_) {
    finished.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  } else {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  pid_ = -1;
  finished.out = readFile(folder_ / "out");
  finished.err = readFile(folder_ / "err");
  return finished;
}

std::string Process::outputSoFar() const { return readFile(folder_ / "out"); }

bool Process::waitForOutput(const std::string& text, std::chrono::milliseconds limit) const {
  for (const auto end = Clock::now() + limit; Clock::now() < end; std::this_thread::sleep_for(kStep)) {
    if (outputSoFar().find(text) != std::string::npos) return true;
  }
  return false;
}

std::string voltoProgram() { return VOLTO_PROGRAM; }
std::string listenProgram() { return VOLTO_LISTEN_PROGRAM; }

Finished volto(std::vector<std::string> arguments, const std::string& input) {
  arguments.insert(arguments.begin(), voltoProgram());
  return Process(arguments, input).wait();
}

void writeFile(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << bytes;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

}  // namespace volto::test
