// Runs the programs as people do: as processes, with arguments, files, pipes and signals.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <sys/types.h>
#include <vector>

#include "tests/support/test_data.h"

namespace volto::test {

struct Finished {
  int status = -1;  // exit status; 128 + N when signal N killed it; -1: it did not end in time (and was killed)
  std::string out;  // standard output
  std::string err;  // standard error
};

// A running program. Its output goes to files of its own, so that it never waits for the test.
class Process {
 public:
  // `input` is its standard input.
  explicit Process(const std::vector<std::string>& arguments, const std::string& input = {});
  ~Process();  // kills what still runs
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number) const;
  Finished wait(std::chrono::milliseconds limit = std::chrono::seconds(60));
  std::string outputSoFar() const;
  // Waits until the standard output holds `text`; false after `limit`.
  bool waitForOutput(const std::string& text, std::chrono::milliseconds limit = std::chrono::seconds(20)) const;

 private:
  TemporaryDir folder_;
  pid_t pid_ = -1;
};

// The programs that were built.
std::string voltoProgram();
std::string listenProgram();

Finished volto(std::vector<std::string> arguments, const std::string& input = {});

void writeFile(const std::filesystem::path& path, const std::string& bytes);
std::string readFile(const std::filesystem::path& path);

}  // namespace volto::test
