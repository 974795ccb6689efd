#include "tests/capture/fake/virtual_system.h"

#include <algorithm>
#include <cerrno>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

namespace volto::fake {

VirtualSystem::~VirtualSystem() = default;

void VirtualSystem::sleep(std::int64_t ns) { world_.advance(world_.now() + ns); }

int VirtualSystem::open(const char* path) {
  // A real descriptor, so that one that is left open is seen in /proc/self/fd.
  const int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (fd < 0) return -errno;
  const int error = world_.open(path, fd);
  if (error == 0) return fd;
  ::close(fd);
  return error;
}

void VirtualSystem::close(int fd) {
  world_.close(fd);
  ::close(fd);
}

int VirtualSystem::ioctl(int fd, unsigned long request, void* argument) {
  sleep(ioctl_cost_ns);
  return world_.ioctl(fd, request, argument);
}

void* VirtualSystem::map(int fd, std::size_t length, std::int64_t offset) {
  void* const address = world_.map(fd, length, PROT_READ | PROT_WRITE, MAP_SHARED, offset);
  return address == MAP_FAILED ? nullptr : address;
}

void VirtualSystem::unmap(void* address, std::size_t length) { world_.unmap(address, length); }

int VirtualSystem::poll(pollfd* fds, std::size_t count, int timeout_ms) {
  ++polls;
  const std::int64_t deadline = timeout_ms < 0 ? kForever : world_.now() + std::int64_t{timeout_ms} * 1'000'000;
  for (;;) {
    int ready = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t events =
          fds[i].fd == kWatchFd ? (world_.nodeChanges() != seen_changes_ ? POLLIN : 0U) : world_.readiness(fds[i].fd);
      fds[i].revents =
          static_cast<short>(events & (static_cast<std::uint32_t>(fds[i].events) | POLLERR | POLLHUP | POLLNVAL));
      if (fds[i].revents != 0) ++ready;
    }
    if (ready > 0 || world_.now() >= deadline) {
      sleep(1000);  // nothing is free
      return ready;
    }
    world_.advance(std::min(deadline, std::max(world_.nextEventNs(), world_.now() + 1)));
  }
}

std::vector<capture::v4l2::VideoNode> VirtualSystem::listNodes() {
  std::vector<capture::v4l2::VideoNode> out;
  for (const FakeNode& node : world_.nodes()) out.push_back({node.path, node.by_id, {}});
  return out;
}

}  // namespace volto::fake
