#include "tools/picture/visibility.h"

#include <algorithm>
#include <cmath>

namespace volto::picture {
namespace {

constexpr int kSubBits = 4;
constexpr std::int64_t kSub = 1 << kSubBits;
constexpr float kFarthest = 1e6F;  // samples; a point beyond is taken as not drawable

struct Grid {
  std::int64_t x, y;
};

// A vertex on the grid; inverse_depth 0: not drawable.
struct Corner {
  Grid at{0, 0};
  float inverse_depth = 0.0F;
};

// Does an edge from a to b belong to the triangle on its left? (y down, counter-clockwise on screen as positive area
// here.)
bool ownsEdge(Grid a, Grid b) { return (b.y == a.y && b.x < a.x) || b.y > a.y; }

}  // namespace

void rasterise(std::span<const Camera::Point> points, std::span<const std::array<std::uint32_t, 3>> triangles,
               int width_px, int height_px, int samples, float near_depth, VisibilityBuffer& out) {
  out.width = width_px * samples;
  out.height = height_px * samples;
  const std::size_t count = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  out.triangle.assign(count, kNoTriangle);
  out.inverse_depth.assign(count, 0.0F);
  const auto scale = static_cast<float>(samples);

  std::vector<Corner> corners(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Camera::Point& p = points[v];
    const float x = p.x_px * scale, y = p.y_px * scale;
    if (!(p.depth > near_depth && p.depth < 1e30F && std::abs(x) < kFarthest && std::abs(y) < kFarthest)) continue;
    corners[v] = {{std::lrint(x * static_cast<float>(kSub)), std::lrint(y * static_cast<float>(kSub))}, 1.0F / p.depth};
  }

  for (std::size_t t = 0; t < triangles.size(); ++t) {
    Grid grid[3];
    float inverse[3];
    for (std::size_t k = 0; k < 3; ++k) {
      grid[k] = corners[triangles[t][k]].at;
      inverse[k] = corners[triangles[t][k]].inverse_depth;
    }
    if (inverse[0] == 0.0F || inverse[1] == 0.0F || inverse[2] == 0.0F) continue;
    std::int64_t area =
        (grid[1].x - grid[0].x) * (grid[2].y - grid[0].y) - (grid[1].y - grid[0].y) * (grid[2].x - grid[0].x);
    if (area == 0) continue;
    if (area < 0) {
      std::swap(grid[1], grid[2]);
      std::swap(inverse[1], inverse[2]);
      area = -area;
    }
    // Samples lie at half steps of the grid's whole numbers.
    const auto firstSample = [](std::int64_t v) { return (v - kSub / 2 + kSub - 1) >> kSubBits; };
    const auto lastSample = [](std::int64_t v) { return (v - kSub / 2) >> kSubBits; };
    const std::int64_t x0 = std::max<std::int64_t>(0, firstSample(std::min({grid[0].x, grid[1].x, grid[2].x})));
    const std::int64_t x1 =
        std::min<std::int64_t>(out.width - 1, lastSample(std::max({grid[0].x, grid[1].x, grid[2].x})));
    const std::int64_t y0 = std::max<std::int64_t>(0, firstSample(std::min({grid[0].y, grid[1].y, grid[2].y})));
    const std::int64_t y1 =
        std::min<std::int64_t>(out.height - 1, lastSample(std::max({grid[0].y, grid[1].y, grid[2].y})));
    if (x0 > x1 || y0 > y1) continue;

    const std::int64_t start_x = x0 * kSub + kSub / 2, start_y = y0 * kSub + kSub / 2;
    std::int64_t edge[3], step_x[3], step_y[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Grid a = grid[(k + 1) % 3], b = grid[(k + 2) % 3];
      edge[k] = (b.x - a.x) * (start_y - a.y) - (b.y - a.y) * (start_x - a.x) - (ownsEdge(a, b) ? 0 : 1);
      step_x[k] = -(b.y - a.y) * kSub;
      step_y[k] = (b.x - a.x) * kSub;
    }
    // 1 / depth is linear on the screen.
    const double per_area = 1.0 / static_cast<double>(area);
    const double d1 = static_cast<double>(inverse[1]) - inverse[0], d2 = static_cast<double>(inverse[2]) - inverse[0];
    const auto slope_x = static_cast<float>(
        (d1 * static_cast<double>(grid[2].y - grid[0].y) - d2 * static_cast<double>(grid[1].y - grid[0].y)) * per_area *
        kSub);
    const auto slope_y = static_cast<float>(
        (d2 * static_cast<double>(grid[1].x - grid[0].x) - d1 * static_cast<double>(grid[2].x - grid[0].x)) * per_area *
        kSub);
    const float origin_x = static_cast<float>(start_x - grid[0].x) / static_cast<float>(kSub);
    const float origin_y = static_cast<float>(start_y - grid[0].y) / static_cast<float>(kSub);
    // Rounding on slivers must not bring a sample nearer than the triangle is.
    const float nearest = std::max({inverse[0], inverse[1], inverse[2]}),
                farthest = std::min({inverse[0], inverse[1], inverse[2]});

    for (std::int64_t y = y0; y <= y1; ++y) {
      std::int64_t e0 = edge[0], e1 = edge[1], e2 = edge[2];
      const float row = inverse[0] + slope_y * (origin_y + static_cast<float>(y - y0)) + slope_x * origin_x;
      const std::size_t line = static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width);
      for (std::int64_t x = x0; x <= x1; ++x) {
        if ((e0 | e1 | e2) >= 0) {
          const float depth = std::clamp(row + slope_x * static_cast<float>(x - x0), farthest, nearest);
          const std::size_t at = line + static_cast<std::size_t>(x);
          if (depth > out.inverse_depth[at]) {
            out.inverse_depth[at] = depth;
            out.triangle[at] = static_cast<std::uint32_t>(t);
          }
        }
        e0 += step_x[0];
        e1 += step_x[1];
        e2 += step_x[2];
      }
      for (std::size_t k = 0; k < 3; ++k) edge[k] += step_y[k];
    }
  }
}

}  // namespace volto::picture
