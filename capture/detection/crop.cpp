#include "capture/detection/crop.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <utility>
#include <vector>

#include <hwy/cache_control.h>

#include "capture/detection/crop_kernel.h"

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

constexpr double kOne = 1 << kFixedBits;
constexpr double kHalveFrom = 2.5;  // pixels of the image per pixel of the crop

// Largest integer below; std::floor is a call where the processor is not known to have SSE 4.1.
std::int64_t floorOf(double x) {
  const auto towards_zero = static_cast<std::int64_t>(x);
  return towards_zero - (static_cast<double>(towards_zero) > x ? 1 : 0);
}

// Pixels by their place; what lies outside is the border's pixel, or nothing.
struct Pixels {
  const Image& image;
  bool black_outside;

  const std::uint8_t* inside(int x, int y) const {
    return image.bgr.data() +
           3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x));
  }
  const std::uint8_t* operator()(int x, int y) const {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) {
      if (black_outside) return nullptr;
      x = std::clamp(x, 0, image.width - 1);
      y = std::clamp(y, 0, image.height - 1);
    }
    return inside(x, y);
  }
};

// One sample between four pixels. x, y: fixed point.
std::array<float, 3> bilinear(const Pixels& pixels, std::int64_t x, std::int64_t y) {
  const auto ix = static_cast<int>(x >> kFixedBits), iy = static_cast<int>(y >> kFixedBits);
  const auto fx = static_cast<float>(x & ((1 << kFixedBits) - 1)) * (1.0F / (1 << kFixedBits));
  const auto fy = static_cast<float>(y & ((1 << kFixedBits) - 1)) * (1.0F / (1 << kFixedBits));
  const float weight[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  std::array<float, 3> sum{};
  for (int k = 0; k < 4; ++k) {
    const std::uint8_t* const at = pixels(ix + k % 2, iy + k / 2);
    if (at == nullptr) continue;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight[k] * static_cast<float>(at[c]);
  }
  return sum;
}

// Along a line of samples, `step` apart, added up.
std::array<int, 3> sumOf(const Pixels& pixels, std::int64_t x, std::int64_t y, std::int64_t step_x, std::int64_t step_y,
                         int samples) {
  std::array<int, 3> sum{};
  for (int i = 0; i < samples; ++i, x += step_x, y += step_y) {
    const std::uint8_t* const at = pixels(static_cast<int>(x >> kFixedBits), static_cast<int>(y >> kFixedBits));
    if (at == nullptr) continue;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += at[c];
  }
  return sum;
}

// The rectangle of an image that a crop covers, and `around` to each side; cut off at the image's border.
struct Covered {
  int left, top, right, bottom;
};

Covered coveredBy(const Image& image, const ImageFromCrop& image_from_crop, int width, int height, double around) {
  double low_x = image.width, low_y = image.height, high_x = 0, high_y = 0;
  for (const auto& [x, y] : {std::pair{0, 0}, {width, 0}, {0, height}, {width, height}}) {
    const auto at = image_from_crop(x, y);
    low_x = std::min<double>(low_x, at[0]);
    low_y = std::min<double>(low_y, at[1]);
    high_x = std::max<double>(high_x, at[0]);
    high_y = std::max<double>(high_y, at[1]);
  }
  const auto within = [around](double v, double direction, int size) {
    return static_cast<int>(std::clamp(v + direction * around, 0.0, static_cast<double>(size)));
  };
  return {within(low_x, -1, image.width), within(low_y, -1, image.height), within(high_x, 1, image.width),
          within(high_y, 1, image.height)};
}

// The picture was written by another thread and may lie anywhere. Sampled at an angle it would come line by line, each
// waited for; asked for beforehand it comes all at once.
void fetchRow(const Image& image, const Covered& part, int y) {
  constexpr std::size_t kLine = 64;
  const std::uint8_t* const row =
      image.bgr.data() + 3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width);
  for (std::size_t at = 3 * static_cast<std::size_t>(part.left); at < 3 * static_cast<std::size_t>(part.right);
       at += kLine)
    hwy::Prefetch(row + at);
}

void fetch(const Image& image, const Covered& part) {
  for (int y = part.top; y < part.bottom; ++y) fetchRow(image, part, y);
}

// Whether a crop lies within the image so far that no sample, nor what is beside it, is outside.
bool liesInside(const Image& image, const ImageFromCrop& image_from_crop, int width, int height) {
  for (const auto& [x, y] : {std::pair{0, 0}, {width, 0}, {0, height}, {width, height}}) {
    const auto at = image_from_crop(x, y);
    const auto within = [](float v, int size) { return v >= 2 && v <= static_cast<float>(size - 3); };
    if (!within(at[0], image.width) || !within(at[1], image.height)) return false;
  }
  return true;
}

// The part of an image that a crop covers, and a little around it, at half the size; half of that again, and so on.
// Where a face is large that is much less to look at than every pixel by itself. False when nothing is left of it.
bool halve(const Image& image, const ImageFromCrop& image_from_crop, int width, int height, Image& out,
           ImageFromCrop& out_from_crop) {
  constexpr double kAround = 8;  // more than a sample reaches, twice as large
  constexpr int kAhead = 16;     // rows that are asked for before they are looked at
  const Covered part = coveredBy(image, image_from_crop, width, height, kAround);
  const auto [left, top, right, bottom] = part;
  if (right - left < 2 || bottom - top < 2) return false;
  out.resize((right - left) / 2, (bottom - top) / 2);
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(image.width);
  for (int y = top; y < std::min(top + kAhead, bottom); ++y) fetchRow(image, part, y);
  for (int y = 0; y < out.height; ++y) {
    for (int next = top + 2 * y + kAhead; next < std::min(top + 2 * y + kAhead + 2, bottom); ++next)
      fetchRow(image, part, next);
    const std::uint8_t* const above =
        image.bgr.data() + static_cast<std::size_t>(top + 2 * y) * row_bytes + 3 * static_cast<std::size_t>(left);
    halveRows(above, above + row_bytes, out.width,
              out.bgr.data() + 3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width));
  }
  out_from_crop = {0.5 * image_from_crop.a, 0.5 * image_from_crop.b, 0.5 * (image_from_crop.tx - left),
                   0.5 * (image_from_crop.ty - top)};
  return true;
}

static_assert(std::endian::native == std::endian::little, "colours are taken apart by their place in a number");

// The same samples of a crop that is not turned (a detector's): each line of them lies in one row of the image, and
// below each other they are in the same columns. So the rows are added first, bytes side by side, then the columns.
class UprightAverage {
 public:
  UprightAverage(const Pixels& pixels, const ImageFromCrop& image_from_crop, int width, int n)
      : pixels_(pixels), image_from_crop_(image_from_crop), n_(n) {
    const int last = pixels.image.width - 1;
    const double step = 1.0 / n;
    const auto step_x = static_cast<std::int64_t>(std::llround(image_from_crop.a * step * kOne));
    columns_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(n));
    first_ = last;
    int end = 0;
    for (int column = 0; column < width; ++column) {
      std::int64_t x = floorOf((image_from_crop.a * (column + 0.5 * step) + image_from_crop.tx) * kOne);
      for (int j = 0; j < n; ++j, x += step_x) {
        const auto at = static_cast<int>(x >> kFixedBits);
        const bool outside = at < 0 || at > last;
        columns_.push_back(outside && pixels.black_outside ? kNothing : std::clamp(at, 0, last));
        if (columns_.back() == kNothing) continue;
        first_ = std::min(first_, columns_.back());
        end = std::max(end, columns_.back() + 1);
      }
    }
    sums_.resize(3 * static_cast<std::size_t>(std::max(end - first_, 0)) + 1);
  }

  // put(column, blue, green, red), sums of n x n samples.
  template <typename Put>
  void row(int row, const Put& put) {
    std::array<const std::uint8_t*, kMostTaps> rows{};
    std::size_t count = 0;
    for (int i = 0; i < n_; ++i) {
      const double y0 = row + (i + 0.5) * (1.0 / n_);
      const auto y = static_cast<int>(floorOf((image_from_crop_.a * y0 + image_from_crop_.ty) * kOne) >> kFixedBits);
      const int last = pixels_.image.height - 1;
      if ((y < 0 || y > last) && pixels_.black_outside) continue;
      rows[count++] = pixels_.inside(first_, std::clamp(y, 0, last));
    }
    addRows({rows.data(), count}, {sums_.data(), sums_.size() - 1});
    // Three colours, and what comes after them, in one number: sums of kMostTaps squared bytes fit into 16 bits each.
    const int* column = columns_.data();
    for (std::size_t at = 0; at < columns_.size() / static_cast<std::size_t>(n_); ++at) {
      std::uint64_t colours = 0;
      for (int j = 0; j < n_; ++j, ++column) {
        if (*column == kNothing) continue;
        std::uint64_t four = 0;
        std::memcpy(&four, sums_.data() + 3 * static_cast<std::size_t>(*column - first_), sizeof four);
        colours += four;
      }
      const auto colour = [&](unsigned c) { return static_cast<float>(colours >> (16 * c) & 0xFFFFU); };
      put(at, colour(0), colour(1), colour(2));
    }
  }

 private:
  static constexpr int kNothing = -1;
  const Pixels& pixels_;
  const ImageFromCrop& image_from_crop_;
  int n_;
  int first_ = 0;                    // the image's leftmost column that is looked at
  std::vector<int> columns_;         // of the image, n for each of the crop
  std::vector<std::uint16_t> sums_;  // of the rows, three colours each, from column first_ on; and one number more
};

void sampleAll(const Image& image, const ImageFromCrop& image_from_crop, int width, int height,
               const Normalisation& normalisation, bool black_outside, std::span<float> planes) {
  const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  // n x n samples a pixel; pixel centres lie at half.
  const int n = std::clamp(static_cast<int>(std::lround(image_from_crop.scale())), 1, kMostTaps);
  const float share = 1.0F / static_cast<float>(n * n);
  std::array<float, 3> factor, offset;
  std::array<float*, 3> out;
  for (std::size_t c = 0; c < 3; ++c) {  // c: blue, green, red of the image
    const std::size_t channel = normalisation.rgb ? 2 - c : c;
    factor[c] = share / normalisation.deviation[channel];
    offset[c] = -normalisation.mean[channel] / normalisation.deviation[channel];
    out[c] = planes.data() + channel * plane;
  }
  const Pixels pixels{image, black_outside};
  const auto put = [&](std::size_t at, float blue, float green, float red) {
    out[0][at] = blue * factor[0] + offset[0];
    out[1][at] = green * factor[1] + offset[1];
    out[2][at] = red * factor[2] + offset[2];
  };
  const ImageFromCrop& m = image_from_crop;
  if (n > 1 && m.b == 0 && m.a > 0) {
    UprightAverage average(pixels, m, width, n);
    for (int row = 0; row < height; ++row) {
      const std::size_t start = static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
      average.row(
          row, [&](std::size_t column, float blue, float green, float red) { put(start + column, blue, green, red); });
    }
    return;
  }
  if (liesInside(image, m, width, height) && sampleInside({&image, m, width, height, n, out, factor, offset})) return;
  const double step = 1.0 / n, shift = n == 1 ? -0.5 : 0.0;
  const auto step_x = static_cast<std::int64_t>(std::llround(m.a * step * kOne));
  const auto step_y = static_cast<std::int64_t>(std::llround(m.b * step * kOne));
  std::size_t at = 0;
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column, ++at) {
      std::array<float, 3> sum{};
      for (int i = 0; i < n; ++i) {
        const double x0 = column + 0.5 * step, y0 = row + (i + 0.5) * step;
        const std::int64_t x = floorOf((m.a * x0 - m.b * y0 + m.tx + shift) * kOne);
        const std::int64_t y = floorOf((m.b * x0 + m.a * y0 + m.ty + shift) * kOne);
        if (n == 1) {
          sum = bilinear(pixels, x, y);
        } else {
          const auto line = sumOf(pixels, x, y, step_x, step_y, n);
          for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<float>(line[c]);
        }
      }
      put(at, sum[0], sum[1], sum[2]);
    }
  }
}

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
  if (planes.size() < 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("too little room for a crop");
  if (!black_outside && image_from_crop.scale() < kHalveFrom)
    fetch(image, coveredBy(image, image_from_crop, width, height, 1));
  thread_local std::array<Image, 2> halved;  // they keep their memory
  const Image* from = &image;
  ImageFromCrop from_crop = image_from_crop, next;
  for (std::size_t i = 0; !black_outside && from_crop.scale() >= kHalveFrom; ++i) {
    if (!halve(*from, from_crop, width, height, halved[i % 2], next)) break;
    from = &halved[i % 2];
    from_crop = next;
  }
  sampleAll(*from, from_crop, width, height, normalisation, black_outside, planes);
}

}  // namespace volto::capture
