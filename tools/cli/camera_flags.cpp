#include "tools/cli/camera_flags.h"

#include <cmath>
#include <stdexcept>

#include <CLI/CLI.hpp>

#include "tools/cli/exit_status.h"

namespace volto::cli {

void addCameraFlags(CLI::App& app, CameraFlags& flags) {
  app.add_option("--size", flags.size, "picture size to ask the camera for (default 640x480; the nearest it has)")
      ->type_name("WxH");
  app.add_option("--fps", flags.fps, "pictures a second to ask the camera for (default 30)")->type_name("N");
  app.add_option("--format", flags.format, "MJPG, YUYV, NV12 or GREY (default: raw where it is as fast)")
      ->type_name("F");
  app.add_option(
         "--control", flags.controls,
         "set a control of the camera, as exposure_dynamic_framerate=0 or power_line_frequency=1; may be repeated")
      ->type_name("NAME=N")
      ->take_all();
}

capture::CameraOptions cameraOptions(const std::string& spec, const CameraFlags& flags) {
  capture::CameraOptions options;
  options.camera = capture::cameraOfSpec(spec);
  if (!std::isfinite(flags.fps) || flags.fps < 0 || flags.fps > 1000)
    throw CommandError(kWrongUsage, "--fps is a number of pictures a second from 1 to 1000");
  options.rate_hz = flags.fps;
  try {
    if (!flags.size.empty()) std::tie(options.width, options.height) = capture::parseImageSize(flags.size);
    if (!flags.format.empty()) options.format = capture::parsePixelFormat(flags.format);
    for (const std::string& control : flags.controls) options.controls.push_back(capture::parseCameraControl(control));
  } catch (const std::invalid_argument& error) {
    throw CommandError(kWrongUsage, error.what());
  }
  return options;
}

}  // namespace volto::cli
