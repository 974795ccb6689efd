// What a fake camera shows: eight colour bars whose true colours tests know, and the picture's number in the brightness
// of a corner.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace volto::fake {

// Blue, green, red of bar i from the left (i = 8 x / width).
inline constexpr std::array<std::array<std::uint8_t, 3>, 8> kBars{{{180, 180, 180},
                                                                   {40, 180, 180},
                                                                   {180, 180, 40},
                                                                   {40, 180, 40},
                                                                   {180, 40, 180},
                                                                   {40, 40, 180},
                                                                   {180, 40, 40},
                                                                   {40, 40, 40}}};

// Brightness 16 + number % 200 in the upper left eighth by eighth.
std::uint8_t cornerBrightness(std::uint64_t number);

std::size_t pictureBytes(const std::string& fourcc, int width, int height);  // sizeimage
std::size_t pictureStride(const std::string& fourcc, int width);

// YUYV, NV12, GREY (BT.601, limited range; no padding). `out` keeps its capacity.
void drawRaw(const std::string& fourcc, int width, int height, std::vector<std::uint8_t>& out);
// Gives a picture that was drawn its number.
void numberRaw(const std::string& fourcc, int width, int height, std::uint64_t number,
               std::vector<std::uint8_t>& picture);

// A JPEG of the bars (without a number) and the ways in which real and hostile cameras spoil it: "ok", "truncate" (half
// of it is missing), "bitflip", "nodht" (no Huffman tables), "noeoi" (no end marker), "trailing" (bytes after the end),
// "preamble" (bytes before the start), "extraneous" (stray bytes before a marker), "progressive", "othersize",
// "65535x65535", "garbage", "empty".
std::vector<std::uint8_t> makeJpeg(int width, int height, const std::string& how, std::uint32_t seed = 1);

}  // namespace volto::fake
