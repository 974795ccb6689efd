// CameraSource: a Video4Linux2 camera as an ImageSource that survives what cameras do.
#pragma once

#include <memory>

#include "capture/image_source.h"
#include "capture/v4l2/camera_options.h"

namespace volto::capture {

namespace v4l2 {
class System;
}

// No thread. Unplugged, busy, frozen or broken: the state says so at once, the device is closed, and it is looked for
// again (inotify on /dev, and with a back-off of 0.25 to 5 s) under whatever number it comes back, known by its
// /dev/v4l/by-id name, else bus and card name. Throws DeviceError when the camera cannot be used now, for
// whatever reason, unless options.wait_for_camera is set: then the reason is the notice().
std::unique_ptr<ImageSource> openCamera(const CameraOptions& options);

// The same on another system: tests. `system` outlives the source.
std::unique_ptr<ImageSource> openCamera(const CameraOptions& options, v4l2::System& system);

}  // namespace volto::capture
