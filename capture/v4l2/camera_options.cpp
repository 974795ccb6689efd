#include "capture/v4l2/camera_options.h"

#include <algorithm>
#include <charconv>
#include <stdexcept>

#include "capture/image.h"

namespace volto::capture {

namespace {

constexpr std::string_view kScheme = "camera:";

bool parseWhole(std::string_view text, int& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

bool isCameraSpec(std::string_view text) { return text.starts_with(kScheme); }

std::string cameraOfSpec(std::string_view spec) {
  if (isCameraSpec(spec)) spec.remove_prefix(kScheme.size());
  return std::string(spec);
}

std::pair<int, int> parseImageSize(std::string_view text) {
  const std::size_t x = text.find_first_of("xX");
  int width = 0, height = 0;
  if (x == std::string_view::npos || !parseWhole(text.substr(0, x), width) || !parseWhole(text.substr(x + 1), height) ||
      width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide)
    throw std::invalid_argument("'" + std::string(text) + "' is not a picture size; write WIDTHxHEIGHT, as 640x480");
  return {width, height};
}

std::string parsePixelFormat(std::string_view text) {
  std::string name(text);
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  if (name == "MJPEG" || name == "JPEG") name = "MJPG";
  if (name == "YUY2" || name == "YUYV422") name = "YUYV";
  if (name == "Y800" || name == "GRAY" || name == "GRAY8") name = "GREY";
  if (name != "MJPG" && name != "YUYV" && name != "NV12" && name != "GREY")
    throw std::invalid_argument("'" + std::string(text) +
                                "' is not a picture format that Volto reads; use MJPG, YUYV, NV12 or GREY");
  return name;
}

std::pair<std::string, int> parseCameraControl(std::string_view text) {
  const std::size_t equals = text.find('=');
  int value = 0;
  if (equals == std::string_view::npos || equals == 0 || !parseWhole(text.substr(equals + 1), value))
    throw std::invalid_argument("'" + std::string(text) +
                                "' does not set a control; write NAME=NUMBER, as power_line_frequency=1");
  return {std::string(text.substr(0, equals)), value};
}

}  // namespace volto::capture
