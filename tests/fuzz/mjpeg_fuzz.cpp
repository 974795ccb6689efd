// Any bytes, taken for a picture of a camera: decoded into exactly its size, or refused with a reason; the next good
// one is decoded all the same.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "capture/v4l2/mjpeg_decoder.h"

using volto::capture::v4l2::MjpegDecoder;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr int kWidth = 64, kHeight = 48;
  constexpr std::size_t kBytes = 3 * kWidth * kHeight, kGuard = 16;
  static MjpegDecoder decoder;  // as a camera's: one for many pictures
  static std::vector<std::uint8_t> picture(kBytes + kGuard);
  for (std::size_t i = 0; i < kGuard; ++i) picture[kBytes + i] = 0xA5;
  const auto result = decoder.decode({data, size}, kWidth, kHeight, std::span(picture).first(kBytes));
  for (std::size_t i = 0; i < kGuard; ++i)
    if (picture[kBytes + i] != 0xA5) std::abort();
  if (result != MjpegDecoder::Result::good && decoder.problem().empty()) std::abort();
  return 0;
}
