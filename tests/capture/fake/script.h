// Script: what a fake camera is and what befalls it, as text with one thing per line.
//
//   camera "Fake Camera" as video0 bus usb-0000:00:14.0-1 by-id usb-Fake_Camera_0001-video-index0
//   formats YUYV 640x480@30,15 320x240@30 / MJPG 640x480@30      (one line for the camera above it)
//   at 30 unplug                  thirty picture times after the first start of its stream
//   at 2.5s replug as video2      two and a half seconds after it; "bus X" and "by-id X" may follow
//   s_fmt EBUSY 2                 without "at": from the beginning. The next two calls fail; "forever" or nothing: all
//   of them
//
// What can befall it: fault_state.cpp, and `unplug`, `replug`, `chmod` in world.cpp. '#' starts a comment.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace volto::fake {

struct FormatSpec {
  std::string fourcc;
  int width = 0, height = 0;
  std::vector<double> rates_hz;  // fastest first
};

struct CameraSpec {
  std::string card = "Fake Camera";
  std::string driver = "uvcvideo";
  std::string bus = "usb-0000:00:14.0-1";
  std::string by_id;
  int number = 0;         // of its node, /dev/videoN; -1: not plugged in
  bool button = false;    // has a control "Disconnect"
  bool metadata = false;  // a metadata node beside the camera
  std::vector<FormatSpec> formats;
};

// One line after "at"; its words mean what its name says.
struct Fault {
  std::int64_t after_ns = -1;  // after the first STREAMON; -1: from the beginning
  double after_frames = -1;    // the same in picture times of the rate agreed then
  std::size_t camera = 0;
  std::vector<std::string> words;
  int line = 0;
};

struct Script {
  std::vector<CameraSpec> cameras;  // one ordinary camera when the script has none
  std::vector<Fault> faults;        // in the order of the text
};

// Throws std::invalid_argument "line N: ...".
Script parseScript(std::string_view text);

// "EBUSY" -> 16; 0 for what is no error's name.
int errorNumber(std::string_view name);
// "2500ms", "2.5s", "40us" -> ns. Throws std::invalid_argument.
std::int64_t parseDuration(std::string_view text);
double parseNumber(std::string_view text);

}  // namespace volto::fake
