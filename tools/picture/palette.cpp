#include "tools/picture/palette.h"

#include <algorithm>
#include <array>
#include <limits>

namespace volto::picture {
namespace {

constexpr int kBits = 6;
constexpr std::size_t kCells = std::size_t{1} << (3 * kBits);

std::size_t cellOf(int r, int g, int b) {
  constexpr int drop = 8 - kBits;
  return (static_cast<std::size_t>(r >> drop) << (2 * kBits)) | (static_cast<std::size_t>(g >> drop) << kBits) |
         static_cast<std::size_t>(b >> drop);
}

// What is counted in one cell of colour space.
struct Cell {
  std::array<std::int64_t, 3> sum{};
  std::int64_t count = 0;
  double mean(std::size_t channel) const { return static_cast<double>(sum[channel]) / static_cast<double>(count); }
};

struct Box {
  std::size_t begin, end;  // of the sorted cells
  std::size_t channel = 0;
  double badness = 0.0;  // squared error along the worst channel
};

void measure(const std::vector<Cell>& cells, Box& box) {
  double worst = -1.0;
  for (std::size_t c = 0; c < 3; ++c) {
    double n = 0, sum = 0, square = 0;
    for (std::size_t i = box.begin; i < box.end; ++i) {
      // The limit keeps a large even background from taking all colours.
      const double weight = std::min<double>(static_cast<double>(cells[i].count), 4000.0), value = cells[i].mean(c);
      n += weight;
      sum += weight * value;
      square += weight * value * value;
    }
    const double error = square - sum * sum / n;
    if (error > worst) worst = error, box.channel = c;
  }
  box.badness = box.end - box.begin > 1 ? worst : -1.0;
}

}  // namespace

std::vector<Colour> choosePalette(std::span<const Picture> pictures, int colours) {
  std::vector<Cell> all(kCells);
  for (const Picture& picture : pictures) {
    for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3) {
      Cell& cell = all[cellOf(picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2])];
      for (std::size_t c = 0; c < 3; ++c) cell.sum[c] += picture.rgb[i + c];
      ++cell.count;
    }
  }
  std::erase_if(all, [](const Cell& cell) { return cell.count == 0; });
  std::vector<Box> boxes{{0, all.size()}};
  measure(all, boxes[0]);
  while (static_cast<int>(boxes.size()) < colours) {
    const auto worst =
        std::max_element(boxes.begin(), boxes.end(), [](const Box& a, const Box& b) { return a.badness < b.badness; });
    if (worst->badness <= 0.0) break;
    Box left = *worst;
    const std::size_t c = left.channel;
    std::stable_sort(all.begin() + static_cast<std::ptrdiff_t>(left.begin),
                     all.begin() + static_cast<std::ptrdiff_t>(left.end),
                     [c](const Cell& a, const Cell& b) { return a.mean(c) < b.mean(c); });
    // Cut at the mean: the two halves then have the least error for a normal distribution.
    double n = 0, sum = 0;
    for (std::size_t i = left.begin; i < left.end; ++i) {
      n += static_cast<double>(all[i].count);
      sum += static_cast<double>(all[i].sum[c]);
    }
    std::size_t cut = left.begin + 1;
    while (cut + 1 < left.end && all[cut].mean(c) < sum / n) ++cut;
    Box right{cut, left.end};
    left.end = cut;
    measure(all, left);
    measure(all, right);
    *worst = left;
    boxes.push_back(right);
  }
  std::vector<Colour> palette;
  for (const Box& box : boxes) {
    std::array<std::int64_t, 3> sum{};
    std::int64_t count = 0;
    for (std::size_t i = box.begin; i < box.end; ++i) {
      for (std::size_t c = 0; c < 3; ++c) sum[c] += all[i].sum[c];
      count += all[i].count;
    }
    const auto mean = [&](std::size_t c) { return static_cast<std::uint8_t>((sum[c] + count / 2) / count); };
    palette.push_back({mean(0), mean(1), mean(2)});
  }
  return palette;
}

PaletteMap::PaletteMap(std::vector<Colour> palette) : palette_(std::move(palette)), cache_(kCells, -1) {}

std::uint8_t PaletteMap::nearest(int r, int g, int b) {
  r = std::clamp(r, 0, 255), g = std::clamp(g, 0, 255), b = std::clamp(b, 0, 255);
  std::int16_t& known = cache_[cellOf(r, g, b)];
  if (known < 0) {
    // The middle of the cell stands for all of it, so that the answer does not depend on which colour came first.
    constexpr int half = 1 << (7 - kBits), mask = ~((1 << (8 - kBits)) - 1);
    const int cr = (r & mask) + half, cg = (g & mask) + half, cb = (b & mask) + half;
    int best = std::numeric_limits<int>::max();
    for (std::size_t i = 0; i < palette_.size(); ++i) {
      const int dr = cr - palette_[i].r, dg = cg - palette_[i].g, db = cb - palette_[i].b;
      const int distance = 2 * dr * dr + 4 * dg * dg + db * db;
      if (distance < best) best = distance, known = static_cast<std::int16_t>(i);
    }
  }
  return static_cast<std::uint8_t>(known);
}

void PaletteMap::map(const Picture& picture, std::vector<std::uint8_t>& out_index) {
  static constexpr int kBayer[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  out_index.resize(picture.rgb.size() / 3);
  std::size_t i = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x, ++i) {
      const int offset = (kBayer[y & 3][x & 3] - 7) / 3;
      out_index[i] =
          nearest(picture.rgb[3 * i] + offset, picture.rgb[3 * i + 1] + offset, picture.rgb[3 * i + 2] + offset);
    }
  }
}

}  // namespace volto::picture
