// When each frame of a replay is due: absolute deadlines on the monotonic clock, so that a late frame does not make the
// next one late.
#pragma once

#include <cstdint>

namespace volto::pipeline {

// CLOCK_MONOTONIC, nanoseconds: the clock of t_capture_ns and t_publish_ns.
std::int64_t monotonicNow();

class Pacer {
 public:
  // `speed` times as fast as recorded; 0: as fast as can be, never waits.
  Pacer(std::int64_t start_ns, double speed) : start_ns_(start_ns), speed_(speed) {}

  // The time at which the moment `offset_ns` after the beginning of the performance is due. Without a pace: now.
  std::int64_t due(std::int64_t offset_ns) const;
  // Sleeps until then. False when a signal woke it up before: the caller looks whether to stop, and calls again.
  bool wait(std::int64_t due_ns) const;

 private:
  std::int64_t start_ns_;
  double speed_;
};

}  // namespace volto::pipeline
