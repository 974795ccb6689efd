// The fake cameras under any program: LD_PRELOAD this library and it sees the cameras of a script as /dev/videoN, in
// real time.
//
//   VOLTO_FAKE_CAMERA        the script (script.h) itself, or "@FILE"
//   VOLTO_FAKE_ROOT          an empty folder; the library keeps a picture of /dev and /sys in it, so that folders can
//   be listed and watched LD_PRELOAD=libvolto_fake_camera_preload.so v4l2-ctl -d /dev/video0 --all
//
// A device's descriptor is a timerfd that is readable when the next picture is due, so that poll, select and epoll
// work; poll and select are also answered here, for errors and hang-ups. Programs that make system calls of their own
// (static ones, Go, libv4l2's open) are not reached.
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <linux/videodev2.h>
#include <map>
#include <mutex>
#include <optional>
#include <poll.h>
#include <sstream>
#include <string>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/timerfd.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>
#include <vector>

#include "tests/capture/fake/world.h"

namespace volto::fake {
namespace {

namespace fs = std::filesystem;

template <class F>
F real(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

std::int64_t monotonicNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// Cameras have major 81; the minor is the number.
constexpr unsigned kMajor = 81;

struct Shim {
  std::recursive_mutex mutex;
  std::optional<World> world;
  std::string root;
  std::vector<FakeNode> shown;  // in the folder of nodes
  std::map<int, bool> blocking;
  std::map<int, std::string> paths;

  Shim() {
    const char* const script = std::getenv("VOLTO_FAKE_CAMERA");
    const char* const folder = std::getenv("VOLTO_FAKE_ROOT");
    if (script == nullptr || folder == nullptr) return;
    std::string text = script;
    if (text.starts_with('@')) {
      std::ifstream file(text.substr(1));
      std::ostringstream all;
      all << file.rdbuf();
      text = all.str();
    }
    std::replace(text.begin(), text.end(), ';', '\n');
    try {
      world.emplace(text, monotonicNs());
    } catch (const std::exception& error) {
      std::fprintf(stderr, "VOLTO_FAKE_CAMERA: %s\n", error.what());
      std::abort();
    }
    // Another process's memory would be read with the same call: a pointer that leads nowhere is an error and not a
    // crash.
    world->copy = [](void* to, const void* from, std::size_t bytes) {
      const iovec local{to, bytes};
      const iovec remote{const_cast<void*>(from), bytes};
      return process_vm_readv(getpid(), &local, 1, &remote, 1, 0) == static_cast<ssize_t>(bytes) ||
             writeTo(to, from, bytes);
    };
    root = folder;
    std::error_code ignored;  // what a program before this one left there
    fs::remove_all(root + "/dev", ignored);
    fs::remove_all(root + "/sys", ignored);
    for (const char* const sub : {"/dev", "/dev/v4l/by-id", "/sys/dev/char", "/sys/class/video4linux"})
      fs::create_directories(root + sub);
    showNodes();
  }

  // process_vm_readv refuses when `to` is the pointer that leads nowhere; process_vm_writev then too.
  static bool writeTo(void* to, const void* from, std::size_t bytes) {
    const iovec local{const_cast<void*>(from), bytes};
    const iovec remote{to, bytes};
    return process_vm_writev(getpid(), &local, 1, &remote, 1, 0) == static_cast<ssize_t>(bytes);
  }

  // Makes the picture of /dev as the world is now; inotify on it then tells the program.
  void showNodes() {
    const std::vector<FakeNode> nodes = world->nodes();
    if (nodes == shown) return;
    std::error_code ignored;
    for (const FakeNode& node : shown) {
      if (std::find(nodes.begin(), nodes.end(), node) != nodes.end()) continue;
      if (!node.by_id.empty()) fs::remove(root + "/dev/v4l/by-id/" + node.by_id, ignored);
      fs::remove(root + node.path, ignored);
    }
    for (const FakeNode& node : nodes) {
      if (std::find(shown.begin(), shown.end(), node) != shown.end()) continue;
      std::ofstream(root + node.path).flush();
      const std::string name = node.path.substr(5);
      if (!node.by_id.empty()) fs::create_symlink("../../" + name, root + "/dev/v4l/by-id/" + node.by_id, ignored);
      const std::string device = root + "/sys/dev/char/" + std::to_string(kMajor) + ":" + name.substr(5);
      fs::create_directories(device, ignored);
      std::ofstream(device + "/uevent") << "MAJOR=" << kMajor << "\nMINOR=" << name.substr(5) << "\nDEVNAME=" << name
                                        << "\n";
      std::ofstream(device + "/dev") << kMajor << ":" << name.substr(5) << "\n";
    }
    shown = nodes;
  }

  void advance() {
    world->advance(monotonicNs());
    showNodes();
  }

  // The descriptor is readable from now on (time 1), or from that time on.
  void arm(int fd) {
    const std::uint32_t ready = world->readiness(fd);
    const std::int64_t when = ready != 0 ? 1 : world->nextEventNs();
    itimerspec timer{};
    if (when != kForever) timer.it_value = {when / 1'000'000'000, when % 1'000'000'000};
    timerfd_settime(fd, TFD_TIMER_ABSTIME, &timer, nullptr);
  }

  bool owns(int fd) { return world && world->isOpen(fd); }
};

Shim& shim() {
  static Shim* const instance = new Shim();  // outlives every static of the program
  return *instance;
}

thread_local int t_inside = 0;  // the library's own calls go to the system
struct Inside {
  Inside() { ++t_inside; }
  ~Inside() { --t_inside; }
};

// Where the picture of a path is; nothing: not one of ours.
std::optional<std::string> redirected(const char* path) {
  if (path == nullptr || t_inside > 0) return std::nullopt;
  const std::string text = path;
  const bool ours = text == "/dev" || text == "/dev/" || text.starts_with("/dev/video") ||
                    text.starts_with("/dev/v4l") || text.starts_with("/sys/dev/char/81:") ||
                    text.starts_with("/sys/class/video4linux");
  if (!ours) return std::nullopt;
  const Inside inside;
  if (!shim().world) return std::nullopt;
  return shim().root + text;
}

bool isNode(const std::string& path) { return path.starts_with("/dev/video") || path.starts_with("/dev/v4l/by-"); }

int openNode(const char* path, int flags) {
  const Inside inside;
  Shim& s = shim();
  const std::lock_guard lock(s.mutex);
  s.advance();
  const int fd = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | ((flags & O_CLOEXEC) != 0 ? TFD_CLOEXEC : 0));
  if (fd < 0) return -1;
  // A link's name leads to its node.
  const int error = s.world->open(path, fd);
  if (error != 0) {
    real<int (*)(int)>("close")(fd);
    errno = -error;
    return -1;
  }
  s.blocking[fd] = (flags & O_NONBLOCK) == 0;
  s.paths[fd] = path;
  s.arm(fd);
  return fd;
}

int openAny(const char* name, const char* path, int flags, mode_t mode) {
  const std::optional<std::string> other = redirected(path);
  if (other && isNode(path) && (flags & O_DIRECTORY) == 0) {
    struct stat status {};
    const Inside inside;
    if (real<int (*)(const char*, struct stat*)>("stat")(other->c_str(), &status) != 0 || !S_ISDIR(status.st_mode))
      return openNode(path, flags);
  }
  return real<int (*)(const char*, int, mode_t)>(name)(other ? other->c_str() : path, flags, mode);
}

void asDevice(const char* path, struct stat* status) {
  const std::string text = path;
  if (!text.starts_with("/dev/video") || text.size() < 11) return;
  status->st_mode = S_IFCHR | 0660;
  status->st_rdev = makedev(kMajor, static_cast<unsigned>(std::atoi(text.c_str() + 10)));
}

std::uint32_t pollEvents(Shim& s, int fd) {
  s.advance();
  const std::uint32_t events = s.world->readiness(fd);
  s.arm(fd);
  return events;
}

}  // namespace
}  // namespace volto::fake

using volto::fake::Inside;
using volto::fake::kForever;
using volto::fake::monotonicNs;
using volto::fake::real;
using volto::fake::redirected;
using volto::fake::shim;
using volto::fake::t_inside;

// The C library's functions, with its names.
extern "C" {

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return volto::fake::openAny("open", path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return volto::fake::openAny("open64", path, flags, mode);
}
// What programs that were compiled with _FORTIFY_SOURCE call.
int __open_2(const char* path, int flags) { return volto::fake::openAny("open", path, flags, 0); }
int __open64_2(const char* path, int flags) { return volto::fake::openAny("open64", path, flags, 0); }

int openat(int folder, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  if (path[0] == '/' && redirected(path)) return volto::fake::openAny("open", path, flags, mode);
  return real<int (*)(int, const char*, int, mode_t)>("openat")(folder, path, flags, mode);
}

int close(int fd) {
  if (t_inside == 0) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    if (shim().owns(fd)) {
      shim().advance();
      shim().world->close(fd);
      shim().blocking.erase(fd);
      shim().paths.erase(fd);
    }
  }
  return real<int (*)(int)>("close")(fd);
}

int fcntl(int fd, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  if (t_inside == 0 && (command == F_SETFL || command == F_GETFL)) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    if (shim().owns(fd)) {
      if (command == F_GETFL) return O_RDWR | (shim().blocking[fd] ? 0 : O_NONBLOCK);
      shim().blocking[fd] = (reinterpret_cast<long>(argument) & O_NONBLOCK) == 0;
      return 0;
    }
  }
  return real<int (*)(int, int, void*)>("fcntl")(fd, command, argument);
}
int fcntl64(int fd, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  return fcntl(fd, command, argument);
}

ssize_t read(int fd, void* bytes, size_t count) {
  if (t_inside == 0) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    if (shim().owns(fd)) return errno = EINVAL, -1;  // streaming only
  }
  return real<ssize_t (*)(int, void*, size_t)>("read")(fd, bytes, count);
}
ssize_t write(int fd, const void* bytes, size_t count) {
  if (t_inside == 0) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    if (shim().owns(fd)) return errno = EINVAL, -1;
  }
  return real<ssize_t (*)(int, const void*, size_t)>("write")(fd, bytes, count);
}

int ioctl(int fd, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  if (t_inside == 0) {
    const Inside inside;
    std::unique_lock lock(shim().mutex);
    while (shim().owns(fd)) {
      shim().advance();
      const int result = shim().world->ioctl(fd, request, argument);
      if (result == -EAGAIN && request == VIDIOC_DQBUF && shim().blocking[fd]) {
        lock.unlock();
        const timespec moment{0, 1'000'000};
        nanosleep(&moment, nullptr);
        lock.lock();
        continue;
      }
      shim().arm(fd);
      if (result >= 0) return result;
      errno = -result;
      return -1;
    }
  }
  return real<int (*)(int, unsigned long, void*)>("ioctl")(fd, request, argument);
}

void* mmap(void* hint, size_t length, int protection, int flags, int fd, off_t offset) {
  if (t_inside == 0 && fd >= 0 && (flags & MAP_ANONYMOUS) == 0) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    if (shim().owns(fd)) return shim().world->map(fd, length, protection, flags, offset, hint);
  }
  return real<void* (*)(void*, size_t, int, int, int, off_t)>("mmap")(hint, length, protection, flags, fd, offset);
}
void* mmap64(void* hint, size_t length, int protection, int flags, int fd, off64_t offset) {
  return mmap(hint, length, protection, flags, fd, offset);
}
int munmap(void* address, size_t length) {
  if (t_inside == 0) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    if (shim().world && shim().world->unmap(address, length)) return 0;
  }
  return real<int (*)(void*, size_t)>("munmap")(address, length);
}

int poll(struct pollfd* fds, nfds_t count, int timeout) {
  const auto system_poll = real<int (*)(struct pollfd*, nfds_t, int)>("poll");
  if (t_inside > 0) return system_poll(fds, count, timeout);
  const Inside inside;
  if (!shim().world) return system_poll(fds, count, timeout);
  const std::int64_t deadline = timeout < 0 ? kForever : monotonicNs() + std::int64_t{timeout} * 1'000'000;
  for (;;) {
    int ready = 0;
    std::int64_t wait_ms = 0;
    {
      const std::lock_guard lock(shim().mutex);
      shim().advance();
      for (nfds_t i = 0; i < count; ++i) {
        fds[i].revents = 0;
        if (fds[i].fd < 0 || !shim().owns(fds[i].fd)) continue;
        const std::uint32_t events = volto::fake::pollEvents(shim(), fds[i].fd);
        fds[i].revents =
            static_cast<short>(events & (static_cast<std::uint32_t>(fds[i].events) | POLLERR | POLLHUP | POLLNVAL));
        if (fds[i].revents != 0) ++ready;
      }
      const std::int64_t until = std::min(deadline, shim().world->nextEventNs()) - monotonicNs();
      wait_ms = std::clamp<std::int64_t>((until + 999'999) / 1'000'000, 0, 1000);
    }
    // The others, with the system's own poll; a device of ours is left out of it.
    std::vector<struct pollfd> others(fds, fds + count);
    for (struct pollfd& other : others) {
      const std::lock_guard lock(shim().mutex);
      if (other.fd >= 0 && shim().owns(other.fd)) other.fd = -1;
    }
    const int more = system_poll(others.data(), count, ready > 0 ? 0 : static_cast<int>(wait_ms));
    if (more < 0 && ready == 0) return more;
    if (more > 0) {
      for (nfds_t i = 0; i < count; ++i) {
        if (others[i].fd >= 0) fds[i].revents = others[i].revents;
      }
      ready += more;
    }
    if (ready > 0) return ready;
    if (monotonicNs() >= deadline) return 0;
  }
}
int __poll_chk(struct pollfd* fds, nfds_t count, int timeout, size_t) { return poll(fds, count, timeout); }

int select(int count, fd_set* reads, fd_set* writes, fd_set* excepts, struct timeval* timeout) {
  const auto system_select = real<int (*)(int, fd_set*, fd_set*, fd_set*, struct timeval*)>("select");
  if (t_inside > 0) return system_select(count, reads, writes, excepts, timeout);
  std::vector<struct pollfd> fds;
  bool ours = false;
  for (int fd = 0; fd < count; ++fd) {
    short events = 0;
    if (reads != nullptr && FD_ISSET(fd, reads)) events = static_cast<short>(events | POLLIN);
    if (writes != nullptr && FD_ISSET(fd, writes)) events = static_cast<short>(events | POLLOUT);
    if (excepts != nullptr && FD_ISSET(fd, excepts)) events = static_cast<short>(events | POLLPRI);
    if (events == 0) continue;
    fds.push_back({fd, events, 0});
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    ours = ours || shim().owns(fd);
  }
  if (!ours) return system_select(count, reads, writes, excepts, timeout);
  const int wait_ms =
      timeout == nullptr ? -1 : static_cast<int>(timeout->tv_sec * 1000 + (timeout->tv_usec + 999) / 1000);
  const int result = poll(fds.data(), fds.size(), wait_ms);
  if (result < 0) return result;
  for (fd_set* const set : {reads, writes, excepts}) {
    if (set != nullptr) FD_ZERO(set);
  }
  int ready = 0;
  for (const struct pollfd& each : fds) {
    // As the kernel does it: an error makes a descriptor readable and writable, a hang-up readable.
    if (reads != nullptr && (each.events & POLLIN) != 0 && (each.revents & (POLLIN | POLLERR | POLLHUP)) != 0)
      FD_SET(each.fd, reads), ++ready;
    if (writes != nullptr && (each.events & POLLOUT) != 0 && (each.revents & (POLLOUT | POLLERR)) != 0)
      FD_SET(each.fd, writes), ++ready;
    if (excepts != nullptr && (each.events & POLLPRI) != 0 && (each.revents & POLLPRI) != 0)
      FD_SET(each.fd, excepts), ++ready;
  }
  return ready;
}

DIR* opendir(const char* path) {
  if (const auto other = redirected(path)) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    shim().advance();
    return real<DIR* (*)(const char*)>("opendir")(other->c_str());
  }
  return real<DIR* (*)(const char*)>("opendir")(path);
}

ssize_t readlink(const char* path, char* text, size_t size) {
  const auto other = redirected(path);
  return real<ssize_t (*)(const char*, char*, size_t)>("readlink")(other ? other->c_str() : path, text, size);
}

FILE* fopen(const char* path, const char* mode) {
  const auto other = redirected(path);
  return real<FILE* (*)(const char*, const char*)>("fopen")(other ? other->c_str() : path, mode);
}
FILE* fopen64(const char* path, const char* mode) {
  const auto other = redirected(path);
  return real<FILE* (*)(const char*, const char*)>("fopen64")(other ? other->c_str() : path, mode);
}

int access(const char* path, int mode) {
  const auto other = redirected(path);
  return real<int (*)(const char*, int)>("access")(other ? other->c_str() : path, mode);
}

int stat(const char* path, struct stat* status) {
  const auto other = redirected(path);
  const int result = real<int (*)(const char*, struct stat*)>("stat")(other ? other->c_str() : path, status);
  if (result == 0 && other) volto::fake::asDevice(path, status);
  return result;
}
int stat64(const char* path, struct stat64* status) { return stat(path, reinterpret_cast<struct stat*>(status)); }
int lstat(const char* path, struct stat* status) {
  const auto other = redirected(path);
  const int result = real<int (*)(const char*, struct stat*)>("lstat")(other ? other->c_str() : path, status);
  if (result == 0 && other) volto::fake::asDevice(path, status);
  return result;
}
int lstat64(const char* path, struct stat64* status) { return lstat(path, reinterpret_cast<struct stat*>(status)); }

int fstat(int fd, struct stat* status) {
  const int result = real<int (*)(int, struct stat*)>("fstat")(fd, status);
  if (result == 0 && t_inside == 0) {
    const Inside inside;
    const std::lock_guard lock(shim().mutex);
    if (shim().owns(fd)) volto::fake::asDevice(shim().paths[fd].c_str(), status);
  }
  return result;
}
int fstat64(int fd, struct stat64* status) { return fstat(fd, reinterpret_cast<struct stat*>(status)); }

int inotify_add_watch(int fd, const char* path, uint32_t mask) {
  const auto other = redirected(path);
  return real<int (*)(int, const char*, uint32_t)>("inotify_add_watch")(fd, other ? other->c_str() : path, mask);
}

}  // extern "C"
