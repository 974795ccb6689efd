// ImageSource: where pictures come from. A camera (v4l2/camera_source.h), a video file, an image sequence.
#pragma once

#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "capture/image.h"

namespace volto::capture {

enum class SourceState : std::uint8_t {
  no_signal,  // nothing there yet, or no longer: unplugged, busy, or nothing but broken pictures. A camera is tried again and again.
  streaming,  // pictures come
  stalled,    // the device is there and says nothing; a restart is under way
  ended,      // the last picture of a file has been given; nothing will come any more
};

enum class Next : std::uint8_t {
  frame,    // `out` holds a new picture
  nothing,  // no new picture before the timeout, or the state changed just now: look at state() and call again
  ended,    // no picture any more, ever
};

// All of them since the source was made; they only grow.
struct SourceCounters {
  std::uint64_t captured = 0;         // pictures given to the caller
  std::uint64_t dropped = 0;          // good pictures passed over because a newer one was there
  std::uint64_t corrupt = 0;          // pictures that were broken and not shown
  std::uint64_t sequence_gaps = 0;    // pictures that the source itself says it lost (sum over all gaps)
  std::uint64_t decode_warnings = 0;  // shown, though not quite as the standard wants them
  std::uint64_t bad_timestamps = 0;   // times of the driver that were replaced by the time of arrival
  std::uint64_t stalls = 0;           // times that nothing came for too long
  std::uint64_t restarts = 0;         // of the stream, on the same open device
  std::uint64_t losses = 0;           // times that the device was gone or had to be closed
  std::uint64_t reconnects = 0;       // times that it came back and gave a picture
};

// What is really delivered, as read back; empty or zero where it is not known (yet).
struct SourceInfo {
  std::string name;      // for people: "Integrated Camera: Integrated C", "talking.mp4"
  std::string location;  // "/dev/video2", a path
  std::string format;    // "MJPG", "YUYV", "h264"
  int width = 0;
  int height = 0;
  double rate_hz = 0;       // agreed with the device, or said by the file
  double delivered_hz = 0;  // measured over the last two seconds; a camera in low light may give half of what was agreed
};

// A device that cannot be used: what() is one line with what, where and what to do. The command line exits with 69.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// One thread calls everything; a source has no thread of its own unless its header says so. After the first pictures next() does not
// allocate (what a decoder library does inside is its own matter). Sources may be made in one thread and used in another.
class ImageSource {
 public:
  ImageSource() = default;
  virtual ~ImageSource() = default;
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;

  // Waits for the next picture, at most `timeout` (0: only look). The newest wins: a live source passes over everything older than the newest
  // picture there is, so call it again soon, from a thread that does nothing else. A file that is not played in real time gives every
  // picture. Trouble after the start is a state and a counter, not an exception: next() recovers by itself.
  virtual Next next(Image& out, std::chrono::nanoseconds timeout) = 0;

  virtual SourceState state() const = 0;
  virtual const SourceCounters& counters() const = 0;
  virtual const SourceInfo& info() const = 0;
  // One line for people about the state or about something to mend ("/dev/video0 is in use by pid 712 (zoom)", "camera delivers 15 of 30
  // fps: ..."); empty when all is well.
  virtual const std::string& notice() const = 0;
};

}  // namespace volto::capture
