// Image: one picture of a camera, a video or an image sequence.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace volto::capture {

// Colour, 8 bits, no padding: pixel (x, y) is bgr[3 * (y * width + x)] and the two bytes after it, blue first (what OpenCV calls CV_8UC3).
// The vector keeps its capacity: a caller that gives the same Image again and again causes no allocation once it has the largest size.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> bgr;
  std::int64_t t_capture_ns = 0;  // CLOCK_MONOTONIC for a camera, nanoseconds since the first frame for a file; rises from frame to frame
  std::uint64_t capture_seq = 0;  // +1 per picture that the source made; a gap is pictures that were lost or dropped before this one

  void resize(int new_width, int new_height) {
    width = new_width;
    height = new_height;
    bgr.resize(static_cast<std::size_t>(new_width) * static_cast<std::size_t>(new_height) * 3);
  }
};

// Nobody's picture is larger than this; a header that says so is wrong.
inline constexpr int kMaxImageSide = 8192;

}  // namespace volto::capture
