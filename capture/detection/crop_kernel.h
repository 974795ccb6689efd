// The inner loops of sampleCrop(), eight pixels at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "capture/detection/crop.h"

namespace volto::capture {

// Pixel positions are fixed point with so many bits behind the point.
inline constexpr int kFixedBits = 16;
inline constexpr int kMostTaps = 8;

struct CropSamples {
  const Image* image;
  ImageFromCrop image_from_crop;
  int width, height;  // of the crop
  int taps;           // 1: one sample between four pixels; n: n x n pixels, averaged; at most kMostTaps
  // Blue, green, red of the image: where they go, and what a sum of all samples is multiplied with and added to it.
  std::array<float*, 3> planes;
  std::array<float, 3> factor, offset;
};

// Every sample must lie two pixels and more from the image's border. False when this processor has no instructions for
// it, or the crop is too narrow: nothing has been done then.
bool sampleInside(const CropSamples& crop);

// Means of 2 x 2 pixels, rounded: `width` of them from two rows of an image that lie below each other.
// sums[k] = the k-th bytes of all rows, at most kMostTaps, added up.
void addRows(std::span<const std::uint8_t* const> rows, std::span<std::uint16_t> sums);

void halveRows(const std::uint8_t* above, const std::uint8_t* below, int width, std::uint8_t* out);

}  // namespace volto::capture
