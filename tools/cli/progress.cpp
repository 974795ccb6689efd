#include "tools/cli/progress.h"

#include <cstdio>
#include <unistd.h>
#include <utility>

namespace volto::cli {

Progress::Progress(std::string doing, std::size_t total)
    : doing_(std::move(doing)), total_(total), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

void Progress::show(std::size_t done) {
  if (!terminal_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  drawn_ = true;
  if (total_ > 0) {
    std::fprintf(stderr, "\r\033[K%s %zu of %zu (%zu %%)", doing_.c_str(), done, total_, 100 * done / total_);
  } else {
    std::fprintf(stderr, "\r\033[K%s %zu", doing_.c_str(), done);
  }
  std::fflush(stderr);
}

}  // namespace volto::cli
