// FrameClock: when a picture was taken, how many were lost before it, and how fast they come.
#pragma once

#include <cstdint>

#include "capture/image_source.h"
#include "capture/v4l2/buffer_queue.h"

namespace volto::capture::v4l2 {

// The driver's time is taken where it can be true: of the monotonic clock, not more than 5 ms ahead, not at or before
// the picture before, not older than 2 s. Otherwise the time of arrival stands in, and is counted; after the third such
// time the stream's times are not believed any more. What comes out rises from picture to picture, over restarts and
// reconnects too.
class FrameClock {
 public:
  // The stream starts (again): sequence numbers and trust begin anew; capture_seq and the times go on.
  void startStream();

  // To be called for every buffer that comes back, in that order, also for those that are passed over. Gives its
  // capture_seq: how many pictures the camera has made before it, lost ones included. Adds gaps to `counters`.
  std::uint64_t countSequence(const Dequeued& buffer, SourceCounters& counters);
  // For the one that is shown: its time. `waited_ns`: how long nobody has looked, so long a buffer may have lain there.
  std::int64_t timeOf(const Dequeued& buffer, std::uint64_t seq, std::int64_t now_ns, std::int64_t waited_ns,
                      SourceCounters& counters);

  // Over the last two seconds, from the camera's own count: pictures passed over or lost on the way do not lower it. 0:
  // not known yet.
  double deliveredHz() const { return delivered_hz_; }

 private:
  void measureRate(std::int64_t t_ns, std::uint64_t seq);

  std::uint64_t made_ = 0;
  bool any_sequence_ = false;
  std::uint32_t last_sequence_ = 0;
  int bad_times_ = 0;
  std::int64_t last_driver_ns_ = -1;
  std::int64_t last_ns_ = -1;
  double delivered_hz_ = 0;
  struct Mark {
    std::int64_t t_ns = -1;
    std::uint64_t seq = 0;
  };
  Mark older_, newer_;  // a second and more apart
};

}  // namespace volto::capture::v4l2
