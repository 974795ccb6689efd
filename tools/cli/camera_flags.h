// The flags by which a verb asks for a camera's pictures.
#pragma once

#include <string>
#include <vector>

#include "capture/v4l2/camera_options.h"

namespace CLI {
class App;
}

namespace volto::cli {

struct CameraFlags {
  std::string size;
  double fps = 0;
  std::string format;
  std::vector<std::string> controls;
};

// --size, --fps, --format, --control.
void addCameraFlags(CLI::App& app, CameraFlags& flags);

// `spec` is "camera:NAME" or a NAME alone. Throws CommandError (kWrongUsage).
capture::CameraOptions cameraOptions(const std::string& spec, const CameraFlags& flags);

}  // namespace volto::cli
