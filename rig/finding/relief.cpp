#include "rig/finding/relief.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace volto::rig {
namespace {

constexpr double kFront = 1.4;  // eye separations: what is farther in front is no part of a face
constexpr float kNothing = -std::numeric_limits<float>::infinity();

void blurLine(const float* in, float* out, int n, int step, const std::vector<float>& kernel,
              std::vector<float>& padded) {
  const int radius = static_cast<int>(kernel.size()) - 1;
  padded.resize(static_cast<std::size_t>(n + 2 * radius));
  for (int i = 0; i < n + 2 * radius; ++i) padded[i] = in[static_cast<long>(std::clamp(i - radius, 0, n - 1)) * step];
  for (int i = 0; i < n; ++i) {
    const float* middle = padded.data() + i + radius;
    float sum = kernel[0] * middle[0];
    for (int k = 1; k <= radius; ++k) sum += kernel[k] * (middle[k] + middle[-k]);
    out[static_cast<long>(i) * step] = sum;
  }
}

void drawTriangle(Grid& depth, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  if (area == 0) return;
  const int low_j = std::max(0, static_cast<int>(std::ceil(std::min({a.y(), b.y(), c.y()}))));
  const int high_j = std::min(depth.height - 1, static_cast<int>(std::floor(std::max({a.y(), b.y(), c.y()}))));
  const int low_i = std::max(0, static_cast<int>(std::ceil(std::min({a.x(), b.x(), c.x()}))));
  const int high_i = std::min(depth.width - 1, static_cast<int>(std::floor(std::max({a.x(), b.x(), c.x()}))));
  for (int j = low_j; j <= high_j; ++j)
    for (int i = low_i; i <= high_i; ++i) {
      const double u = ((b.x() - i) * (c.y() - j) - (b.y() - j) * (c.x() - i)) / area;
      const double v = ((c.x() - i) * (a.y() - j) - (c.y() - j) * (a.x() - i)) / area;
      if (u < 0 || v < 0 || u + v > 1) continue;
      const double z = u * a.z() + v * b.z() + (1 - u - v) * c.z();
      if (z > kFront) continue;
      depth.at(i, j) = std::max(depth.at(i, j), static_cast<float>(z));
    }
}

// Holes take the depth of the nearest pixel that has one: two sweeps that carry where it is.
void fillHoles(Grid& depth) {
  const int w = depth.width;
  const int h = depth.height;
  std::vector<int> from(depth.value.size(), -1);
  for (std::size_t k = 0; k < from.size(); ++k)
    if (depth.value[k] > kNothing) from[k] = static_cast<int>(k);
  auto offer = [&](int i, int j, int ni, int nj) {
    if (ni < 0 || nj < 0 || ni >= w || nj >= h) return;
    const int there = from[static_cast<std::size_t>(nj) * w + ni];
    if (there < 0) return;
    int& mine = from[static_cast<std::size_t>(j) * w + i];
    auto squared = [&](int k) { return (k % w - i) * (k % w - i) + (k / w - j) * (k / w - j); };
    if (mine < 0 || squared(there) < squared(mine)) mine = there;
  };
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i)
      offer(i, j, i - 1, j), offer(i, j, i - 1, j - 1), offer(i, j, i, j - 1), offer(i, j, i + 1, j - 1);
    for (int i = w - 1; i >= 0; --i) offer(i, j, i + 1, j);
  }
  for (int j = h - 1; j >= 0; --j) {
    for (int i = w - 1; i >= 0; --i)
      offer(i, j, i + 1, j), offer(i, j, i + 1, j + 1), offer(i, j, i, j + 1), offer(i, j, i - 1, j + 1);
    for (int i = 0; i < w; ++i) offer(i, j, i - 1, j);
  }
  const std::vector<float> original = depth.value;
  for (std::size_t k = 0; k < from.size(); ++k)
    depth.value[k] = from[k] < 0 ? kReliefBackground : std::max(kReliefBackground, original[from[k]]);
}

}  // namespace

float Grid::sample(float i, float j) const {
  i = std::clamp(i, 0.0F, static_cast<float>(width - 1));
  j = std::clamp(j, 0.0F, static_cast<float>(height - 1));
  const int i0 = std::min(static_cast<int>(i), width - 2);
  const int j0 = std::min(static_cast<int>(j), height - 2);
  const float u = i - static_cast<float>(i0);
  const float v = j - static_cast<float>(j0);
  const float* p = value.data() + static_cast<std::size_t>(j0) * width + i0;
  return (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[width] + u * p[width + 1]);
}

void blur(Grid& grid, float sigma) {
  if (!(sigma > 0.2F)) return;
  std::vector<float> kernel(static_cast<std::size_t>(std::ceil(3 * sigma)) + 1);
  float sum = 0;
  for (std::size_t k = 0; k < kernel.size(); ++k) {
    const float t = static_cast<float>(k) / sigma;
    kernel[k] = std::exp(-0.5F * t * t);
    sum += (k == 0 ? 1 : 2) * kernel[k];
  }
  for (float& k : kernel) k /= sum;
  std::vector<float> padded;
  const std::size_t w = static_cast<std::size_t>(grid.width);
  for (int j = 0; j < grid.height; ++j)
    blurLine(grid.value.data() + j * w, grid.value.data() + j * w, grid.width, 1, kernel, padded);
  for (int i = 0; i < grid.width; ++i)
    blurLine(grid.value.data() + i, grid.value.data() + i, grid.height, grid.width, kernel, padded);
}

Relief renderRelief(const NormalisedSurface& surface, const FaceFrame& frame, double pixel) {
  const int width = static_cast<int>(std::lround(2 * kReliefX / pixel));
  const int height = static_cast<int>(std::lround((kReliefHigh - kReliefLow) / pixel));
  Relief relief{pixel, Grid(width, height, kNothing), Grid(width, height)};
  // pixel = (R^T (p - origin) / size) / pixel + shift, depth stays in eye separations
  Eigen::Matrix3d linear = frame.mesh_from_head.transpose() / frame.size;
  Eigen::Vector3d constant = -(linear * frame.origin);
  linear.topRows<2>() /= pixel;
  constant.x() = (constant.x() + kReliefX) / pixel - 0.5;
  constant.y() = (constant.y() - kReliefLow) / pixel - 0.5;
  const std::size_t vertices = static_cast<std::size_t>(surface.positions.rows());
  std::vector<Eigen::Vector3d> projected(vertices);
  for (std::size_t v = 0; v < vertices; ++v)
    projected[v].noalias() = linear * surface.positions.row(static_cast<Eigen::Index>(v)).transpose() + constant;
  for (const Triangle& t : surface.triangles) {
    const Eigen::Vector3d& a = projected[t[0]];
    const Eigen::Vector3d& b = projected[t[1]];
    const Eigen::Vector3d& c = projected[t[2]];
    if (std::max({a.z(), b.z(), c.z()}) < -2 || std::min({a.z(), b.z(), c.z()}) > kFront) continue;
    drawTriangle(relief.depth, a, b, c);
    // A triangle between the pixels' centres would leave no trace.
    for (const Eigen::Vector3d* p : {&a, &b, &c}) {
      const double i = std::round(p->x());
      const double j = std::round(p->y());
      if (i < 0 || j < 0 || i >= width || j >= height || p->z() > kFront) continue;
      float& z = relief.depth.at(static_cast<int>(i), static_cast<int>(j));
      z = std::max(z, static_cast<float>(p->z()));
    }
  }
  for (std::size_t k = 0; k < relief.seen.value.size(); ++k)
    relief.seen.value[k] = relief.depth.value[k] > kReliefBackground ? 1.0F : 0.0F;
  fillHoles(relief.depth);
  return relief;
}

ReliefForm reliefForm(const Relief& relief, double scale) {
  Grid smooth = relief.depth;
  const float px = static_cast<float>(relief.pixel);
  blur(smooth, static_cast<float>(scale) / px);
  const int w = smooth.width;
  const int h = smooth.height;
  ReliefForm form{Grid(w, h), Grid(w, h), Grid(w, h)};
  const float k = static_cast<float>(scale) / (px * px);
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i) {
      const float left = smooth.at(std::max(i - 1, 0), j);
      const float right = smooth.at(std::min(i + 1, w - 1), j);
      const float down = smooth.at(i, std::max(j - 1, 0));
      const float up = smooth.at(i, std::min(j + 1, h - 1));
      const float gx = (right - left) / (2 * px);
      const float gy = (up - down) / (2 * px);
      const float length = std::sqrt(1 + gx * gx + gy * gy);
      form[0].at(i, j) = gx / length;
      form[1].at(i, j) = gy / length;
      form[2].at(i, j) = std::tanh(k * (left + right + up + down - 4 * smooth.at(i, j)) / length);
    }
  return form;
}

}  // namespace volto::rig
