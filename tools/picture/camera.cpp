#include "tools/picture/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace volto::picture {
namespace {

bool finite(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

float radians(float degrees) { return degrees * std::numbers::pi_v<float> / 180.0F; }

// Turns by yaw about +y, then pitch (up is positive), then roll.
Mat3 turned(const ViewOptions& view) {
  const float cy = std::cos(radians(view.yaw_deg)), sy = std::sin(radians(view.yaw_deg));
  const float cp = std::cos(radians(view.pitch_deg)), sp = std::sin(radians(view.pitch_deg));
  const float cr = std::cos(radians(view.roll_deg)), sr = std::sin(radians(view.roll_deg));
  const Mat3 yaw{{cy, 0, sy}, {0, 1, 0}, {-sy, 0, cy}};
  const Mat3 pitch{{1, 0, 0}, {0, cp, sp}, {0, -sp, cp}};
  const Mat3 roll{{cr, sr, 0}, {-sr, cr, 0}, {0, 0, 1}};
  return roll * (pitch * yaw);
}

// The tracked rotation is in the camera frame (y down, z away); view space has y up and z toward the viewer.
Mat3 tracked(const std::array<float, 4>& q) {
  const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(norm > 0.0F) || !std::isfinite(norm)) throw std::invalid_argument("the head's rotation is not a quaternion");
  const float x = q[0] / norm, y = -q[1] / norm, z = -q[2] / norm, w = q[3] / norm;
  return {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
}

}  // namespace

Camera fitCamera(std::span<const Vec3> points, const ViewOptions& view) {
  if (!(view.field_of_view_deg >= 1.0F && view.field_of_view_deg <= 120.0F) ||
      !(view.margin >= 0.0F && view.margin < 0.5F) || !(view.zoom > 0.0F && view.zoom < 1000.0F) || view.samples < 1 ||
      view.samples > 4) {
    throw std::invalid_argument(
        "a view needs 1 to 120 degrees, a margin of 0 to 0.5, a zoom above 0 and 1 to 4 samples");
  }
  const Mat3 base = turned(view) * view.head_from_mesh;
  Vec3 low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F};
  for (const Vec3 p : points) {
    if (!finite(p)) continue;
    const Vec3 v = base * p;
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  if (low.x > high.x) throw std::invalid_argument("nothing to draw: no vertex has a finite position");

  Camera camera;
  const Vec3 middle = (low + high) * 0.5F;
  // Back to the mesh's frame: the transpose.
  camera.centre = base.row_x * middle.x + base.row_y * middle.y + base.row_z * middle.z;
  camera.view_from_mesh = turned(view) * tracked(view.head_rotation) * view.head_from_mesh;

  const auto width = static_cast<float>(view.width_px), height = static_cast<float>(view.height_px);
  const float half_angle = std::tan(0.5F * radians(view.field_of_view_deg));
  camera.focal_px = 0.5F * std::min(width, height) / half_angle;
  const float reach_x = 0.5F * width * (1.0F - 2.0F * view.margin) / camera.focal_px;
  const float reach_y = 0.5F * height * (1.0F - 2.0F * view.margin) / camera.focal_px;
  const float size = std::max(length(high - low), 1e-20F);
  camera.distance = 0.5F * (high.z - low.z) + 0.01F * size;
  for (const Vec3 p : points) {
    if (!finite(p)) continue;
    const Vec3 v = base * p - middle;
    camera.distance = std::max({camera.distance, v.z + std::abs(v.x) / reach_x, v.z + std::abs(v.y) / reach_y});
  }
  camera.focal_px *= view.zoom;
  camera.middle_x = width * (0.5F + view.shift[0]);
  camera.middle_y = height * (0.5F + view.shift[1]);
  return camera;
}

}  // namespace volto::picture
