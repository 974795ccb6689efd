// Several pictures side by side, each with a caption.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "tools/picture/picture.h"

namespace volto::picture {

struct Cell {
  Picture picture;
  std::string caption;  // below the picture; shortened where it is too long
};

struct SheetStyle {
  int gap_px = 6;
  float text_px = 10.0F;  // height of a capital; captions take a strip of twice that, none where no cell has one
  std::string title;      // above everything, where given
  Colour ground{17, 18, 21}, text{226, 228, 232};
};

// `columns` cells a row, in the cells' order; the cells may differ in size. Throws std::invalid_argument without cells,
// or columns below 1.
Picture contactSheet(std::span<const Cell> cells, std::size_t columns, const SheetStyle& style = {});

}  // namespace volto::picture
