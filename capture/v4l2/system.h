// System: everything that the camera code asks of the operating system, so that a scripted camera can stand in for a
// real one (tests/capture/fake).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <poll.h>
#include <string>
#include <vector>

namespace volto::capture::v4l2 {

// A video node of this machine, before anybody has opened it.
struct VideoNode {
  std::string path;     // "/dev/video0"
  std::string by_id;    // name of its link in /dev/v4l/by-id, with the maker's serial number; stays the same in another
                        // port; may be empty
  std::string by_path;  // name of its link in /dev/v4l/by-path: the port it is plugged into; may be empty
  bool operator==(const VideoNode&) const = default;
};

// Functions that fail give -errno and do not try again on EINTR: that is the caller's matter and so is tested.
class System {
 public:
  virtual ~System() = default;

  // The eight that a stream needs. Devices are opened for reading and writing, non-blocking, not inherited by other
  // programs.
  virtual int open(const char* path) = 0;
  virtual void close(int fd) = 0;
  virtual int ioctl(int fd, unsigned long request, void* argument) = 0;
  virtual void* map(int fd, std::size_t length,
                    std::int64_t offset) = 0;  // shared, readable and writable; nullptr: failed
  virtual void unmap(void* address, std::size_t length) = 0;
  virtual int poll(pollfd* fds, std::size_t count, int timeout_ms) = 0;
  virtual std::int64_t nowNs() = 0;                // CLOCK_MONOTONIC
  virtual std::vector<VideoNode> listNodes() = 0;  // by number

  // A descriptor that becomes readable when nodes come, go or get other permissions; -1: there is none, look from time
  // to time. It belongs to the system. clearWatch() forgets what has happened up to now.
  virtual int watch() = 0;
  virtual void clearWatch() = 0;

  // For messages. "pid 712 (zoom)" of somebody who has the node open, and the group that owns it; empty: not to be
  // found out.
  virtual std::string holderOf(const std::string& path) = 0;
  virtual std::string groupOf(const std::string& path) = 0;
};

std::unique_ptr<System> makeRealSystem();

}  // namespace volto::capture::v4l2
