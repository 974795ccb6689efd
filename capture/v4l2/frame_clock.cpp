#include "capture/v4l2/frame_clock.h"

#include <algorithm>

namespace volto::capture::v4l2 {

namespace {
constexpr std::int64_t kMostAheadNs = 5'000'000;
constexpr std::int64_t kMostAgeNs = 2'000'000'000;
constexpr int kBadTimesToDistrust = 3;
constexpr std::int64_t kRateStepNs = 1'000'000'000;
}  // namespace

void FrameClock::startStream() {
  any_sequence_ = false;
  bad_times_ = 0;
  last_driver_ns_ = -1;
  delivered_hz_ = 0;
  older_ = newer_ = {};
}

std::uint64_t FrameClock::countSequence(const Dequeued& buffer, SourceCounters& counters) {
  std::uint32_t step = 1;
  if (any_sequence_) {
    step = buffer.sequence - last_sequence_;  // wraps as the driver's counter does
    // A counter that stands still or runs backward counts nothing.
    if (step == 0 || step >= 0x8000'0000U) step = 1;
    counters.sequence_gaps += step - 1;
  }
  made_ += step;
  last_sequence_ = buffer.sequence;
  any_sequence_ = true;
  return made_ - 1;
}

std::int64_t FrameClock::timeOf(const Dequeued& buffer, std::uint64_t seq, std::int64_t now_ns, std::int64_t waited_ns,
                                SourceCounters& counters) {
  const std::int64_t t = buffer.t_driver_ns;
  const bool believable = buffer.monotonic && t > 0 && t <= now_ns + kMostAheadNs && t > last_driver_ns_ &&
                          now_ns - t <= kMostAgeNs + std::max<std::int64_t>(waited_ns, 0);
  if (believable)
    last_driver_ns_ = t;
  else
    ++bad_times_;
  const bool believed = believable && bad_times_ < kBadTimesToDistrust;
  if (!believed) ++counters.bad_timestamps;
  last_ns_ = std::max(believed ? t : now_ns, last_ns_ + 1);
  measureRate(last_ns_, seq);
  return last_ns_;
}

void FrameClock::measureRate(std::int64_t t_ns, std::uint64_t seq) {
  const Mark now{t_ns, seq};
  if (newer_.t_ns < 0) {
    newer_ = now;
    return;
  }
  if (now.t_ns - newer_.t_ns < kRateStepNs) return;
  const Mark& since = older_.t_ns < 0 ? newer_ : older_;
  delivered_hz_ = static_cast<double>(now.seq - since.seq) * 1e9 / static_cast<double>(now.t_ns - since.t_ns);
  older_ = newer_;
  newer_ = now;
}

}  // namespace volto::capture::v4l2
