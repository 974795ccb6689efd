// Landmarks that OpenSeeFace sends by UDP (facetracker.py; default port 11573): its users need change nothing.
//
// A datagram is one record of 1785 bytes per face, little-endian, packed: time (f64, Unix seconds), face (i32), image
// size (f32 x 2), how open the eyes are, whether and how well the 3D fit went, rotation, translation, 68 confidences
// (f32), 68 points (f32 x, y, pixels; 66 and 67 are the right and left pupil), 70 points in 3D, 14 features.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "capture/face_choice.h"
#include "capture/image_source.h"
#include "frames/landmark_frame.h"

namespace volto::capture {

inline constexpr std::size_t kOpenSeeFaceRecordBytes = 1785;
inline constexpr std::uint16_t kOpenSeeFacePort = 11573;

struct OpenSeeFaceRecord {
  double time_s = 0;
  int face = 0;
};

// One record of 1785 bytes to 66 points with pupils; `out` keeps its time and sequence number. Returns what is wrong
// with the record, a constant text ("a point is not finite"), or null when nothing is.
const char* readOpenSeeFace(std::span<const std::byte> record, LandmarkFrame& out, OpenSeeFaceRecord& about);

struct DatagramCounters {
  std::uint64_t datagrams = 0;
  std::uint64_t frames = 0;      // given to the caller
  std::uint64_t dropped = 0;     // good ones passed over because a newer one was there
  std::uint64_t wrong_size = 0;  // not a whole number of records
  std::uint64_t refused = 0;     // records that are not finite or out of range
};

struct DatagramOptions {
  std::string host = "127.0.0.1";         // the address to listen at; "0.0.0.0": all
  std::uint16_t port = kOpenSeeFacePort;  // 0: any
  FaceChoice choice;
};

// "udp://HOST:PORT", "udp://HOST", "udp://:PORT". Throws std::invalid_argument with one line for people.
DatagramOptions parseDatagramAddress(const std::string& spec);

// Thread-bound. Allocates nothing after the first frame.
class LandmarkDatagrams {
 public:
  // Binds. Throws DeviceError: port in use, no such address.
  explicit LandmarkDatagrams(const DatagramOptions& options);
  ~LandmarkDatagrams();
  LandmarkDatagrams(const LandmarkDatagrams&) = delete;
  LandmarkDatagrams& operator=(const LandmarkDatagrams&) = delete;

  // Waits for the next face; the newest wins, passed-over ones leave a gap in capture_seq. OpenSeeFace sends nothing
  // while it sees nobody: then this is Next::nothing. t_capture_ns: monotonic, spaced as the sender's own times where
  // these make sense, never later than the arrival.
  Next next(LandmarkFrame& out, std::chrono::nanoseconds timeout);

  std::uint16_t port() const;  // really bound
  const DatagramCounters& counters() const;
  // Who sends rubbish, and what is wrong with it; empty when all is well.
  const std::string& notice() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::capture
