// ControlSet: the controls of a fake camera, those that a USB camera has.
#pragma once

#include <linux/videodev2.h>
#include <string>
#include <vector>

namespace volto::fake {

struct FakeControl {
  std::uint32_t id;
  std::uint32_t type;
  std::string name;
  int minimum, maximum, step, default_value;
  std::vector<std::pair<int, std::string>> menu;
  int value;
};

// All functions take what the ioctl of that name takes, already copied from the caller, and give 0 or -errno.
class ControlSet {
 public:
  ControlSet();
  void addDisconnectButton();
  int queryCtrl(v4l2_queryctrl& query) const;
  int queryExtCtrl(v4l2_query_ext_ctrl& query) const;
  int queryMenu(v4l2_querymenu& query) const;
  int getCtrl(v4l2_control& control) const;
  int setCtrl(v4l2_control& control);
  enum class Access { get, set, attempt };
  // `array` is the caller's controls, `header.count` of them.
  int extCtrls(v4l2_ext_controls& header, v4l2_ext_control* array, Access access);
  const FakeControl* find(std::uint32_t id) const;
  const std::vector<FakeControl>& all() const { return controls_; }
  std::vector<int> values() const;  // in that order
  bool takeDisconnect();            // the button was pressed since the last time

 private:
  const FakeControl* findNext(std::uint32_t id) const;
  static int check(const FakeControl& control, int& value);
  std::vector<FakeControl> controls_;  // by id
  bool disconnect_ = false;
};

}  // namespace volto::fake
