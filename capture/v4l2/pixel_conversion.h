// Raw camera formats to BGR.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace volto::capture::v4l2 {

// Which numbers Y'CbCr is made of, in 1/256: R = y_scale (Y - y_offset) + v_to_red (V - 128), and so on (ITU-R
// BT.601-7 2.5.1, BT.709-6 3; JFIF for the full range).
struct YuvMatrix {
  int y_scale, y_offset, v_to_red, u_to_green, v_to_green, u_to_blue;
};
inline constexpr YuvMatrix kBt601Limited{298, 16, 409, 100, 208, 516};
inline constexpr YuvMatrix kBt601Full{256, 0, 359, 88, 183, 454};
inline constexpr YuvMatrix kBt709Limited{298, 16, 459, 55, 136, 541};
inline constexpr YuvMatrix kBt709Full{256, 0, 403, 48, 120, 475};

// Bytes that a picture must have at least; the last row need not be padded. NV12: stride is that of the luminance; the
// colours follow at stride * height with the same stride. Odd widths and heights are as V4L2 rounds them: a last column
// or row shares the colour before it.
std::size_t yuyvBytes(int width, int height, std::size_t stride);
std::size_t nv12Bytes(int width, int height, std::size_t stride);
std::size_t greyBytes(int width, int height, std::size_t stride);

// `source` has at least the bytes above, `bgr` 3 * width * height. No allocation.
void yuyvToBgr(std::span<const std::uint8_t> source, int width, int height, std::size_t stride, const YuvMatrix& matrix,
               std::span<std::uint8_t> bgr);
void nv12ToBgr(std::span<const std::uint8_t> source, int width, int height, std::size_t stride, const YuvMatrix& matrix,
               std::span<std::uint8_t> bgr);
void greyToBgr(std::span<const std::uint8_t> source, int width, int height, std::size_t stride,
               std::span<std::uint8_t> bgr);

}  // namespace volto::capture::v4l2
