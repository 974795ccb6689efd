#include "tools/picture/text.h"

#include <algorithm>
#include <array>

namespace volto::picture {
namespace {

// A glyph is polylines separated by blanks, each a row of points "xy": x 0..9 in sixths of the height, y as a letter
// from 'a' (2 below the base line) over 'c' (the base line) and 'g' (height of small letters) to 'i' (height of
// capitals). A lone point is a dot.
struct Glyph {
  int width;  // in the unit of x
  std::string_view strokes;
};

constexpr std::array<Glyph, 95> kGlyphs{{
    {2, ""},                                  // space
    {0, "0i0e 0c"},                           // !
    {2, "0i0g 2i2g"},                         // "
    {4, "1c1h 3c3h 0d4d 0g4g"},               // #
    {4, "4h3i1i0h0g1f3f4e4d3c1c0d 2i2c"},     // $
    {5, "0c5i 1i0h1g2h1i 4e3d4c5d4e"},        // %
    {5, "5c1g1h2i3h3g0e0d1c2c4e"},            // &
    {0, "0i0g"},                              // '
    {2, "2j1i0g0e1c2b"},                      // (
    {2, "0j1i2g2e1c0b"},                      // )
    {4, "2g2e 0g4e 4g0e"},                    // *
    {4, "2g2d 0f4f"},                         // +
    {1, "1c0b"},                              // ,
    {3, "0f3f"},                              // -
    {0, "0c"},                                // .
    {3, "0b3i"},                              // /
    {4, "1c0d0h1i3i4h4d3c1c"},                // 0
    {2, "0h2i2c"},                            // 1
    {4, "0h1i3i4h4g0c4c"},                    // 2
    {4, "0h1i3i4h4g3f1f 3f4e4d3c1c0d"},       // 3
    {4, "3c3i0e4e"},                          // 4
    {4, "4i0i0f3f4e4d3c1c0d"},                // 5
    {4, "4h3i1i0h0d1c3c4d4e3f0f"},            // 6
    {4, "0i4i1c"},                            // 7
    {4, "1f0g0h1i3i4h4g3f1f0e0d1c3c4d4e3f"},  // 8
    {4, "0d1c3c4d4h3i1i0h0g1f4f"},            // 9
    {0, "0c 0f"},                             // :
    {1, "1c0b 1f"},                           // ;
    {3, "3h0f3d"},                            // <
    {4, "0g4g 0e4e"},                         // =
    {3, "0h3f0d"},                            // >
    {4, "0h1i3i4h4g2f2e 2c"},                 // ?
    {5, "4e4g2g1f1e2d5d5h4i1i0h0d1c4c"},      // @
    {4, "0c2i4c 1e3e"},                       // A
    {4, "0c0i3i4h4g3f0f 3f4e4d3c0c"},         // B
    {4, "4h3i1i0h0d1c3c4d"},                  // C
    {4, "0c0i2i4g4e2c0c"},                    // D
    {4, "4i0i0c4c 0f3f"},                     // E
    {4, "4i0i0c 0f3f"},                       // F
    {4, "4h3i1i0h0d1c3c4d4f2f"},              // G
    {4, "0c0i 4c4i 0f4f"},                    // H
    {0, "0c0i"},                              // I
    {3, "3i3d2c1c0d"},                        // J
    {4, "0c0i 4i0e 1f4c"},                    // K
    {4, "0i0c4c"},                            // L
    {5, "0c0i2e3e5i5c"},                      // M
    {4, "0c0i4c4i"},                          // N
    {4, "1c0e0g1i3i4g4e3c1c"},                // O
    {4, "0c0i3i4h4g3f0f"},                    // P
    {4, "1c0d0h1i3i4h4d3c1c 2e4b"},           // Q
    {4, "0c0i3i4h4g3f0f 2f4c"},               // R
    {4, "4h3i1i0h0g1f3f4e4d3c1c0d"},          // S
    {4, "0i4i 2i2c"},                         // T
    {4, "0i0d1c3c4d4i"},                      // U
    {4, "0i2c4i"},                            // V
    {6, "0i1c3h5c6i"},                        // W
    {4, "0i4c 4i0c"},                         // X
    {4, "0i2f4i 2f2c"},                       // Y
    {4, "0i4i0c4c"},                          // Z
    {1, "1j0j0b1b"},                          // [
    {3, "0i3b"},                              // backslash
    {1, "0j1j1b0b"},                          // ]
    {4, "0g2i4g"},                            // ^
    {4, "0b4b"},                              // _
    {1, "0i1h"},                              // `
    {4, "0g3g4f4c 4e1e0d1c3c4d"},             // a
    {4, "0i0c 0f1g3g4f4d3c1c0d"},             // b
    {3, "3g1g0f0d1c3c"},                      // c
    {4, "4i4c 4f3g1g0f0d1c3c4d"},             // d
    {4, "0e4e4f3g1g0f0d1c4c"},                // e
    {3, "3i2i1h1c 0g3g"},                     // f
    {4, "4g4b3a1a 4f3g1g0f0d1c3c4d"},         // g
    {4, "0i0c 0f1g3g4f4c"},                   // h
    {0, "0g0c 0i"},                           // i
    {1, "1g1b0a 1i"},                         // j
    {3, "0i0c 3g0e 1f3c"},                    // k
    {1, "0i0d1c"},                            // l
    {6, "0g0c 0f1g2g3f3c 3f4g5g6f6c"},        // m
    {4, "0g0c 0f1g3g4f4c"},                   // n
    {4, "1c0d0f1g3g4f4d3c1c"},                // o
    {4, "0g0a 0f1g3g4f4d3c1c0d"},             // p
    {4, "4g4a 4f3g1g0f0d1c3c4d"},             // q
    {3, "0g0c 0f1g3g"},                       // r
    {3, "3g1g0f3d2c0c"},                      // s
    {3, "1i1d2c3c 0g3g"},                     // t
    {4, "0g0d1c3c4d 4g4c"},                   // u
    {4, "0g2c4g"},                            // v
    {6, "0g1c3g5c6g"},                        // w
    {4, "0g4c 4g0c"},                         // x
    {4, "0g0d1c3c4d 4g4b3a1a"},               // y
    {3, "0g3g0c3c"},                          // z
    {2, "2j1i1g0f1e1c2b"},                    // {
    {0, "0j0b"},                              // |
    {2, "0j1i1g2f1e1c0b"},                    // }
    {5, "0f1g2g3f4f5g"},                      // ~
}};
constexpr Glyph kBox{3, "0c3c3h0h0c"};
constexpr float kGap = 2.0F;        // between letters
constexpr float kUnitsHigh = 6.0F;  // 'c' to 'i'

const Glyph& glyphOf(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 32 && byte < 127 ? kGlyphs[byte - 32U] : kBox;
}

}  // namespace

float textWidth(std::string_view text, const TextStyle& style) {
  float units = 0.0F;
  for (const char c : text) units += static_cast<float>(glyphOf(c).width) + kGap;
  return std::max(0.0F, units - kGap) * style.height_px / kUnitsHigh;
}

void drawText(Picture& picture, float x, float y, std::string_view text, const TextStyle& style, Align align) {
  const float unit = style.height_px / kUnitsHigh, thickness = std::max(1.0F, style.weight * style.height_px);
  if (align == Align::centre) x -= 0.5F * textWidth(text, style);
  if (align == Align::right) x -= textWidth(text, style);
  for (const char c : text) {
    const Glyph& glyph = glyphOf(c);
    float from_x = 0.0F, from_y = 0.0F;
    std::size_t points = 0;
    const auto dot = [&] {
      if (points == 1) drawLine(picture, from_x, from_y, from_x, from_y, style.colour, 1.3F * thickness);
    };
    for (std::size_t i = 0; i < glyph.strokes.size(); ++i) {
      if (glyph.strokes[i] == ' ') {
        dot();
        points = 0;
        continue;
      }
      const float to_x = x + unit * static_cast<float>(glyph.strokes[i] - '0');
      const float to_y = y - unit * static_cast<float>(glyph.strokes[i + 1] - 'c');
      if (points > 0) drawLine(picture, from_x, from_y, to_x, to_y, style.colour, thickness);
      from_x = to_x;
      from_y = to_y;
      ++points;
      ++i;
    }
    dot();
    x += unit * (static_cast<float>(glyph.width) + kGap);
  }
}

std::string_view fittingText(std::string_view text, float width_px, const TextStyle& style) {
  while (!text.empty() && textWidth(text, style) > width_px) text.remove_suffix(1);
  return text;
}

}  // namespace volto::picture
