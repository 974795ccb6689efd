// LandmarkFrame: the points of a face as a detector or a file gave them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace volto {

// Which points, in which order. do not change the values: they are on the wire and in takes.
enum class LandmarkLayout : std::uint8_t {
  ibug68 = 0,         // iBUG / Multi-PIE, 68 points, 0-based
  openseeface66 = 1,  // OpenSeeFace
  mediapipe478 = 2,   // MediaPipe face mesh with irises
};

constexpr std::size_t landmarkCount(LandmarkLayout layout) {
  switch (layout) {
    case LandmarkLayout::ibug68: return 68;
    case LandmarkLayout::openseeface66: return 66;
    case LandmarkLayout::mediapipe478: return 478;
  }
  return 0;
}

// Where an eye's pupil is in the image.
struct Pupil {
  float x_px = 0.0F, y_px = 0.0F;
  float confidence = 0.0F;  // 0..1; 0: not seen (closed, turned away), the position means nothing
};

struct LandmarkFrame {
  std::int64_t t_capture_ns = 0;   // monotonic clock, or nanoseconds since the start of the recording
  std::uint64_t capture_seq = 0;   // +1 per captured frame; a gap is frames lost before this point
  LandmarkLayout layout = LandmarkLayout::ibug68;
  bool face_present = false;       // false: the point arrays may be empty or stale and are not read
  float confidence = 0.0F;         // 0..1, the detector's own
  int image_width_px = 0;          // 0: unknown
  int image_height_px = 0;
  double focal_length_px = 0.0;    // 0: unknown

  // One entry per point of the layout, image frame (x right, y down), pixels.
  std::vector<std::array<float, 2>> points_px;
  // Empty, or one entry per point: camera frame (x right, y down, z away), millimetres.
  std::vector<std::array<float, 3>> points_camera_mm;
  // Empty, or one entry per point, 0..1.
  std::vector<float> point_confidence;
  // The subject's right and left eye.
  std::array<Pupil, 2> pupils{};
};

}  // namespace volto
