// StreamFormat: what is agreed with the camera about the pictures it sends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/v4l2/camera_options.h"
#include "capture/v4l2/discovery.h"
#include "capture/v4l2/pixel_conversion.h"

namespace volto::capture::v4l2 {

// The formats that Volto reads: MJPG (and JPEG), YUYV, NV12, GREY.
enum class Coding : std::uint8_t { mjpg, yuyv, nv12, grey };

bool isReadable(std::uint32_t code);

struct StreamFormat {
  std::uint32_t code = 0;
  std::string fourcc;
  Coding coding = Coding::yuyv;
  int width = 0;
  int height = 0;
  std::size_t stride = 0;       // bytes from row to row; 0 for MJPG
  std::size_t least_bytes = 0;  // that a whole picture has; 1 for MJPG
  double rate_hz = 0;           // 0: the camera does not say
  YuvMatrix matrix = kBt601Limited;
};

// What to ask for.
struct FormatWish {
  std::uint32_t code = 0;
  int width = 0;
  int height = 0;
  double rate_hz = 0;
};

// The best that the camera says it has for what is wanted. Sizes come first, then the rate, then raw formats before
// MJPG (a picture without the blocks of JPEG, and cheaper) and GREY last. Throws DeviceError that names what is offered
// when nothing fits. `mjpg_only`: for a bus that is too slow for raw pictures.
FormatWish chooseFormat(const std::vector<PixelFormat>& offered, const CameraOptions& options, const std::string& path,
                        bool mjpg_only = false);

// Asks, and reads back what it really is: drivers adjust and say yes. Throws DeviceError: in use, or not a format that
// Volto reads.
StreamFormat agreeOnFormat(const Handle& handle, const FormatWish& wish, const std::string& path);

}  // namespace volto::capture::v4l2
