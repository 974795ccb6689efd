#include "tests/capture/fake/pictures.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <jpeglib.h>
#include <stdexcept>

namespace volto::fake {

namespace {

struct Yuv {
  std::uint8_t y, u, v;
};

// ITU-R BT.601-7, 2.5: from 8-bit RGB to 8-bit limited-range Y'CbCr.
Yuv toYuv(const std::array<std::uint8_t, 3>& bgr) {
  const double b = bgr[0], g = bgr[1], r = bgr[2];
  const double y = 16 + (65.481 * r + 128.553 * g + 24.966 * b) / 255;
  const double u = 128 + (-37.797 * r - 74.203 * g + 112.0 * b) / 255;
  const double v = 128 + (112.0 * r - 93.786 * g - 18.214 * b) / 255;
  return {static_cast<std::uint8_t>(y + 0.5), static_cast<std::uint8_t>(u + 0.5), static_cast<std::uint8_t>(v + 0.5)};
}

Yuv pixelAt(int x, int y, int width, int height) {
  static const std::array<Yuv, 8> bars = [] {
    std::array<Yuv, 8> out{};
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = toYuv(kBars[i]);
    return out;
  }();
  if (x < width / 8 && y < height / 8) return {16, 128, 128};
  return bars[static_cast<std::size_t>(std::min(8 * x / width, 7))];
}

std::vector<std::uint8_t> encode(int width, int height, bool progressive) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(width);
  jpeg.image_height = static_cast<JDIMENSION>(height);
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_EXT_BGR;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 90, TRUE);
  jpeg.comp_info[0].h_samp_factor = 2;  // 4:2:2, as cameras do
  jpeg.comp_info[0].v_samp_factor = 1;
  if (progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(width) * 3);
  for (int x = 0; x < width; ++x) {
    std::copy_n(kBars[static_cast<std::size_t>(8 * x / width)].begin(), 3, row.begin() + 3 * x);
  }
  while (jpeg.next_scanline < jpeg.image_height) {
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&jpeg, &pointer, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::vector<std::uint8_t> out(bytes, bytes + size);
  std::free(bytes);
  return out;
}

// Where the segment of a marker begins (its 0xFF); size() when there is none.
std::size_t findSegment(const std::vector<std::uint8_t>& jpeg, std::uint8_t marker, std::size_t from = 2) {
  while (from + 4 <= jpeg.size() && jpeg[from] == 0xFF) {
    if (jpeg[from + 1] == marker) return from;
    from += 2U + (static_cast<std::size_t>(jpeg[from + 2]) << 8) + jpeg[from + 3];
  }
  return jpeg.size();
}

}  // namespace

std::uint8_t cornerBrightness(std::uint64_t number) { return static_cast<std::uint8_t>(16 + number % 200); }

std::size_t pictureStride(const std::string& fourcc, int width) {
  if (fourcc == "YUYV") return static_cast<std::size_t>(width) * 2;
  if (fourcc == "NV12" || fourcc == "GREY") return static_cast<std::size_t>(width);
  return 0;
}

std::size_t pictureBytes(const std::string& fourcc, int width, int height) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (fourcc == "NV12") return pixels * 3 / 2;
  if (fourcc == "GREY") return pixels;
  return pixels * 2;
}

void drawRaw(const std::string& fourcc, int width, int height, std::vector<std::uint8_t>& out) {
  out.resize(pictureBytes(fourcc, width, height));
  std::uint8_t* p = out.data();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Yuv yuv = pixelAt(x, y, width, height);
      *p++ = yuv.y;
      if (fourcc == "YUYV") *p++ = x % 2 == 0 ? yuv.u : yuv.v;
    }
  }
  if (fourcc != "NV12") return;
  for (int y = 0; y < height; y += 2) {
    for (int x = 0; x < width; x += 2) {
      const Yuv yuv = pixelAt(x, y, width, height);
      *p++ = yuv.u;
      *p++ = yuv.v;
    }
  }
}

void numberRaw(const std::string& fourcc, int width, int height, std::uint64_t number,
               std::vector<std::uint8_t>& picture) {
  const std::size_t step = fourcc == "YUYV" ? 2 : 1;
  for (int y = 0; y < height / 8; ++y) {
    std::uint8_t* const row = picture.data() + static_cast<std::size_t>(y) * pictureStride(fourcc, width);
    for (int x = 0; x < width / 8; ++x) row[static_cast<std::size_t>(x) * step] = cornerBrightness(number);
  }
}

std::vector<std::uint8_t> makeJpeg(int width, int height, const std::string& how, std::uint32_t seed) {
  if (how == "empty") return {};
  std::vector<std::uint8_t> jpeg =
      how == "othersize" ? encode(width + 16, height, false) : encode(width, height, how == "progressive");
  const auto random = [&seed] { return seed = seed * 1664525U + 1013904223U; };
  if (how == "truncate") {
    jpeg.resize(jpeg.size() / 2);
  } else if (how == "noeoi") {
    jpeg.resize(jpeg.size() - 2);
  } else if (how == "trailing") {
    jpeg.insert(jpeg.end(), 200, 0xAA);
  } else if (how == "preamble") {
    jpeg.insert(jpeg.begin(), 32, 0x00);
  } else if (how == "extraneous") {
    jpeg.insert(jpeg.begin() + static_cast<std::ptrdiff_t>(findSegment(jpeg, 0xC4)), 4, 0x5A);
  } else if (how == "garbage") {
    for (std::uint8_t& byte : jpeg) byte = static_cast<std::uint8_t>(random() >> 24);
  } else if (how == "nodht") {
    for (std::size_t at = findSegment(jpeg, 0xC4); at < jpeg.size(); at = findSegment(jpeg, 0xC4, at)) {
      const std::size_t length = 2U + (static_cast<std::size_t>(jpeg[at + 2]) << 8) + jpeg[at + 3];
      jpeg.erase(jpeg.begin() + static_cast<std::ptrdiff_t>(at),
                 jpeg.begin() + static_cast<std::ptrdiff_t>(at + length));
    }
  } else if (how == "bitflip") {
    const std::size_t scan = findSegment(jpeg, 0xDA);
    for (int i = 0; i < 20; ++i) {
      const std::size_t at = scan + 16 + random() % (jpeg.size() - scan - 16);
      jpeg[at] = static_cast<std::uint8_t>(jpeg[at] ^ (1U << (random() >> 29)));
    }
  } else if (how == "65535x65535") {
    const std::size_t at = findSegment(jpeg, 0xC0);
    for (std::size_t i = 5; i < 9; ++i) jpeg[at + i] = 0xFF;
  } else if (how != "ok" && how != "progressive" && how != "othersize") {
    throw std::invalid_argument("a JPEG cannot be spoilt by '" + how + "'");
  }
  return jpeg;
}

}  // namespace volto::fake
