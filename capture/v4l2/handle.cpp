#include "capture/v4l2/handle.h"

#include <cerrno>
#include <cstring>

#include "capture/image_source.h"

namespace volto::capture::v4l2 {

namespace {

// A driver that is interrupted for ever is as good as gone.
constexpr int kMostInterruptions = 1000;

std::string whyNotOpen(System& system, const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return "there is no " + path + "; plug the camera in, or see volto cameras";
    case ENODEV:
    case ENXIO:
      return path + ": the device behind it is gone; plug it in again";
    case EACCES:
    case EPERM: {
      const std::string group = system.groupOf(path);
      return path + ": permission denied" +
             (group.empty() ? std::string("; ask for access to it")
              : group == "root"  // nobody should join that
                  ? std::string("; it belongs to root alone: a udev rule has to give it to a group (Debian: video)")
                  : "; it belongs to group " + group + ": sudo usermod -aG " + group + " $USER, then log in again");
    }
    case EBUSY:
      return path + " is " + describeUse(system, path) + "; close that first";
    case EMFILE:
    case ENFILE:
      return path + ": too many open files; raise the limit (ulimit -n)";
    default:
      return path + " cannot be opened: " + std::strerror(error);
  }
}

}  // namespace

Handle::Handle(System& system, const std::string& path) : system_(&system) {
  int result = -EINTR;
  for (int i = 0; i < kMostInterruptions && result == -EINTR; ++i) result = system.open(path.c_str());
  if (result < 0) throw DeviceError(whyNotOpen(system, path, -result));
  fd_ = result;
}

Handle& Handle::operator=(Handle&& other) noexcept {
  if (this != &other) {
    close();
    system_ = other.system_;
    fd_ = std::exchange(other.fd_, -1);
  }
  return *this;
}

int Handle::ioctl(unsigned long request, void* argument) const {
  int result = -EINTR;
  for (int i = 0; i < kMostInterruptions && result == -EINTR; ++i) result = system_->ioctl(fd_, request, argument);
  return result;
}

void Handle::close() {
  if (fd_ >= 0) system_->close(fd_);
  fd_ = -1;
}

std::string describeUse(System& system, const std::string& path) {
  const std::string holder = system.holderOf(path);
  return "in use by " + (holder.empty() ? std::string("another program") : holder);
}

}  // namespace volto::capture::v4l2
