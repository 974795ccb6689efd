#include "rig/finding/relief_flow.h"

#include <algorithm>
#include <cmath>

namespace volto::rig {
namespace {

constexpr float kFurthest = 0.4F;  // eye separations: no pixel is shifted more

void mirror(ReliefFlow& flow) {
  Grid& x = flow.shift[0];
  Grid& y = flow.shift[1];
  for (int j = 0; j < x.height; ++j)
    for (int i = 0, m = x.width - 1; i <= m; ++i, --m) {
      const float dx = (x.at(i, j) - x.at(m, j)) / 2;
      const float dy = (y.at(i, j) + y.at(m, j)) / 2;
      x.at(i, j) = dx;
      x.at(m, j) = -dx;
      y.at(i, j) = y.at(m, j) = dy;
    }
}

Grid warped(const Grid& grid, const ReliefFlow& flow) {
  Grid result(grid.width, grid.height);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      result.at(i, j) =
          grid.sample(static_cast<float>(i) + flow.shift[0].at(i, j), static_cast<float>(j) + flow.shift[1].at(i, j));
  return result;
}

ReliefFlow resampled(const ReliefFlow& flow, double pixel, int width, int height) {
  ReliefFlow result{pixel, {Grid(width, height), Grid(width, height)}};
  const float ratio = static_cast<float>(flow.pixel / pixel);
  for (int axis = 0; axis < 2; ++axis)
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i)
        result.shift[axis].at(i, j) = ratio * flow.shift[axis].sample((static_cast<float>(i) + 0.5F) / ratio - 0.5F,
                                                                      (static_cast<float>(j) + 0.5F) / ratio - 0.5F);
  return result;
}

float slopeX(const Grid& g, int i, int j) {
  return (g.at(std::min(i + 1, g.width - 1), j) - g.at(std::max(i - 1, 0), j)) / 2;
}
float slopeY(const Grid& g, int i, int j) {
  return (g.at(i, std::min(j + 1, g.height - 1)) - g.at(i, std::max(j - 1, 0))) / 2;
}

void step(const ReliefForm& first, const ReliefForm& second, const Grid& mask, float stiffness_px, ReliefFlow& flow) {
  const int w = mask.width;
  const int h = mask.height;
  ReliefForm other;
  for (int c = 0; c < 3; ++c) other[c] = warped(second[c], flow);
  // Normal equations of the local shift: [xx xy; xy yy] d = [xd yd]
  std::array<Grid, 5> sums;
  for (Grid& g : sums) g = Grid(w, h);
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i) {
      if (mask.at(i, j) == 0) continue;
      float xx = 0, xy = 0, yy = 0, xd = 0, yd = 0, square = 0;
      for (int c = 0; c < 3; ++c) {
        const float gx = (slopeX(first[c], i, j) + slopeX(other[c], i, j)) / 2;
        const float gy = (slopeY(first[c], i, j) + slopeY(other[c], i, j)) / 2;
        const float d = first[c].at(i, j) - other[c].at(i, j);
        xx += gx * gx, xy += gx * gy, yy += gy * gy, xd += gx * d, yd += gy * d, square += d * d;
      }
      const float weight = mask.at(i, j) / (1 + square / 0.1F);
      const float values[5] = {xx, xy, yy, xd, yd};
      for (int k = 0; k < 5; ++k) sums[k].at(i, j) = weight * values[k];
    }
  for (Grid& g : sums) blur(g, 0.5F * stiffness_px);
  float most = 0;
  for (std::size_t k = 0; k < mask.value.size(); ++k) most = std::max(most, sums[0].value[k] + sums[2].value[k]);
  const float damping = 0.02F * most + 1e-9F;
  for (std::size_t k = 0; k < mask.value.size(); ++k) {
    const float a = sums[0].value[k] + damping;
    const float b = sums[1].value[k];
    const float c = sums[2].value[k] + damping;
    const float det = a * c - b * b;
    flow.shift[0].value[k] += (c * sums[3].value[k] - b * sums[4].value[k]) / det;
    flow.shift[1].value[k] += (a * sums[4].value[k] - b * sums[3].value[k]) / det;
  }
  mirror(flow);
  const float furthest = kFurthest / static_cast<float>(flow.pixel);
  for (Grid& g : flow.shift) blur(g, 0.4F * stiffness_px);
  for (std::size_t k = 0; k < mask.value.size(); ++k) {
    const float length = std::hypot(flow.shift[0].value[k], flow.shift[1].value[k]);
    if (length <= furthest) continue;
    flow.shift[0].value[k] *= furthest / length;
    flow.shift[1].value[k] *= furthest / length;
  }
}

}  // namespace

Eigen::Vector2d ReliefFlow::carry(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d at = Relief::pixelsOf(p.x(), p.y(), pixel);
  const float i = static_cast<float>(at.x());
  const float j = static_cast<float>(at.y());
  return p + pixel * Eigen::Vector2d(shift[0].sample(i, j), shift[1].sample(i, j));
}

ReliefFlow registerReliefs(const Relief& first, const Relief& second, const Grid& mask,
                           std::span<const FlowLevel> levels, const ReliefFlow* start) {
  const int w = first.depth.width;
  const int h = first.depth.height;
  ReliefFlow flow{first.pixel, {Grid(w, h), Grid(w, h)}};
  if (start != nullptr) flow = resampled(*start, first.pixel, w, h);
  for (const FlowLevel& level : levels) {
    const ReliefForm a = reliefForm(first, level.scale);
    const ReliefForm b = reliefForm(second, level.scale);
    for (int i = 0; i < level.iterations; ++i)
      step(a, b, mask, static_cast<float>(level.stiffness / first.pixel), flow);
  }
  return flow;
}

std::vector<ReliefLikeness> compareReliefs(const Relief& first, const Relief& second, std::span<const Grid> masks,
                                           const ReliefFlow& flow, double scale) {
  ReliefForm a = reliefForm(first, scale);
  ReliefForm b = reliefForm(second, scale);
  const float large = static_cast<float>(5 * scale / first.pixel);
  for (std::size_t c = 0; c < 3; ++c) {
    b[c] = warped(b[c], flow);
    for (Grid* grid : {&a[c], &b[c]}) {
      Grid smooth = *grid;
      blur(smooth, large);
      for (std::size_t k = 0; k < smooth.value.size(); ++k) grid->value[k] -= smooth.value[k];
    }
  }
  std::vector<ReliefLikeness> result;
  for (const Grid& mask : masks) {
    std::array<double, 3> ab{}, aa{}, bb{};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < mask.value.size(); ++k) {
        const double x = a[c].value[k];
        const double y = b[c].value[k];
        const double weight = mask.value[k];
        ab[c] += weight * x * y;
        aa[c] += weight * x * x;
        bb[c] += weight * y * y;
      }
    // What is nearly flat is like nothing: a quarter of the first one's form is asked for at least.
    auto correlation = [](double xy, double xx, double yy) {
      return xy / std::sqrt(xx * std::max(yy, xx / 16) + 1e-12);
    };
    result.push_back({correlation(ab[0] + ab[1], aa[0] + aa[1], bb[0] + bb[1]), correlation(ab[2], aa[2], bb[2])});
  }
  return result;
}

}  // namespace volto::rig
