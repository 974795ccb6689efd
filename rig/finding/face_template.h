// What a face is compared with: the generic head (rig/fitting) as a relief and as points.
#pragma once

#include <array>
#include <vector>

#include "rig/feature_points.h"
#include "rig/finding/nearest_point.h"
#include "rig/finding/relief.h"

namespace volto::rig {

struct FaceTemplate {
  // Points of the outside of the left half of the head and the upper neck, x >= 0, with normals out of it; more of
  // them on the face than on the skull. In an order in which any first part is spread over the whole.
  std::vector<Eigen::Vector3d> points, normals;
  std::vector<bool> on_face;
  std::array<Relief, 2> relief;  // at kCoarsePixel and kFinePixel
  std::array<Grid, 2> mask;      // how much a pixel counts: the face from brows to chin, softly
  // Soft windows around the left eye, the right eye, the nose and the mouth.
  std::array<std::array<Grid, 4>, 2> parts;
  FeaturePointPositions landmarks;  // head frame, eye separations
};

inline constexpr double kCoarsePixel = 0.05;
inline constexpr double kFinePixel = 0.025;

// 1 at a place of the relief, falling off within `radius` eye separations.
Grid softWindow(const Relief& relief, const Eigen::Vector2d& centre, double radius);

// Made once, on first use (a tenth of a second or two).
const FaceTemplate& faceTemplate();

}  // namespace volto::rig
