#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <zlib.h>

#include "tools/picture/palette.h"
#include "tools/picture/png.h"
#include "tools/picture/write_file.h"

namespace volto::picture {
namespace {

using Bytes = std::vector<std::byte>;

void put32(Bytes& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::byte>(value >> shift));
}
void put16(Bytes& out, std::uint32_t value) {
  out.push_back(static_cast<std::byte>(value >> 8));
  out.push_back(static_cast<std::byte>(value));
}

void putChunk(Bytes& out, std::string_view type, const Bytes& data) {
  put32(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  for (const char c : type) out.push_back(static_cast<std::byte>(c));
  out.insert(out.end(), data.begin(), data.end());
  const auto checksum =
      crc32(0, reinterpret_cast<const Bytef*>(out.data() + begin), static_cast<uInt>(out.size() - begin));
  put32(out, static_cast<std::uint32_t>(checksum));
}

struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
};

// Rows of palette indices, each after a filter byte 0, deflated.
Bytes deflated(const std::vector<std::uint8_t>& index, int stride, Rectangle part) {
  Bytes rows;
  rows.reserve(static_cast<std::size_t>(part.height) * (static_cast<std::size_t>(part.width) + 1));
  for (int y = part.y; y < part.y + part.height; ++y) {
    rows.push_back(std::byte{0});
    const auto* row =
        reinterpret_cast<const std::byte*>(index.data()) + static_cast<std::ptrdiff_t>(y) * stride + part.x;
    rows.insert(rows.end(), row, row + part.width);
  }
  uLongf size = compressBound(static_cast<uLong>(rows.size()));
  Bytes out(size);
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(rows.data()),
                static_cast<uLong>(rows.size()), 9) != Z_OK) {
    throw std::runtime_error("zlib cannot compress a frame");
  }
  out.resize(size);
  return out;
}

}  // namespace

std::vector<std::byte> encodeApng(std::span<const Picture> frames, double fps, const ApngOptions& options) {
  if (frames.empty()) throw std::invalid_argument("an animation needs at least one frame");
  if (!(fps >= 0.1 && fps <= 1000.0)) throw std::invalid_argument("frames per second must be 0.1 to 1000");
  if (options.colours < 2 || options.colours > 255) throw std::invalid_argument("a palette has 2 to 255 colours");
  const int width = frames[0].width, height = frames[0].height;
  for (const Picture& frame : frames) {
    if (frame.width != width || frame.height != height)
      throw std::invalid_argument("the frames of an animation differ in size");
  }
  if (width < 1 || height < 1) throw std::invalid_argument("the frames are empty");

  const std::vector<Colour> palette = choosePalette(frames, options.colours);
  const auto unchanged = static_cast<std::uint8_t>(palette.size());  // the transparent entry
  PaletteMap map(palette);

  Bytes out;
  for (const int b : {0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A}) out.push_back(static_cast<std::byte>(b));
  Bytes data;
  put32(data, static_cast<std::uint32_t>(width));
  put32(data, static_cast<std::uint32_t>(height));
  for (const int b : {8, 3, 0, 0, 0}) data.push_back(static_cast<std::byte>(b));  // 8 bits, palette
  putChunk(out, "IHDR", data);
  data.clear();
  put32(data, static_cast<std::uint32_t>(frames.size()));
  put32(data, static_cast<std::uint32_t>(std::max(0, options.plays)));
  putChunk(out, "acTL", data);
  data.assign({std::byte{0}});
  putChunk(out, "sRGB", data);
  data.clear();
  for (const Colour c : palette) {
    for (const std::uint8_t v : {c.r, c.g, c.b}) data.push_back(static_cast<std::byte>(v));
  }
  data.insert(data.end(), 3, std::byte{0});
  putChunk(out, "PLTE", data);
  data.assign(palette.size(), std::byte{255});
  data.push_back(std::byte{0});
  putChunk(out, "tRNS", data);

  // Delay as a fraction of two 16-bit numbers.
  std::uint32_t numerator = 1000, denominator = static_cast<std::uint32_t>(std::lround(fps * 1000.0));
  const std::uint32_t divisor = std::gcd(numerator, denominator);
  numerator /= divisor;
  denominator /= divisor;
  while (denominator > 0xFFFF) numerator = (numerator + 1) / 2, denominator /= 2;

  std::vector<std::uint8_t> shown, next;
  std::uint32_t sequence = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    map.map(frames[f], next);
    Rectangle part{0, 0, width, height};
    std::vector<std::uint8_t> drawn = next;
    if (f > 0) {
      int x0 = width, y0 = height, x1 = -1, y1 = -1;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const std::size_t at =
              static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
          if (next[at] == shown[at]) {
            drawn[at] = unchanged;
            continue;
          }
          x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
        }
      }
      // Nothing new: a single pixel keeps the frame's time.
      part = x1 < 0 ? Rectangle{0, 0, 1, 1} : Rectangle{x0, y0, x1 - x0 + 1, y1 - y0 + 1};
    }
    Bytes control;
    put32(control, sequence++);
    put32(control, static_cast<std::uint32_t>(part.width));
    put32(control, static_cast<std::uint32_t>(part.height));
    put32(control, static_cast<std::uint32_t>(part.x));
    put32(control, static_cast<std::uint32_t>(part.y));
    put16(control, numerator);
    put16(control, denominator);
    control.push_back(std::byte{0});                         // leave the frame as it is
    control.push_back(f > 0 ? std::byte{1} : std::byte{0});  // draw over it; the first: replace
    putChunk(out, "fcTL", control);
    Bytes pixels = deflated(drawn, width, part);
    if (f > 0) {
      // Where little stays the same, the frame as it is may be smaller than the frame with holes.
      Bytes whole = deflated(next, width, part);
      if (whole.size() < pixels.size()) pixels = std::move(whole);
      Bytes numbered(4 + pixels.size());
      for (std::size_t i = 0; i < 4; ++i) numbered[i] = static_cast<std::byte>(sequence >> (24 - 8 * i));
      ++sequence;
      std::copy(pixels.begin(), pixels.end(), numbered.begin() + 4);
      putChunk(out, "fdAT", numbered);
    } else {
      putChunk(out, "IDAT", pixels);
    }
    shown = next;
  }
  putChunk(out, "IEND", {});
  return out;
}

void writeApng(const std::filesystem::path& path, std::span<const Picture> frames, double fps,
               const ApngOptions& options) {
  writeWholeFile(path, encodeApng(frames, fps, options));
}

}  // namespace volto::picture
