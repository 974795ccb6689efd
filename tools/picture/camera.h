// Where the viewer stands: a perspective camera fitted to a head.
#pragma once

#include <array>
#include <span>

#include "tools/picture/vec3.h"

namespace volto::picture {

enum class Lighting {
  studio,   // key light from the upper left, fill from the right, rim light from behind
  frontal,  // mirror symmetric
};

struct ViewOptions {
  int width_px = 512, height_px = 512;
  // How the head is turned for the viewer. Yaw > 0: to the subject's left (its right side is seen), pitch > 0: up, roll
  // > 0: the top toward the subject's left.
  float yaw_deg = 0.0F, pitch_deg = 0.0F, roll_deg = 0.0F;
  // HeadPose::rotation (frames/mask_frame.h) of a tracked head, applied before the angles above.
  std::array<float, 4> head_rotation{0.0F, 0.0F, 0.0F, 1.0F};
  // Rotation from the mesh's frame to the head frame (+x subject's left, +y up, +z out of the face): transpose of
  // rig::Rig::mesh_from_head.
  Mat3 head_from_mesh;
  float field_of_view_deg = 20.0F;         // of the shorter side
  float margin = 0.06F;                    // empty border around the fitted points, as a part of the picture's side
  float zoom = 1.0F;                       // 1: fitted; 2: twice as large about the middle
  std::array<float, 2> shift{0.0F, 0.0F};  // moves the head by parts of the picture's sides: +x right, +y down
  Lighting lighting = Lighting::studio;
  int samples = 2;  // per pixel and side, 1 .. 4
  std::array<float, 3> background_top{0.055F, 0.06F, 0.07F}, background_bottom{0.012F, 0.013F, 0.016F};  // linear RGB
};

constexpr ViewOptions frontView(int size_px = 512) {
  ViewOptions view;
  view.width_px = view.height_px = size_px;
  return view;
}
constexpr ViewOptions threeQuarterView(int size_px = 512) {
  ViewOptions view = frontView(size_px);
  view.yaw_deg = -35.0F;
  return view;
}
constexpr ViewOptions sideView(int size_px = 512) {
  ViewOptions view = frontView(size_px);
  view.yaw_deg = -90.0F;
  return view;
}

// View space: +x right, +y up, +z toward the viewer, origin in the middle of the fitted points.
struct Camera {
  Mat3 view_from_mesh;
  Vec3 centre;            // mesh frame
  float distance = 1.0F;  // of the viewer from the origin of view space
  float focal_px = 1.0F;
  float middle_x = 0.0F, middle_y = 0.0F;  // where the origin is drawn, pixels

  Vec3 viewFromMesh(Vec3 p) const { return view_from_mesh * (p - centre); }
  struct Point {
    float x_px, y_px;  // image frame, pixels
    float depth;       // from the viewer along the line of sight's axis, mesh unit; <= 0: behind the viewer
  };
  Point projectView(Vec3 v) const {
    const float depth = distance - v.z, scale = focal_px / depth;
    return {middle_x + v.x * scale, middle_y - v.y * scale, depth};
  }
  Point project(Vec3 p) const { return projectView(viewFromMesh(p)); }
};

// Fits the view's angles (not head_rotation, so that a moving head moves in a still picture) to `points` of the mesh
// frame. Points that are not finite are passed over. Throws std::invalid_argument when none is left or an option is out
// of range.
Camera fitCamera(std::span<const Vec3> points, const ViewOptions& view);

}  // namespace volto::picture
