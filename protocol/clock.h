// The two clocks of the wire.
#pragma once

#include <cstdint>
#include <ctime>

namespace volto::protocol {

inline std::int64_t clockNs(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

// CLOCK_MONOTONIC: the same for every process of one machine, never set back. t_capture_ns and t_publish_ns are read
// from it.
inline std::int64_t monotonicNs() { return clockNs(CLOCK_MONOTONIC); }

// Nanoseconds since 1970 (UTC); may jump. For people to read, never to subtract.
inline std::int64_t realtimeNs() { return clockNs(CLOCK_REALTIME); }

}  // namespace volto::protocol
