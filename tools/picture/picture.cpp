#include "tools/picture/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace volto::picture {
namespace {

constexpr int kMaxSide = 16384;

std::uint8_t mixed(std::uint8_t under, std::uint8_t over, float cover) {
  const float value = static_cast<float>(under) + (static_cast<float>(over) - static_cast<float>(under)) * cover;
  return static_cast<std::uint8_t>(value + 0.5F);
}

}  // namespace

Picture::Picture(int width_px, int height_px, Colour fill) : width(width_px), height(height_px) {
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) {
    throw std::invalid_argument("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                                " pixels cannot be made; each side must be 1 to 16384");
  }
  rgb.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  for (std::size_t i = 0; i < rgb.size(); i += 3) rgb[i] = fill.r, rgb[i + 1] = fill.g, rgb[i + 2] = fill.b;
}

Colour Picture::at(int x, int y) const {
  const std::size_t i =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  return {rgb[i], rgb[i + 1], rgb[i + 2]};
}

void Picture::set(int x, int y, Colour c) {
  if (x < 0 || y < 0 || x >= width || y >= height) return;
  const std::size_t i =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  rgb[i] = c.r, rgb[i + 1] = c.g, rgb[i + 2] = c.b;
}

void Picture::blend(int x, int y, Colour c, float cover) {
  if (x < 0 || y < 0 || x >= width || y >= height || !(cover > 0.0F)) return;
  cover = std::min(cover, 1.0F);
  const std::size_t i =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  rgb[i] = mixed(rgb[i], c.r, cover);
  rgb[i + 1] = mixed(rgb[i + 1], c.g, cover);
  rgb[i + 2] = mixed(rgb[i + 2], c.b, cover);
}

void fillRectangle(Picture& picture, int x, int y, int width, int height, Colour c, float cover) {
  const int x1 = std::min(picture.width, x + width), y1 = std::min(picture.height, y + height);
  for (int row = std::max(0, y); row < y1; ++row) {
    for (int column = std::max(0, x); column < x1; ++column) picture.blend(column, row, c, cover);
  }
}

void drawLine(Picture& picture, float x0, float y0, float x1, float y1, Colour c, float thickness_px, float cover) {
  constexpr float kFar = 1e5F;
  for (const float v : {x0, y0, x1, y1}) {
    if (!(std::abs(v) < kFar)) return;
  }
  const float half = 0.5F * thickness_px;
  const int left = std::max(0, static_cast<int>(std::floor(std::min(x0, x1) - half - 1.0F)));
  const int right = std::min(picture.width - 1, static_cast<int>(std::ceil(std::max(x0, x1) + half + 1.0F)));
  const int top = std::max(0, static_cast<int>(std::floor(std::min(y0, y1) - half - 1.0F)));
  const int bottom = std::min(picture.height - 1, static_cast<int>(std::ceil(std::max(y0, y1) + half + 1.0F)));
  const float dx = x1 - x0, dy = y1 - y0, square = dx * dx + dy * dy;
  for (int y = top; y <= bottom; ++y) {
    // Of a long slanted line, only the part of the row near it is looked at.
    int from = left, to = right;
    if (std::abs(dy) > 1e-3F) {
      const float reach = (half + 1.5F) * std::sqrt(square) / std::abs(dy) + std::abs(dx / dy);
      const float middle = x0 + dx * (static_cast<float>(y) + 0.5F - y0) / dy;
      from = std::max(left, static_cast<int>(std::floor(std::clamp(middle - reach, -kFar, kFar))));
      to = std::min(right, static_cast<int>(std::ceil(std::clamp(middle + reach, -kFar, kFar))));
    }
    for (int x = from; x <= to; ++x) {
      const float px = static_cast<float>(x) + 0.5F - x0, py = static_cast<float>(y) + 0.5F - y0;
      const float t = square > 0.0F ? std::clamp((px * dx + py * dy) / square, 0.0F, 1.0F) : 0.0F;
      const float distance = std::hypot(px - t * dx, py - t * dy);
      picture.blend(x, y, c, cover * std::clamp(half + 0.5F - distance, 0.0F, 1.0F));
    }
  }
}

void drawDisc(Picture& picture, float x, float y, float radius_px, Colour c, float cover) {
  drawLine(picture, x, y, x, y, c, 2.0F * radius_px, cover);
}

void paste(Picture& picture, const Picture& part, int x, int y) {
  const int from = std::max(0, -x), to = std::min(part.width, picture.width - x);
  if (from >= to) return;
  for (int row = std::max(0, -y); row < std::min(part.height, picture.height - y); ++row) {
    const auto source = part.rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(row) * part.width + from);
    const auto target = picture.rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(row + y) * picture.width + x + from);
    std::copy(source, source + 3 * (to - from), target);
  }
}

Colour distinctColour(int index) {
  // Hues by the golden angle, so that neighbours in number are far apart in hue; two rounds of lightness.
  const float hue = std::fmod(0.58F + 0.38196601F * static_cast<float>(index), 1.0F) * 6.0F;
  const float light = index % 2 == 0 ? 0.95F : 0.75F, saturation = 0.55F;
  const auto channel = [&](float n) {
    const float k = std::fmod(n + hue, 6.0F);
    const float value = light - light * saturation * std::clamp(std::min(k, 4.0F - k), 0.0F, 1.0F);
    return static_cast<std::uint8_t>(255.0F * value + 0.5F);
  };
  return {channel(5.0F), channel(3.0F), channel(1.0F)};
}

}  // namespace volto::picture
