// Progress of long work: a line on a terminal that rewrites itself, nothing anywhere else.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace volto::cli {

class Progress {
 public:
  // `total` 0: not known. Writes to standard error, and only where that is a terminal.
  Progress(std::string doing, std::size_t total);
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // Cheap enough for every frame: draws at most ten times a second.
  void show(std::size_t done);

 private:
  std::string doing_;
  std::size_t total_;
  bool terminal_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace volto::cli
