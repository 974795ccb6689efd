#include "tools/pipeline/pacer.h"

#include <cerrno>
#include <cmath>
#include <ctime>

namespace volto::pipeline {

namespace {
constexpr std::int64_t kNsPerS = 1'000'000'000;
}

std::int64_t monotonicNow() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}

std::int64_t Pacer::due(std::int64_t offset_ns) const {
  if (speed_ <= 0) return monotonicNow();
  if (speed_ == 1.0)
    return start_ns_ + offset_ns;  // exact: what is recorded from this replay has the same spacing to the nanosecond
  return start_ns_ + std::llround(static_cast<double>(offset_ns) / speed_);
}

bool Pacer::wait(std::int64_t due_ns) const {
  if (speed_ <= 0) return true;
  const timespec due{static_cast<std::time_t>(due_ns / kNsPerS), static_cast<long>(due_ns % kNsPerS)};
  return clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) != EINTR;
}

}  // namespace volto::pipeline
