// A face seen from in front: depth over a grid in the head frame, and what its form is at several scales.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "rig/finding/face_frame.h"
#include "rig/finding/surface_samples.h"

namespace volto::rig {

// A picture of numbers, row by row from the lowest y, each row from the lowest x (the subject's right).
struct Grid {
  int width = 0, height = 0;
  std::vector<float> value;

  Grid() = default;
  Grid(int w, int h, float v = 0) : width(w), height(h), value(static_cast<std::size_t>(w) * h, v) {}
  float& at(int i, int j) { return value[static_cast<std::size_t>(j) * width + i]; }
  float at(int i, int j) const { return value[static_cast<std::size_t>(j) * width + i]; }
  // Between the pixels, linearly; the border goes on for ever. (i, j) in pixels, whole at their centres.
  float sample(float i, float j) const;
};

// Gaussian blur, sigma in pixels, in place; the border goes on for ever.
void blur(Grid& grid, float sigma);

// The window of the head frame, eye separations: the middle of the face, symmetric in x.
inline constexpr double kReliefX = 1.4;            // from -x to x
inline constexpr double kReliefLow = -2.3;         // y
inline constexpr double kReliefHigh = 1.3;         // y
inline constexpr float kReliefBackground = -1.2F;  // z of what is farther back or not there

struct Relief {
  double pixel = 0.025;  // eye separations
  Grid depth;            // z in the head frame, holes filled from the nearest pixel, not under kReliefBackground
  Grid seen;             // 1 where the surface is, else 0

  static Eigen::Vector2d pixelsOf(double x, double y, double pixel) {
    return {(x + kReliefX) / pixel - 0.5, (y - kReliefLow) / pixel - 0.5};
  }
  static Eigen::Vector2d positionOf(double i, double j, double pixel) {
    return {-kReliefX + (i + 0.5) * pixel, kReliefLow + (j + 0.5) * pixel};
  }
};

// Draws the triangles' nearest parts (z up to `front` eye separations) into a depth picture. O(triangles).
Relief renderRelief(const NormalisedSurface& surface, const FaceFrame& frame, double pixel);

// Three pictures of the form at a scale (eye separations): the normal's x and y, and the mean curvature times scale,
// squashed into -1..1 (a groove is positive).
using ReliefForm = std::array<Grid, 3>;
ReliefForm reliefForm(const Relief& relief, double scale);

}  // namespace volto::rig
