#include "tests/capture/fake/control_set.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace volto::fake {

namespace {

constexpr std::uint32_t kNextFlags = V4L2_CTRL_FLAG_NEXT_CTRL | V4L2_CTRL_FLAG_NEXT_COMPOUND;

// As the kernel's test driver has one: it unplugs the camera.
constexpr std::uint32_t kDisconnect = V4L2_CTRL_CLASS_CAMERA | 0xF000U;

std::uint32_t classOf(std::uint32_t id) { return V4L2_CTRL_ID2CLASS(id); }

template <std::size_t N, class Char>
void putName(Char (&out)[N], const std::string& name) {
  std::memset(out, 0, N);
  std::memcpy(out, name.data(), std::min(name.size(), N - 1));
}

}  // namespace

ControlSet::ControlSet() {
  const auto title = [](std::uint32_t id, const char* name) {
    return FakeControl{id, V4L2_CTRL_TYPE_CTRL_CLASS, name, 0, 0, 0, 0, {}, 0};
  };
  controls_ = {
      title(V4L2_CID_USER_CLASS, "User Controls"),
      {V4L2_CID_BRIGHTNESS, V4L2_CTRL_TYPE_INTEGER, "Brightness", -64, 64, 1, 0, {}, 0},
      {V4L2_CID_AUTO_WHITE_BALANCE, V4L2_CTRL_TYPE_BOOLEAN, "White Balance, Automatic", 0, 1, 1, 1, {}, 1},
      {V4L2_CID_POWER_LINE_FREQUENCY,
       V4L2_CTRL_TYPE_MENU,
       "Power Line Frequency",
       0,
       2,
       1,
       1,
       {{0, "Disabled"}, {1, "50 Hz"}, {2, "60 Hz"}},
       1},
      title(V4L2_CID_CAMERA_CLASS, "Camera Controls"),
      {V4L2_CID_EXPOSURE_AUTO,
       V4L2_CTRL_TYPE_MENU,
       "Auto Exposure",
       0,
       3,
       1,
       3,
       {{1, "Manual Mode"}, {3, "Aperture Priority Mode"}},
       3},  // with holes, as real ones have
      {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CTRL_TYPE_INTEGER, "Exposure Time, Absolute", 1, 5000, 1, 157, {}, 157},
      {V4L2_CID_EXPOSURE_AUTO_PRIORITY, V4L2_CTRL_TYPE_BOOLEAN, "Exposure, Dynamic Framerate", 0, 1, 1, 0, {}, 1},
  };
  std::sort(controls_.begin(), controls_.end(), [](const FakeControl& a, const FakeControl& b) { return a.id < b.id; });
}

void ControlSet::addDisconnectButton() {
  controls_.push_back({kDisconnect, V4L2_CTRL_TYPE_BUTTON, "Disconnect", 0, 0, 0, 0, {}, 0});
}

bool ControlSet::takeDisconnect() { return std::exchange(disconnect_, false); }

std::vector<int> ControlSet::values() const {
  std::vector<int> out;
  for (const FakeControl& control : controls_) out.push_back(control.value);
  return out;
}

const FakeControl* ControlSet::find(std::uint32_t id) const {
  for (const FakeControl& control : controls_) {
    if (control.id == id) return &control;
  }
  return nullptr;
}

const FakeControl* ControlSet::findNext(std::uint32_t id) const {
  // Only compound controls were asked for, and there are none.
  if ((id & kNextFlags) == V4L2_CTRL_FLAG_NEXT_COMPOUND) return nullptr;
  if ((id & kNextFlags) == 0) return find(id);
  id &= ~kNextFlags;
  for (const FakeControl& control : controls_) {
    if (control.id > id) return &control;
  }
  return nullptr;
}

int ControlSet::queryCtrl(v4l2_queryctrl& query) const {
  const FakeControl* const control = findNext(query.id);
  if (control == nullptr) return -EINVAL;
  query = {};
  query.id = control->id;
  query.type = control->type;
  putName(query.name, control->name);
  query.minimum = control->minimum;
  query.maximum = control->maximum;
  query.step = control->step;
  query.default_value = control->default_value;
  if (control->type == V4L2_CTRL_TYPE_CTRL_CLASS) query.flags = V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_WRITE_ONLY;
  return 0;
}

int ControlSet::queryExtCtrl(v4l2_query_ext_ctrl& query) const {
  v4l2_queryctrl plain{};
  plain.id = query.id;
  if (const int error = queryCtrl(plain); error != 0) return error;
  query = {};
  query.id = plain.id;
  query.type = plain.type;
  std::memcpy(query.name, plain.name, sizeof(query.name));
  query.minimum = plain.minimum;
  query.maximum = plain.maximum;
  query.step = static_cast<std::uint64_t>(plain.step);
  query.default_value = plain.default_value;
  query.flags = plain.flags;
  if (plain.type != V4L2_CTRL_TYPE_CTRL_CLASS) {
    query.elem_size = 4;
    query.elems = 1;
  }
  return 0;
}

int ControlSet::queryMenu(v4l2_querymenu& query) const {
  const FakeControl* const control = find(query.id);
  if (control == nullptr || control->type != V4L2_CTRL_TYPE_MENU) return -EINVAL;
  for (const auto& [index, name] : control->menu) {
    if (static_cast<std::uint32_t>(index) != query.index) continue;
    query.reserved = 0;
    std::memset(&query.name, 0, sizeof(query.name));
    std::memcpy(&query.name, name.data(), std::min(name.size(), sizeof(query.name) - 1));
    return 0;
  }
  return -EINVAL;
}

int ControlSet::getCtrl(v4l2_control& control) const {
  const FakeControl* const found = find(control.id);
  if (found == nullptr) return -EINVAL;
  if (found->type == V4L2_CTRL_TYPE_CTRL_CLASS) return -EACCES;
  control.value = found->value;
  return 0;
}

// The kernel's v4l2-ctrls: menus and booleans must be exact, integers are led to the nearest.
int ControlSet::check(const FakeControl& control, int& value) {
  switch (control.type) {
    case V4L2_CTRL_TYPE_CTRL_CLASS:
      return -EACCES;
    case V4L2_CTRL_TYPE_BOOLEAN:
      value = value != 0 ? 1 : 0;
      return 0;
    case V4L2_CTRL_TYPE_MENU: {
      if (value < control.minimum || value > control.maximum) return -ERANGE;
      const bool there =
          std::any_of(control.menu.begin(), control.menu.end(), [&](const auto& m) { return m.first == value; });
      return there ? 0 : -EINVAL;
    }
    default:
      value = std::clamp(value, control.minimum, control.maximum);
      return 0;
  }
}

int ControlSet::setCtrl(v4l2_control& control) {
  for (FakeControl& each : controls_) {
    if (each.id != control.id) continue;
    if (each.id == kDisconnect) {
      disconnect_ = true;
      return 0;
    }
    if (const int error = check(each, control.value); error != 0) return error;
    each.value = control.value;
    return 0;
  }
  return -EINVAL;
}

int ControlSet::extCtrls(v4l2_ext_controls& header, v4l2_ext_control* array, Access access) {
  const std::uint32_t which = header.which;
  const bool by_class = which != V4L2_CTRL_WHICH_CUR_VAL && which != V4L2_CTRL_WHICH_DEF_VAL &&
                        which != static_cast<std::uint32_t>(V4L2_CTRL_WHICH_REQUEST_VAL);
  header.error_idx = header.count;
  if (which == V4L2_CTRL_WHICH_REQUEST_VAL) return -EINVAL;
  if (which == V4L2_CTRL_WHICH_DEF_VAL && access != Access::get) return -EINVAL;
  if (header.count == 0) {
    if (!by_class) return 0;
    const bool there = std::any_of(controls_.begin(), controls_.end(),
                                   [&](const FakeControl& c) { return classOf(c.id) == classOf(which); });
    return there ? 0 : -EINVAL;
  }
  // All are looked at before any is changed; error_idx is the count when nothing was done, except in TRY.
  for (std::uint32_t i = 0; i < header.count; ++i) {
    v4l2_ext_control& each = array[i];
    const FakeControl* const control = find(each.id);
    int error = 0;
    if (control == nullptr || (by_class && classOf(each.id) != classOf(which)))
      error = -EINVAL;
    else if (control->type == V4L2_CTRL_TYPE_CTRL_CLASS)
      error = -EACCES;
    if (error == 0 && access != Access::get) {
      int value = each.value;
      error = check(*control, value);
      if (error == 0) each.value = value;
    }
    if (error != 0) {
      if (access != Access::set) header.error_idx = access == Access::attempt ? i : header.count;
      return error;
    }
  }
  for (std::uint32_t i = 0; i < header.count; ++i) {
    for (FakeControl& control : controls_) {
      if (control.id != array[i].id) continue;
      if (access == Access::get)
        array[i].value = which == V4L2_CTRL_WHICH_DEF_VAL ? control.default_value : control.value;
      if (access == Access::set) control.value = array[i].value;
    }
  }
  return 0;
}

}  // namespace volto::fake
