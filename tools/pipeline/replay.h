// A performance to subscribers, each frame when it is due.
#pragma once

#include <cstdint>
#include <functional>

#include "protocol/publisher.h"
#include "tools/pipeline/frame_path.h"
#include "tools/pipeline/latency_histogram.h"
#include "tools/pipeline/performance.h"

namespace volto::pipeline {

struct ReplayOptions {
  double speed = 1.0;  // times real time; 0: as fast as can be
  bool loop = false;   // from the start again, for ever
};

struct ReplayResult {
  std::uint64_t frames = 0;                  // sent
  std::uint64_t gaps = 0;                    // frames that the recording itself lost
  std::uint64_t dropped = 0;                 // refused by the publisher, or replaced before they were sent
  std::uint64_t late = 0;                    // sent after the next frame was due
  double seconds = 0;                        // from the first frame to the last one sent
  LatencyHistogram tracker, retarget, sent;  // per frame: landmarks to mask, mask to avatar, landmarks to sent messages
  bool stopped = false;                      // `stop` said so before the end

  double rate() const { return frames > 1 && seconds > 0 ? static_cast<double>(frames - 1) / seconds : 0.0; }
};

// Sends landmarks/ or nothing for recorded weights, mask/, weights/ and, to those who want it, mesh/; keeps status/ up
// to date. Every frame counts: none is skipped to catch up.
//
// With a pace, the t_capture_ns of a frame is the time at which it was due, so that the spacing of the recording is
// kept to the nanosecond (at speed 1) and a recording of a replay is tracked to the same bits; as fast as can be, it is
// the time at which the frame was handed in. The tracker itself always sees the recording's own times. `stop` is asked
// before each frame and when a signal arrives.
ReplayResult replay(const Performance& performance, FramePath& path, protocol::Publisher& publisher,
                    const ReplayOptions& options, const std::function<bool()>& stop);

}  // namespace volto::pipeline
