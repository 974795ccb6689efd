// Which cameras there are, what they can do, and which one is meant.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/v4l2/handle.h"
#include "capture/v4l2/system.h"

namespace volto::capture::v4l2 {

// Who a camera is: what stays when it is plugged in again.
struct Identity {
  std::string by_id;  // may be empty
  std::string card;   // "Integrated Camera: Integrated C"
  std::string driver;
  std::string bus;  // "usb-0000:00:14.0-6": the port
};

// What QUERYCAP says. Throws DeviceError when the node is not a V4L2 device.
struct Capabilities {
  Identity identity;  // without by_id
  bool captures =
      false;  // delivers pictures by streaming; false for metadata, output, radio and memory-to-memory nodes
  std::string why_not;
};
Capabilities queryCapabilities(const Handle& handle, const std::string& path);

struct FrameSize {
  int width = 0;
  int height = 0;
  std::vector<double> rates_hz;  // highest first; empty: the driver does not say
};

struct PixelFormat {
  std::string fourcc;       // "MJPG"; bytes that are no letters are written as '.'
  std::string description;  // the driver's own
  std::uint32_t code = 0;
  bool readable = false;  // by Volto
  std::vector<FrameSize>
      sizes;  // largest first; of a driver with ranges, the usual ones within them; empty: it does not say
};

struct Control {
  std::uint32_t id = 0;
  std::string name;  // as v4l2-ctl writes it
  std::string kind;  // "integer", "boolean", "menu", "button", "other"
  int minimum = 0, maximum = 0, step = 0, default_value = 0, value = 0;
  bool writable = false;
  std::vector<std::pair<int, std::string>> menu;
};

struct Camera {
  VideoNode node;
  Identity identity;
  std::vector<PixelFormat> formats;
  std::vector<Control> controls;
  std::string problem;  // one line; empty: usable
};

std::vector<PixelFormat> enumerateFormats(const Handle& handle);
std::vector<Control> enumerateControls(const Handle& handle);

// Every camera with all that it offers, by node number. Nodes that are no cameras are left out; cameras that cannot be
// opened are in it with their problem.
std::vector<Camera> listCameras(System& system);

// Sets by name; older and newer kernels' names of the same control are one. Throws DeviceError for a name or a value
// that the camera does not have.
void setControls(const Handle& handle, const std::string& path,
                 const std::vector<std::pair<std::string, int>>& controls);

// A camera that was found and is open.
struct FoundCamera {
  VideoNode node;
  Identity identity;
  Handle handle;
};

// The camera that a person names (CameraOptions::camera). Throws DeviceError: none, several that fit, or not usable.
FoundCamera findCamera(System& system, const std::string& wanted);

// The same camera again, wherever it is now: by its by-id name; else card and bus; else, where only one has it, the
// card. Nothing when it is not there; throws DeviceError when it is there and cannot be opened.
std::optional<FoundCamera> findAgain(System& system, const Identity& identity);

std::string fourccName(std::uint32_t code);

}  // namespace volto::capture::v4l2
