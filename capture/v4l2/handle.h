// Handle: an open video node.
#pragma once

#include <string>
#include <utility>

#include "capture/v4l2/system.h"

namespace volto::capture::v4l2 {

class Handle {
 public:
  Handle() = default;
  // Throws DeviceError that says why the node cannot be opened and what to do about it.
  Handle(System& system, const std::string& path);
  Handle(Handle&& other) noexcept : system_(other.system_), fd_(std::exchange(other.fd_, -1)) {}
  Handle& operator=(Handle&& other) noexcept;
  ~Handle() { close(); }

  // 0 or -errno; tried again as long as a signal interrupts it.
  int ioctl(unsigned long request, void* argument) const;
  void close();
  bool isOpen() const { return fd_ >= 0; }
  int fd() const { return fd_; }
  System& system() const { return *system_; }

 private:
  System* system_ = nullptr;
  int fd_ = -1;
};

// "in use by pid 712 (zoom)" or "in use by another program".
std::string describeUse(System& system, const std::string& path);

}  // namespace volto::capture::v4l2
