#include "capture/detection/pupils.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "capture/detection/crop.h"

namespace volto::capture {
namespace {

// The patch: the eye's corners lie on its middle row, kEye pixels apart.
constexpr int kWidth = 60, kHeight = 40;
constexpr double kEye = 40;
constexpr double kIrisRadius = 0.5 * 11.7 / 30.0 * kEye;
constexpr double kRingRadius = 1.55 * kIrisRadius;
constexpr double kLeastOpening = 0.12, kFullOpening = 0.25;  // height of the opening, in eye widths
constexpr double kSmallestEye_px = 7;
constexpr float kLeastContrast = 8, kFullContrast = 40;  // grey levels between iris and what surrounds it
constexpr float kLidDarkness = 0.25F;                    // how much of the disc must be open to count

// Where a pupil's middle is looked for. A ring around each of these places stays between the patch's sides.
constexpr int kLowX = static_cast<int>(0.5 * (kWidth - 0.8 * kEye)), kHighX = kWidth - kLowX;
constexpr int kLowY = static_cast<int>(0.5 * (kHeight - 0.6 * kEye)), kHighY = kHeight - kLowY;
constexpr std::size_t kPlaces = kHighX - kLowX + 1;
static_assert(kLowX >= static_cast<int>(kRingRadius) && kHighX + static_cast<int>(kRingRadius) < kWidth);

// Sums over a disc around each place of one row, from sums along rows (see PupilFinder::findOne).
struct PlacesInARow {
  std::array<float, kPlaces> seen{}, bright{};
};

void addPlaces(const std::vector<float>& seen, const std::vector<float>& bright, int cy, int first_row, int end_row,
               const std::vector<int>& half_widths, PlacesInARow& out) {
  const int reach = static_cast<int>(half_widths.size()) / 2;
  for (int y = std::max(cy - reach, first_row); y < std::min(cy + reach + 1, end_row); ++y) {
    const int half = half_widths[static_cast<std::size_t>(y - cy + reach)];
    const auto first = static_cast<std::size_t>(y * (kWidth + 1) + kLowX - half);
    const auto end = static_cast<std::size_t>(y * (kWidth + 1) + kLowX + half + 1);
    for (std::size_t i = 0; i < kPlaces; ++i) out.seen[i] += seen[end + i] - seen[first + i];
    for (std::size_t i = 0; i < kPlaces; ++i) out.bright[i] += bright[end + i] - bright[first + i];
  }
}

struct Column {
  float top = 1e9F, bottom = -1e9F;
};

}  // namespace

PupilFinder::PupilFinder()
    : grey_(static_cast<std::size_t>(3 * kWidth * kHeight)),
      seen_(static_cast<std::size_t>(kHeight * (kWidth + 1))),
      bright_(static_cast<std::size_t>(kHeight * (kWidth + 1))) {
  const auto halfWidths = [](double radius) {
    std::vector<int> out;
    const int reach = static_cast<int>(std::floor(radius));
    for (int y = -reach; y <= reach; ++y)
      out.push_back(static_cast<int>(std::floor(std::sqrt(radius * radius - y * y))));
    return out;
  };
  disc_ = halfWidths(kIrisRadius);
  ring_ = halfWidths(kRingRadius);
  for (const int half : disc_) disc_pixels_ += 2 * half + 1;
}

void PupilFinder::find(const Image& image, LandmarkFrame& frame) {
  frame.pupils = {};
  if (!frame.face_present || frame.points_px.size() != landmarkCount(frame.layout)) return;
  if (frame.layout == LandmarkLayout::mediapipe478) {
    for (const auto& [eye, iris] : {std::pair<std::size_t, std::size_t>{0, 468}, {1, 473}})
      frame.pupils[eye] = {frame.points_px[iris][0], frame.points_px[iris][1], 1.0F};
    return;
  }
  const std::span<const std::array<float, 2>> points(frame.points_px);
  frame.pupils[0] = findOne(image, points.subspan(36, 6));
  frame.pupils[1] = findOne(image, points.subspan(42, 6));
}

// Lids in iBUG's order: the corner on the image's left, two of the upper lid, the other corner, two of the lower lid.
Pupil PupilFinder::findOne(const Image& image, std::span<const std::array<float, 2>> lids) {
  const double across_x = lids[3][0] - lids[0][0], across_y = lids[3][1] - lids[0][1];
  const double width = std::hypot(across_x, across_y);
  if (!(width >= kSmallestEye_px && width < 4096)) return {};
  ImageFromCrop patch;
  patch.a = across_x / kEye;
  patch.b = across_y / kEye;
  const double middle_x = 0.5 * (lids[0][0] + lids[3][0]), middle_y = 0.5 * (lids[0][1] + lids[3][1]);
  patch.tx = middle_x - (patch.a * 0.5 * kWidth - patch.b * 0.5 * kHeight);
  patch.ty = middle_y - (patch.b * 0.5 * kWidth + patch.a * 0.5 * kHeight);

  // The opening: between the lids' polylines, in the patch.
  std::array<std::array<float, 2>, 6> lid;
  for (std::size_t i = 0; i < 6; ++i) lid[i] = patch.inverse(lids[i][0], lids[i][1]);
  std::array<Column, kWidth> columns;
  const auto line = [&](std::size_t from, std::size_t to, bool upper) {
    for (int x = 0; x < kWidth; ++x) {
      const float at = static_cast<float>(x) + 0.5F, low = std::min(lid[from][0], lid[to][0]),
                  high = std::max(lid[from][0], lid[to][0]);
      if (at < low || at > high || high - low < 1e-3F) continue;
      const float share = (at - lid[from][0]) / (lid[to][0] - lid[from][0]);
      const float y = lid[from][1] + share * (lid[to][1] - lid[from][1]);
      Column& column = columns[static_cast<std::size_t>(x)];
      if (upper) {
        column.top = std::min(column.top, y);
      } else {
        column.bottom = std::max(column.bottom, y);
      }
    }
  };
  line(0, 1, true), line(1, 2, true), line(2, 3, true);
  line(3, 4, false), line(4, 5, false), line(5, 0, false);
  const double opening = 0.5 * ((lid[5][1] - lid[1][1]) + (lid[4][1] - lid[2][1])) / kEye;
  if (!(opening > kLeastOpening)) return {};

  // Only what lies between the lids counts, so only that part of the patch is taken from the image.
  float top = kHeight, bottom = 0;
  int first = kWidth, end = 0;
  for (int x = 0; x < kWidth; ++x) {
    const Column& column = columns[static_cast<std::size_t>(x)];
    if (!(column.bottom + 0.5F > column.top - 0.5F)) continue;
    first = std::min(first, x);
    end = x + 1;
    top = std::min(top, column.top - 1);
    bottom = std::max(bottom, column.bottom + 1);
  }
  const int first_row = std::clamp(static_cast<int>(std::floor(top)), 0, kHeight);
  const int end_row = std::clamp(static_cast<int>(std::ceil(bottom)), 0, kHeight);
  if (first >= end || first_row >= end_row) return {};
  const int across = end - first, down = end_row - first_row;
  ImageFromCrop part = patch;
  part.tx += patch.a * first - patch.b * first_row;
  part.ty += patch.b * first + patch.a * first_row;
  const std::size_t plane = static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
  sampleCrop(image, part, across, down, Normalisation{}, false, grey_);
  for (std::size_t i = 0; i < plane; ++i)  // the red channel shows lids bright and the iris dark in every skin
    grey_[i] = 0.2F * grey_[i] + 0.4F * grey_[i + plane] + 0.4F * grey_[i + 2 * plane];
  // Sums along each row, from its start up to each pixel: a disc is a few rows of pixels side by side.
  std::fill(seen_.begin(), seen_.end(), 0.0F);
  std::fill(bright_.begin(), bright_.end(), 0.0F);
  for (int y = first_row; y < end_row; ++y) {
    const float* const grey = grey_.data() + static_cast<std::size_t>(y - first_row) * static_cast<std::size_t>(across);
    float* const seen_sums = seen_.data() + static_cast<std::size_t>(y * (kWidth + 1)) + 1;
    float* const bright_sums = bright_.data() + static_cast<std::size_t>(y * (kWidth + 1)) + 1;
    float seen = 0, bright = 0;
    for (int x = first; x < end; ++x) {
      const Column& column = columns[static_cast<std::size_t>(x)];
      const auto at = static_cast<float>(y) + 0.5F;
      const float open = std::clamp(std::min(at - column.top, column.bottom - at) + 0.5F, 0.0F, 1.0F);
      seen += open;
      bright += open * grey[x - first];
      seen_sums[x] = seen;
      bright_sums[x] = bright;
    }
    std::fill(seen_sums + end, seen_sums + kWidth, seen);
    std::fill(bright_sums + end, bright_sums + kWidth, bright);
  }

  struct Sum {
    float seen = 0, bright = 0;
  };
  const auto sumOver = [&](int cx, int cy, const std::vector<int>& half_widths) {
    Sum sum;
    const int reach = static_cast<int>(half_widths.size()) / 2;
    for (int y = std::max(cy - reach, 0); y <= std::min(cy + reach, kHeight - 1); ++y) {
      const int half = half_widths[static_cast<std::size_t>(y - cy + reach)];
      const int from = std::max(cx - half, 0), to = std::min(cx + half + 1, kWidth);
      if (from >= to) continue;
      const auto row = static_cast<std::size_t>(y * (kWidth + 1));
      sum.seen += seen_[row + static_cast<std::size_t>(to)] - seen_[row + static_cast<std::size_t>(from)];
      sum.bright += bright_[row + static_cast<std::size_t>(to)] - bright_[row + static_cast<std::size_t>(from)];
    }
    return sum;
  };
  const auto contrastOf = [&](const Sum& inside, const Sum& all) {
    const Sum outside{all.seen - inside.seen, all.bright - inside.bright};
    const float share = inside.seen / static_cast<float>(disc_pixels_);
    if (share < kLidDarkness || outside.seen < 8) return -1e9F;
    return (outside.bright / outside.seen - inside.bright / inside.seen) * std::sqrt(share);
  };
  const auto contrastAt = [&](int cx, int cy) { return contrastOf(sumOver(cx, cy, disc_), sumOver(cx, cy, ring_)); };
  // Every second place first, then around the best, then between the pixels.
  int best_x = kWidth / 2, best_y = kHeight / 2;
  float best = -1e9F;
  const auto consider = [&](float contrast, int x, int y) {
    if (contrast > best) best = contrast, best_x = x, best_y = y;
  };
  const auto tryAt = [&](int x, int y) { consider(contrastAt(x, y), x, y); };
  // All places of a row together: the same rows of the disc lie side by side there.
  for (int y = kLowY; y <= kHighY; y += 2) {
    PlacesInARow inside, all;
    addPlaces(seen_, bright_, y, first_row, end_row, disc_, inside);
    addPlaces(seen_, bright_, y, first_row, end_row, ring_, all);
    for (std::size_t i = 0; i < kPlaces; i += 2)
      consider(contrastOf({inside.seen[i], inside.bright[i]}, {all.seen[i], all.bright[i]}),
               kLowX + static_cast<int>(i), y);
  }
  const int coarse_x = best_x, coarse_y = best_y;
  for (int y = coarse_y - 1; y <= coarse_y + 1; ++y)
    for (int x = coarse_x - 1; x <= coarse_x + 1; ++x)
      if (x != coarse_x || y != coarse_y) tryAt(x, y);
  if (best < kLeastContrast) return {};
  const auto peak = [&](float before, float after) {
    const float bend = before - 2 * best + after;
    return before > -1e8F && after > -1e8F && bend < -1e-3F ? std::clamp(0.5F * (before - after) / bend, -0.5F, 0.5F)
                                                            : 0.0F;
  };
  const float x =
      static_cast<float>(best_x) + 0.5F + peak(contrastAt(best_x - 1, best_y), contrastAt(best_x + 1, best_y));
  const float y =
      static_cast<float>(best_y) + 0.5F + peak(contrastAt(best_x, best_y - 1), contrastAt(best_x, best_y + 1));
  const auto at = patch(x, y);
  const auto openness =
      static_cast<float>(std::clamp((opening - kLeastOpening) / (kFullOpening - kLeastOpening), 0.0, 1.0));
  const float contrast = std::clamp((best - kLeastContrast) / (kFullContrast - kLeastContrast), 0.0F, 1.0F);
  return {at[0], at[1], openness * contrast};
}

}  // namespace volto::capture
