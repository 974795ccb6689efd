// The part of pixel_conversion that runs over whole rows, with the widest instructions that the processor has.
#pragma once

#include <cstddef>
#include <cstdint>

#include "capture/v4l2/pixel_conversion.h"

namespace volto::capture::v4l2 {

// Sixteen pixels at a time; they give how many of the row's `width` they have done (a multiple of 16). The arithmetic
// is in integers and so the same on every processor.
std::size_t yuyvRow(const std::uint8_t* yuyv, std::size_t width, const YuvMatrix& matrix, std::uint8_t* bgr);
std::size_t nv12Row(const std::uint8_t* y, const std::uint8_t* uv, std::size_t width, const YuvMatrix& matrix,
                    std::uint8_t* bgr);
std::size_t greyRow(const std::uint8_t* grey, std::size_t width, std::uint8_t* bgr);

}  // namespace volto::capture::v4l2
