// CameraOptions: which camera, and what is wished of it.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace volto::capture {

struct CameraOptions {
  // "/dev/video0", a name under /dev/v4l/by-id or by-path, or (part of) the card's name in any case; empty: the first
  // camera there is.
  std::string camera;
  // Zero or empty: Volto chooses (640x480 at 30 or the nearest the camera has, raw formats before MJPG when they are as
  // fast).
  int width = 0;
  int height = 0;
  double rate_hz = 0;
  std::string format;  // "MJPG", "YUYV", "NV12", "GREY"
  // Names as v4l2-ctl writes them ("exposure_dynamic_framerate", "power_line_frequency"), set in this order, again
  // after every reconnect.
  std::vector<std::pair<std::string, int>> controls;
  // false: a camera that is not there or not usable when the source is made is a DeviceError. true: it is waited for.
  bool wait_for_camera = false;
};

// "camera:NAME" -> "NAME", "camera:" -> "" (any); nothing else is a camera.
bool isCameraSpec(std::string_view text);
std::string cameraOfSpec(std::string_view spec);

// "640x480", "MJPG" (any case; "MJPEG", "YUY2", "Y800" too), "name=value". Throw std::invalid_argument with one line
// for people.
std::pair<int, int> parseImageSize(std::string_view text);
std::string parsePixelFormat(std::string_view text);
std::pair<std::string, int> parseCameraControl(std::string_view text);

}  // namespace volto::capture
