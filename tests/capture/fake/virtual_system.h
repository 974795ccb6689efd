// VirtualSystem: the camera code's System on a World in virtual time: waiting costs none.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "capture/v4l2/system.h"
#include "tests/capture/fake/world.h"

namespace volto::fake {

class VirtualSystem final : public capture::v4l2::System {
 public:
  explicit VirtualSystem(std::string_view script) : world_(script, kStartNs) {}
  ~VirtualSystem() override;

  static constexpr std::int64_t kStartNs = 100'000'000'000;  // a computer that has been up for a while

  World& world() { return world_; }
  // Time passes while nobody looks.
  void sleep(std::int64_t ns);

  bool watch_works = true;  // false: no inotify, as in some containers
  std::string holder, group = "video";
  std::uint64_t polls = 0;  // how often poll was called: a source that runs in circles shows here
  std::int64_t ioctl_cost_ns = 1000;

  int open(const char* path) override;
  void close(int fd) override;
  int ioctl(int fd, unsigned long request, void* argument) override;
  void* map(int fd, std::size_t length, std::int64_t offset) override;
  void unmap(void* address, std::size_t length) override;
  int poll(pollfd* fds, std::size_t count, int timeout_ms) override;
  std::int64_t nowNs() override { return world_.now(); }
  std::vector<capture::v4l2::VideoNode> listNodes() override;
  int watch() override { return watch_works ? kWatchFd : -1; }
  void clearWatch() override { seen_changes_ = world_.nodeChanges(); }
  std::string holderOf(const std::string&) override { return holder; }
  std::string groupOf(const std::string&) override { return group; }

 private:
  static constexpr int kWatchFd = 1 << 20;
  World world_;
  std::uint64_t seen_changes_ = 0;
};

}  // namespace volto::fake
