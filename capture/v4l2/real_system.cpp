#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <dirent.h>
#include <fcntl.h>
#include <grp.h>
#include <string_view>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <climits>

#include "capture/v4l2/system.h"

namespace volto::capture::v4l2 {

namespace {

struct Directory {
  explicit Directory(const char* path) : dir(opendir(path)) {}
  ~Directory() {
    if (dir != nullptr) closedir(dir);
  }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  const char* next() {
    if (dir == nullptr) return nullptr;
    const dirent* const entry = readdir(dir);
    return entry == nullptr ? nullptr : entry->d_name;
  }
  DIR* dir;
};

// The number in "video12"; -1 for every other name.
int videoNumber(std::string_view name) {
  if (!name.starts_with("video")) return -1;
  name.remove_prefix(5);
  int number = -1;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  return error == std::errc() && end == name.data() + name.size() ? number : -1;
}

std::string linkTarget(const std::string& path) {
  std::array<char, PATH_MAX> target{};
  const ssize_t length = readlink(path.c_str(), target.data(), target.size());
  return length <= 0 ? std::string() : std::string(target.data(), static_cast<std::size_t>(length));
}

// Gives every node the name of the link in `folder` that points to it.
void addLinkNames(std::vector<VideoNode>& nodes, const std::string& folder, std::string VideoNode::*member) {
  Directory links(folder.c_str());
  while (const char* const name = links.next()) {
    const std::string target = linkTarget(folder + "/" + name);
    const std::string node = "/dev/" + target.substr(target.rfind('/') + 1);
    for (VideoNode& each : nodes) {
      // Several links for one node: the first by name, so that the answer does not depend on the folder's order.
      if (each.path == node && ((each.*member).empty() || name < each.*member)) each.*member = name;
    }
  }
}

class RealSystem final : public System {
 public:
  RealSystem() {
    watch_fd_ = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    if (watch_fd_ >= 0 && inotify_add_watch(watch_fd_, "/dev", IN_CREATE | IN_DELETE | IN_ATTRIB | IN_MOVED_TO) < 0) {
      ::close(watch_fd_);
      watch_fd_ = -1;
    }
  }
  ~RealSystem() override {
    if (watch_fd_ >= 0) ::close(watch_fd_);
  }

  int open(const char* path) override { return orErrno(::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC)); }
  void close(int fd) override { ::close(fd); }
  int ioctl(int fd, unsigned long request, void* argument) override { return orErrno(::ioctl(fd, request, argument)); }
  void* map(int fd, std::size_t length, std::int64_t offset) override {
    void* const address = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
    return address == MAP_FAILED ? nullptr : address;
  }
  void unmap(void* address, std::size_t length) override { ::munmap(address, length); }
  int poll(pollfd* fds, std::size_t count, int timeout_ms) override { return orErrno(::poll(fds, count, timeout_ms)); }
  std::int64_t nowNs() override {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
  }

  std::vector<VideoNode> listNodes() override {
    std::vector<int> numbers;
    Directory dev("/dev");
    while (const char* const name = dev.next()) {
      if (const int number = videoNumber(name); number >= 0) numbers.push_back(number);
    }
    std::sort(numbers.begin(), numbers.end());
    std::vector<VideoNode> nodes;
    for (const int number : numbers) nodes.push_back({"/dev/video" + std::to_string(number), {}, {}});
    addLinkNames(nodes, "/dev/v4l/by-id", &VideoNode::by_id);
    addLinkNames(nodes, "/dev/v4l/by-path", &VideoNode::by_path);
    return nodes;
  }

  int watch() override { return watch_fd_; }
  void clearWatch() override {
    alignas(inotify_event) std::array<char, 4096> events;
    while (watch_fd_ >= 0 && ::read(watch_fd_, events.data(), events.size()) > 0) {
    }
  }

  // Other users' processes cannot be looked into, nor with ProtectProc; then nothing is found.
  std::string holderOf(const std::string& path) override {
    Directory proc("/proc");
    while (const char* const pid = proc.next()) {
      if (*pid < '0' || *pid > '9' || std::to_string(::getpid()) == pid) continue;
      const std::string folder = std::string("/proc/") + pid;
      Directory fds((folder + "/fd").c_str());
      while (const char* const fd = fds.next()) {
        if (*fd != '.' && linkTarget(folder + "/fd/" + fd) == path) return describeProcess(folder, pid);
      }
    }
    return {};
  }

  std::string groupOf(const std::string& path) override {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return {};
    std::array<char, 4096> text{};
    group entry{};
    group* found = nullptr;
    if (getgrgid_r(status.st_gid, &entry, text.data(), text.size(), &found) == 0 && found != nullptr)
      return found->gr_name;
    return "number " + std::to_string(status.st_gid);
  }

 private:
  template <class T>
  static int orErrno(T result) {
    return result < 0 ? -errno : static_cast<int>(result);
  }

  static std::string describeProcess(const std::string& folder, const std::string& pid) {
    std::string name;
    if (std::FILE* const file = std::fopen((folder + "/comm").c_str(), "re")) {
      std::array<char, 64> text{};
      if (std::fgets(text.data(), text.size(), file) != nullptr) name = text.data();
      std::fclose(file);
    }
    while (!name.empty() && name.back() == '\n') name.pop_back();
    return "pid " + pid + (name.empty() ? "" : " (" + name + ")");
  }

  int watch_fd_ = -1;
};

}  // namespace

std::unique_ptr<System> makeRealSystem() { return std::make_unique<RealSystem>(); }

}  // namespace volto::capture::v4l2
