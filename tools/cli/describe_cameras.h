// What `volto cameras` says, as JSON and in words.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "capture/v4l2/discovery.h"

namespace volto::cli {

// {"cameras": [{"path", "name", "by_id", "by_path", "bus", "driver", "problem", "formats": [{"format", "description",
// "readable", "sizes": [{"width", "height", "fps": [..]}]}], "controls": [{"name", "kind", "min", "max", "step",
// "default", "value", "writable", "menu": {"1": "50 Hz"}}]}]}
nlohmann::ordered_json describeCameras(const std::vector<capture::v4l2::Camera>& cameras);

// Lines for people.
std::string camerasInWords(const std::vector<capture::v4l2::Camera>& cameras);

}  // namespace volto::cli
