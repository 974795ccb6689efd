// Labels: a small stroke font of Volto's own, ASCII, at any size.
#pragma once

#include <string_view>

#include "tools/picture/picture.h"

namespace volto::picture {

struct TextStyle {
  float height_px = 10.0F;  // of a capital letter
  Colour colour{230, 232, 236};
  float weight = 0.13F;  // thickness of the strokes, as a part of the height
};

enum class Align { left, centre, right };

float textWidth(std::string_view text, const TextStyle& style = {});
// `y` is the base line; `x` the left end, the middle or the right end. A byte outside ASCII is drawn as a small box.
void drawText(Picture& picture, float x, float y, std::string_view text, const TextStyle& style = {},
              Align align = Align::left);
// The beginning of `text` that fits `width_px`.
std::string_view fittingText(std::string_view text, float width_px, const TextStyle& style = {});

}  // namespace volto::picture
