// A picture in memory and the flat drawing that labels, plots and overlays need.
#pragma once

#include <cstdint>
#include <vector>

namespace volto::picture {

// sRGB, 8 bits each.
struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;
  friend bool operator==(const Colour&, const Colour&) = default;
};

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // width * height * 3, rows from the top, sRGB

  Picture() = default;
  // Throws std::invalid_argument unless both sides are 1 .. 16384 pixels.
  Picture(int width_px, int height_px, Colour fill = {});

  Colour at(int x, int y) const;     // x, y inside
  void set(int x, int y, Colour c);  // outside: nothing happens
  // Mixes `c` over the pixel; `cover` 0..1. Outside: nothing happens.
  void blend(int x, int y, Colour c, float cover);
};

// Pixel centres lie at (x + 0.5, y + 0.5). All of these are anti-aliased, and clipped to the picture.
void fillRectangle(Picture& picture, int x, int y, int width, int height, Colour c, float cover = 1.0F);
void drawLine(Picture& picture, float x0, float y0, float x1, float y1, Colour c, float thickness_px = 1.0F,
              float cover = 1.0F);
void drawDisc(Picture& picture, float x, float y, float radius_px, Colour c, float cover = 1.0F);
// Copies `part` so that its upper left corner lies at (x, y).
void paste(Picture& picture, const Picture& part, int x, int y);

// `count` colours that are told apart well on a dark ground, the same for the same index.
Colour distinctColour(int index);

}  // namespace volto::picture
