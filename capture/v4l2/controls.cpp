#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <linux/videodev2.h>
#include <string_view>

#include "capture/image_source.h"
#include "capture/v4l2/discovery.h"

namespace volto::capture::v4l2 {

namespace {

constexpr int kMostControls = 1024;

// "Power Line Frequency" -> "power_line_frequency", as v4l2-ctl does it.
std::string variableName(std::string_view text) {
  std::string name;
  for (const char c : text) {
    const bool upper = c >= 'A' && c <= 'Z';
    if (upper || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'))
      name += upper ? static_cast<char>(c - 'A' + 'a') : c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

// Names that kernels gave the same control at different times.
struct Alias {
  std::uint32_t id;
  std::string_view name;
};
constexpr std::array kAliases{
    Alias{V4L2_CID_EXPOSURE_AUTO_PRIORITY, "exposure_dynamic_framerate"},
    Alias{V4L2_CID_EXPOSURE_AUTO_PRIORITY, "exposure_auto_priority"},
    Alias{V4L2_CID_EXPOSURE_AUTO, "auto_exposure"},
    Alias{V4L2_CID_EXPOSURE_AUTO, "exposure_auto"},
    Alias{V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_time_absolute"},
    Alias{V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_absolute"},
    Alias{V4L2_CID_AUTO_WHITE_BALANCE, "white_balance_automatic"},
    Alias{V4L2_CID_AUTO_WHITE_BALANCE, "white_balance_temperature_auto"},
    Alias{V4L2_CID_FOCUS_AUTO, "focus_automatic_continuous"},
    Alias{V4L2_CID_FOCUS_AUTO, "focus_auto"},
    Alias{V4L2_CID_POWER_LINE_FREQUENCY, "power_line_frequency"},
};

std::string kindOf(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
      return "integer";
    case V4L2_CTRL_TYPE_BOOLEAN:
      return "boolean";
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return "menu";
    case V4L2_CTRL_TYPE_BUTTON:
      return "button";
    case V4L2_CTRL_TYPE_BITMASK:
      return "bitmask";
    default:
      return "other";
  }
}

void addMenu(const Handle& handle, std::uint32_t type, Control& control) {
  for (int i = control.minimum; i <= control.maximum && i - control.minimum < 256; ++i) {
    v4l2_querymenu entry{};
    entry.id = control.id;
    entry.index = static_cast<std::uint32_t>(i);
    if (handle.ioctl(VIDIOC_QUERYMENU, &entry) != 0) continue;  // menus have holes
    if (type == V4L2_CTRL_TYPE_INTEGER_MENU) {
      control.menu.emplace_back(i, std::to_string(entry.value));
    } else {
      const auto* const text = reinterpret_cast<const char*>(entry.name);
      control.menu.emplace_back(i, std::string(text, strnlen(text, sizeof(entry.name))));
    }
  }
}

const Control* findControl(const std::vector<Control>& controls, const std::string& wanted) {
  const std::string name = variableName(wanted);
  for (const Control& control : controls) {
    if (control.name == name) return &control;
  }
  for (const Alias& alias : kAliases) {
    if (alias.name != name) continue;
    for (const Control& control : controls) {
      if (control.id == alias.id) return &control;
    }
  }
  return nullptr;
}

}  // namespace

std::vector<Control> enumerateControls(const Handle& handle) {
  std::vector<Control> controls;
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  for (int i = 0; i < kMostControls && handle.ioctl(VIDIOC_QUERYCTRL, &query) == 0; ++i) {
    const std::uint32_t id = query.id;
    if ((query.flags & V4L2_CTRL_FLAG_DISABLED) == 0 && query.type != V4L2_CTRL_TYPE_CTRL_CLASS) {
      Control control;
      control.id = id;
      const auto* const text = reinterpret_cast<const char*>(query.name);
      control.name = variableName({text, strnlen(text, sizeof(query.name))});
      control.kind = kindOf(query.type);
      control.minimum = query.minimum;
      control.maximum = query.maximum;
      control.step = query.step;
      control.default_value = query.default_value;
      control.writable = (query.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0;
      if (control.kind == "menu") addMenu(handle, query.type, control);
      if ((query.flags & V4L2_CTRL_FLAG_WRITE_ONLY) == 0) {
        v4l2_control value{id, 0};
        if (handle.ioctl(VIDIOC_G_CTRL, &value) == 0) control.value = value.value;
      }
      controls.push_back(std::move(control));
    }
    query = {};
    query.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

void setControls(const Handle& handle, const std::string& path,
                 const std::vector<std::pair<std::string, int>>& controls) {
  if (controls.empty()) return;
  const std::vector<Control> there = enumerateControls(handle);
  for (const auto& [name, value] : controls) {
    const Control* const control = findControl(there, name);
    if (control == nullptr) {
      std::string names;
      for (const Control& each : there) names += (names.empty() ? "" : ", ") + each.name;
      throw DeviceError(path + " has no control " + name + "; it has " + (names.empty() ? "none" : names));
    }
    if (!control->writable) throw DeviceError(path + ": control " + control->name + " can only be read");
    if (control->kind != "button" && (value < control->minimum || value > control->maximum))
      throw DeviceError(path + ": control " + control->name + " goes from " + std::to_string(control->minimum) +
                        " to " + std::to_string(control->maximum) + ", not to " + std::to_string(value));
    v4l2_control request{control->id, value};
    if (const int error = handle.ioctl(VIDIOC_S_CTRL, &request); error != 0)
      throw DeviceError(path + ": control " + control->name + " cannot be set to " + std::to_string(value) + ": " +
                        std::strerror(-error));
  }
}

}  // namespace volto::capture::v4l2
