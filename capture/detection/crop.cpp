#include "capture/detection/crop.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>

namespace volto::capture {
namespace {

using Point = std::array<float, 2>;

Point meanOf(std::span<const Point> points, std::initializer_list<std::size_t> which) {
  Point sum{};
  for (const std::size_t i : which) {
    sum[0] += points[i][0];
    sum[1] += points[i][1];
  }
  const auto n = static_cast<float>(which.size());
  return {sum[0] / n, sum[1] / n};
}

struct Axes {
  double across_x, across_y;  // from right eye to left eye
  double down_x, down_y;      // from between the eyes to between the mouth corners
  double x, y;                // the middle between eyes and mouth
};

Axes axesOf(const FaceAnchors& p) {
  const double eyes_x = 0.5 * (p[0][0] + p[1][0]), eyes_y = 0.5 * (p[0][1] + p[1][1]);
  const double mouth_x = 0.5 * (p[3][0] + p[4][0]), mouth_y = 0.5 * (p[3][1] + p[4][1]);
  return {p[1][0] - p[0][0], p[1][1] - p[0][1],        mouth_x - eyes_x,
          mouth_y - eyes_y,  0.5 * (eyes_x + mouth_x), 0.5 * (eyes_y + mouth_y)};
}

constexpr int kFixed = 16;  // bits behind the point
constexpr double kOne = 1 << kFixed;
constexpr int kMostTaps = 8;

// One sample between four pixels.
struct Bilinear {
  const Image& image;
  bool black_outside;

  void add(std::int64_t x, std::int64_t y, float* sum) const {
    const auto ix = static_cast<int>(x >> kFixed), iy = static_cast<int>(y >> kFixed);
    const auto fx = static_cast<float>(x & ((1 << kFixed) - 1)) * (1.0F / (1 << kFixed));
    const auto fy = static_cast<float>(y & ((1 << kFixed) - 1)) * (1.0F / (1 << kFixed));
    const float weight[2][2] = {{(1 - fx) * (1 - fy), fx * (1 - fy)}, {(1 - fx) * fy, fx * fy}};
    for (int dy = 0; dy < 2; ++dy) {
      for (int dx = 0; dx < 2; ++dx) {
        int px = ix + dx, py = iy + dy;
        if (px < 0 || py < 0 || px >= image.width || py >= image.height) {
          if (black_outside) continue;
          px = std::clamp(px, 0, image.width - 1);
          py = std::clamp(py, 0, image.height - 1);
        }
        const std::uint8_t* const at =
            image.bgr.data() +
            3 * (static_cast<std::size_t>(py) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(px));
        for (int c = 0; c < 3; ++c) sum[c] += weight[dy][dx] * static_cast<float>(at[c]);
      }
    }
  }
};

}  // namespace

double ImageFromCrop::scale() const { return std::hypot(a, b); }

std::array<float, 2> ImageFromCrop::inverse(double x, double y) const {
  const double square = a * a + b * b;
  const double dx = x - tx, dy = y - ty;
  return {static_cast<float>((a * dx + b * dy) / square), static_cast<float>((a * dy - b * dx) / square)};
}

FaceAnchors anchorsOf(LandmarkLayout layout, std::span<const std::array<float, 2>> points) {
  switch (layout) {
    case LandmarkLayout::ibug68:
      return {meanOf(points, {36, 37, 38, 39, 40, 41}), meanOf(points, {42, 43, 44, 45, 46, 47}), points[30],
              points[48], points[54]};
    case LandmarkLayout::openseeface66:
      return {meanOf(points, {36, 37, 38, 39, 40, 41}), meanOf(points, {42, 43, 44, 45, 46, 47}), points[30],
              points[58], points[62]};
    case LandmarkLayout::mediapipe478:
      return {meanOf(points, {33, 133, 159, 145}), meanOf(points, {362, 263, 386, 374}), points[4], points[61],
              points[291]};
  }
  throw std::invalid_argument("unknown landmark layout");
}

bool cropOf(const FaceAnchors& in_image, const FaceAnchors& in_model, int width, int height, ImageFromCrop& out) {
  const Axes face = axesOf(in_image);
  const Axes model = axesOf(in_model);
  // Upright: the eyes' line and the line down to the mouth, turned by a quarter, agree as far as they are long.
  const double right_x = face.across_x + face.down_y, right_y = face.across_y - face.down_x;
  const double length = std::hypot(right_x, right_y);
  const double wide = std::hypot(face.across_x, face.across_y) / (std::hypot(model.across_x, model.across_y) * width);
  const double high = std::hypot(face.down_x, face.down_y) / (std::hypot(model.down_x, model.down_y) * height);
  const double scale = std::max(wide, high);  // pixels of the image per pixel of the crop
  if (!(length > 1e-3) || !(scale > 1e-3 && scale < 1e3)) return false;
  out.a = scale * right_x / length;
  out.b = scale * right_y / length;
  const double x = model.x * width, y = model.y * height;
  out.tx = face.x - (out.a * x - out.b * y);
  out.ty = face.y - (out.b * x + out.a * y);
  return std::isfinite(out.tx) && std::isfinite(out.ty);
}

void sampleCrop(const Image& image, const ImageFromCrop& image_from_crop, int width, int height,
                const Normalisation& normalisation, bool black_outside, std::span<float> planes) {
  const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (planes.size() < 3 * plane) throw std::invalid_argument("too little room for a crop");
  // n x n samples a pixel; pixel centres lie at half.
  const int n = std::clamp(static_cast<int>(std::lround(image_from_crop.scale())), 1, kMostTaps);
  const double step = 1.0 / n;
  const auto step_ax = static_cast<std::int64_t>(std::llround(image_from_crop.a * step * kOne));
  const auto step_ay = static_cast<std::int64_t>(std::llround(image_from_crop.b * step * kOne));
  const float share = 1.0F / static_cast<float>(n * n);
  std::array<float, 3> factor, offset;
  std::array<float*, 3> out;
  for (std::size_t c = 0; c < 3; ++c) {  // c: blue, green, red of the image
    const std::size_t channel = normalisation.rgb ? 2 - c : c;
    factor[c] = share / normalisation.deviation[channel];
    offset[c] = -normalisation.mean[channel] / normalisation.deviation[channel];
    out[c] = planes.data() + channel * plane;
  }
  const Bilinear bilinear{image, black_outside};
  std::size_t at = 0;
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column, ++at) {
      float sum[3] = {0, 0, 0};
      for (int i = 0; i < n; ++i) {
        const double x0 = column + 0.5 * step, y0 = row + (i + 0.5) * step;
        const double shift = n == 1 ? -0.5 : 0.0;
        auto x = static_cast<std::int64_t>(
            std::floor((image_from_crop.a * x0 - image_from_crop.b * y0 + image_from_crop.tx + shift) * kOne));
        auto y = static_cast<std::int64_t>(
            std::floor((image_from_crop.b * x0 + image_from_crop.a * y0 + image_from_crop.ty + shift) * kOne));
        if (n == 1) {
          bilinear.add(x, y, sum);
          continue;
        }
        for (int j = 0; j < n; ++j, x += step_ax, y += step_ay) {
          auto px = static_cast<int>(x >> kFixed), py = static_cast<int>(y >> kFixed);
          if (px < 0 || py < 0 || px >= image.width || py >= image.height) {
            if (black_outside) continue;
            px = std::clamp(px, 0, image.width - 1);
            py = std::clamp(py, 0, image.height - 1);
          }
          const std::uint8_t* const pixel =
              image.bgr.data() +
              3 * (static_cast<std::size_t>(py) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(px));
          sum[0] += static_cast<float>(pixel[0]);
          sum[1] += static_cast<float>(pixel[1]);
          sum[2] += static_cast<float>(pixel[2]);
        }
      }
      for (std::size_t c = 0; c < 3; ++c) out[c][at] = sum[c] * factor[c] + offset[c];
    }
  }
}

}  // namespace volto::capture
