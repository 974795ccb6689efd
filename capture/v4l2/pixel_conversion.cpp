#include "capture/v4l2/pixel_conversion.h"

#include <algorithm>

#include "capture/v4l2/pixel_kernel.h"

namespace volto::capture::v4l2 {

namespace {

inline std::uint8_t clampByte(int value) { return static_cast<std::uint8_t>(std::clamp(value, 0, 255)); }

// Two pixels that share their colour.
struct Chroma {
  int red, green, blue;
  Chroma(int u, int v, const YuvMatrix& m)
      : red(m.v_to_red * (v - 128) + 128),
        green(-m.u_to_green * (u - 128) - m.v_to_green * (v - 128) + 128),
        blue(m.u_to_blue * (u - 128) + 128) {}
};

inline void putPixel(int y, const Chroma& chroma, const YuvMatrix& m, std::uint8_t* bgr) {
  const int luma = m.y_scale * (y - m.y_offset);
  bgr[0] = clampByte((luma + chroma.blue) >> 8);
  bgr[1] = clampByte((luma + chroma.green) >> 8);
  bgr[2] = clampByte((luma + chroma.red) >> 8);
}

std::size_t rows(int height, std::size_t stride, std::size_t last_row) {
  return static_cast<std::size_t>(height - 1) * stride + last_row;
}

}  // namespace

std::size_t yuyvBytes(int width, int height, std::size_t stride) {
  return rows(height, stride, static_cast<std::size_t>((width + 1) / 2) * 4);
}

std::size_t nv12Bytes(int width, int height, std::size_t stride) {
  return static_cast<std::size_t>(height) * stride +
         rows((height + 1) / 2, stride, static_cast<std::size_t>((width + 1) / 2) * 2);
}

std::size_t greyBytes(int width, int height, std::size_t stride) {
  return rows(height, stride, static_cast<std::size_t>(width));
}

void yuyvToBgr(std::span<const std::uint8_t> source, int width, int height, std::size_t stride, const YuvMatrix& matrix,
               std::span<std::uint8_t> bgr) {
  for (int row = 0; row < height; ++row) {
    const std::uint8_t* in = source.data() + static_cast<std::size_t>(row) * stride;
    std::uint8_t* out = bgr.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width) * 3;
    const auto done = static_cast<int>(yuyvRow(in, static_cast<std::size_t>(width), matrix, out));
    in += 2 * done;
    out += 3 * done;
    for (int x = done; x + 1 < width; x += 2, in += 4, out += 6) {
      const Chroma chroma(in[1], in[3], matrix);
      putPixel(in[0], chroma, matrix, out);
      putPixel(in[2], chroma, matrix, out + 3);
    }
    if (width % 2 != 0) putPixel(in[0], Chroma(in[1], in[3], matrix), matrix, out);
  }
}

void nv12ToBgr(std::span<const std::uint8_t> source, int width, int height, std::size_t stride, const YuvMatrix& matrix,
               std::span<std::uint8_t> bgr) {
  const std::uint8_t* const colours = source.data() + static_cast<std::size_t>(height) * stride;
  for (int row = 0; row < height; ++row) {
    const std::uint8_t* in = source.data() + static_cast<std::size_t>(row) * stride;
    const std::uint8_t* uv = colours + static_cast<std::size_t>(row / 2) * stride;
    std::uint8_t* out = bgr.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width) * 3;
    const auto done = static_cast<int>(nv12Row(in, uv, static_cast<std::size_t>(width), matrix, out));
    in += done;
    uv += done;
    out += 3 * done;
    for (int x = done; x + 1 < width; x += 2, in += 2, uv += 2, out += 6) {
      const Chroma chroma(uv[0], uv[1], matrix);
      putPixel(in[0], chroma, matrix, out);
      putPixel(in[1], chroma, matrix, out + 3);
    }
    if (width % 2 != 0) putPixel(in[0], Chroma(uv[0], uv[1], matrix), matrix, out);
  }
}

void greyToBgr(std::span<const std::uint8_t> source, int width, int height, std::size_t stride,
               std::span<std::uint8_t> bgr) {
  for (int row = 0; row < height; ++row) {
    const std::uint8_t* const in = source.data() + static_cast<std::size_t>(row) * stride;
    std::uint8_t* const out = bgr.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width) * 3;
    const auto done = static_cast<int>(greyRow(in, static_cast<std::size_t>(width), out));
    for (int x = done; x < width; ++x) out[3 * x] = out[3 * x + 1] = out[3 * x + 2] = in[x];
  }
}

}  // namespace volto::capture::v4l2
