#include "tools/picture/contact_sheet.h"

#include <algorithm>
#include <stdexcept>

#include "tools/picture/text.h"

namespace volto::picture {

Picture contactSheet(std::span<const Cell> cells, std::size_t columns, const SheetStyle& style) {
  if (cells.empty() || columns < 1)
    throw std::invalid_argument("a contact sheet needs at least one cell and one column");
  int width = 1, height = 1;
  bool captions = false;
  for (const Cell& cell : cells) {
    width = std::max(width, cell.picture.width);
    height = std::max(height, cell.picture.height);
    captions = captions || !cell.caption.empty();
  }
  columns = std::min(columns, cells.size());
  const std::size_t rows = (cells.size() + columns - 1) / columns;
  const TextStyle text{style.text_px, style.text};
  const int strip = captions ? static_cast<int>(2.2F * style.text_px) : 0;
  const int head = style.title.empty() ? 0 : static_cast<int>(3.0F * style.text_px);
  const int step_x = width + style.gap_px, step_y = height + strip + style.gap_px;
  Picture sheet(style.gap_px + step_x * static_cast<int>(columns),
                head + style.gap_px + step_y * static_cast<int>(rows), style.ground);
  if (head > 0) {
    TextStyle title = text;
    title.height_px *= 1.3F;
    drawText(sheet, static_cast<float>(style.gap_px) + 2.0F, static_cast<float>(head) - 0.5F * style.text_px,
             style.title, title);
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const int x = style.gap_px + step_x * static_cast<int>(i % columns);
    const int y = head + style.gap_px + step_y * static_cast<int>(i / columns);
    paste(sheet, cells[i].picture, x + (width - cells[i].picture.width) / 2,
          y + (height - cells[i].picture.height) / 2);
    drawText(sheet, static_cast<float>(x) + 0.5F * static_cast<float>(width),
             static_cast<float>(y + height) + 1.6F * style.text_px,
             fittingText(cells[i].caption, static_cast<float>(width), text), text, Align::centre);
  }
  return sheet;
}

}  // namespace volto::picture
