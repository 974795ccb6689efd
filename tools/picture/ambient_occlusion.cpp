#include "tools/picture/ambient_occlusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace volto::picture {
namespace {

constexpr int kTaps = 9;
constexpr int kPattern = 4;
constexpr float kTurns = 4.0F;

// Rounds; a call of lrint() for each would cost more than all the rest.
int nearest(float x) { return static_cast<int>(x + 16384.5F) - 16384; }

}  // namespace

void ambientOcclusion(const OcclusionInput& in, std::vector<float>& out_open) {
  const std::size_t pixels = in.depth.size();
  out_open.assign(pixels, 1.0F);
  // Directions of a spiral, turned differently at each place of the pattern.
  std::array<std::array<std::array<float, 3>, kTaps>, kPattern * kPattern> spiral;
  for (std::size_t p = 0; p < spiral.size(); ++p) {
    // A bit-reversed order keeps neighbouring turns far apart.
    const auto reversed = static_cast<float>(((p & 1U) << 3) | ((p & 2U) << 1) | ((p & 4U) >> 1) | ((p & 8U) >> 3));
    for (std::size_t k = 0; k < kTaps; ++k) {
      const float t = (static_cast<float>(k) + (reversed + 0.5F) / 16.0F) / static_cast<float>(kTaps);
      const float angle = 2.0F * std::numbers::pi_v<float> * (kTurns * t + reversed / 16.0F);
      spiral[p][k] = {std::cos(angle) * t, std::sin(angle) * t, t};
    }
  }
  std::vector<float> raw(pixels, 1.0F);
  const float radius_square = in.radius * in.radius;
  const auto positionAt = [&](int x, int y, float depth) {
    const float scale = depth / in.focal_px;
    return Vec3{(static_cast<float>(x) + 0.5F - in.middle_x) * scale,
                (in.middle_y - static_cast<float>(y) - 0.5F) * scale, -depth};
  };
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(in.width) + static_cast<std::size_t>(x);
      const float depth = in.depth[at];
      if (depth <= 0.0F) continue;
      const Vec3 here = positionAt(x, y, depth), normal = in.normal[at];
      const float reach = std::clamp(in.radius * in.focal_px / depth, 3.0F, 0.25F * static_cast<float>(in.width));
      float hidden = 0.0F;
      for (const auto& tap : spiral[static_cast<std::size_t>((y % kPattern) * kPattern + x % kPattern)]) {
        const int sx = x + nearest(tap[0] * reach), sy = y + nearest(tap[1] * reach);
        if (sx < 0 || sy < 0 || sx >= in.width || sy >= in.height) continue;
        const float other =
            in.depth[static_cast<std::size_t>(sy) * static_cast<std::size_t>(in.width) + static_cast<std::size_t>(sx)];
        if (other <= 0.0F) continue;
        const Vec3 towards = positionAt(sx, sy, other) - here;
        const float square = dot(towards, towards);
        if (square > radius_square || square <= 0.0F) continue;
        const float rise = dot(towards, normal) / std::sqrt(square) - 0.10F;
        const float near = 1.0F - square / radius_square;
        hidden += std::max(0.0F, rise) * near * (0.35F + tap[2]);
      }
      raw[at] = std::max(0.0F, 1.0F - 2.6F * hidden / static_cast<float>(kTaps));
    }
  }
  // The mean over one period of the pattern, without crossing from one surface to another.
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(in.width) + static_cast<std::size_t>(x);
      const float depth = in.depth[at];
      if (depth <= 0.0F) continue;
      float sum = 0.0F, weight = 0.0F;
      for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i) {
          const int sx = x + i, sy = y + j;
          if (sx < 0 || sy < 0 || sx >= in.width || sy >= in.height) continue;
          const std::size_t other =
              static_cast<std::size_t>(sy) * static_cast<std::size_t>(in.width) + static_cast<std::size_t>(sx);
          if (in.depth[other] <= 0.0F || std::abs(in.depth[other] - depth) > 0.15F * in.radius) continue;
          // Half weight at the ends makes the window exactly four wide.
          const float w = (std::abs(i) == 2 ? 0.5F : 1.0F) * (std::abs(j) == 2 ? 0.5F : 1.0F);
          sum += w * raw[other];
          weight += w;
        }
      }
      out_open[at] = weight > 0.0F ? sum / weight : raw[at];
    }
  }
}

}  // namespace volto::picture
