// Which triangle is nearest at every sample: the z-buffer.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/picture/camera.h"

namespace volto::picture {

inline constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFU;

struct VisibilityBuffer {
  int width = 0, height = 0;            // samples
  std::vector<std::uint32_t> triangle;  // kNoTriangle: nothing there
  std::vector<float> inverse_depth;     // 0: nothing there; larger is nearer
};

// Rasterises `triangles` (vertex indices into `points`) into `out`, `samples` per pixel and side; sample (i, j) lies at
// pixel position
// ((i + 0.5) / samples, (j + 0.5) / samples). Both sides of a triangle are drawn; neighbours neither overlap nor leave
// gaps (top-left rule on a grid of 1/16 sample). Left out: triangles without area, with a point that is not finite,
// nearer than `near_depth` or behind the viewer.
void rasterise(std::span<const Camera::Point> points, std::span<const std::array<std::uint32_t, 3>> triangles,
               int width_px, int height_px, int samples, float near_depth, VisibilityBuffer& out);

}  // namespace volto::picture
