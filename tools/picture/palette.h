// A few colours that stand for all of a sequence of pictures.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/picture/picture.h"

namespace volto::picture {

// At most `colours` entries, by median cut (P. Heckbert, Color image quantization for frame buffer display, SIGGRAPH
// 1982) over all pictures.
std::vector<Colour> choosePalette(std::span<const Picture> pictures, int colours);

// Index of the palette's nearest colour for every pixel. With a fixed ordered pattern of one palette step, so that
// smooth shades do not band and still pixels stay still from frame to frame.
class PaletteMap {
 public:
  explicit PaletteMap(std::vector<Colour> palette);
  void map(const Picture& picture, std::vector<std::uint8_t>& out_index);

 private:
  std::uint8_t nearest(int r, int g, int b);
  std::vector<Colour> palette_;
  std::vector<std::int16_t> cache_;  // by 6 bits of each channel
};

}  // namespace volto::picture
