// World: the fake cameras of a script, their nodes and open files, and time. No locks: one caller at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tests/capture/fake/device.h"
#include "tests/capture/fake/script.h"

namespace volto::fake {

struct FakeNode {
  std::string path;   // "/dev/video0"
  std::string by_id;  // the name of a link in /dev/v4l/by-id; may be empty
  bool operator==(const FakeNode&) const = default;
};

class World {
 public:
  // Throws std::invalid_argument for a script that it does not understand. Time starts at `now_ns`.
  explicit World(std::string_view script, std::int64_t now_ns);

  // Everything that has happened up to then: pictures, faults, unplugging. Time does not run backward.
  void advance(std::int64_t now_ns);
  std::int64_t now() const { return now_ns_; }
  std::int64_t nextEventNs() const;  // kForever: nothing will happen by itself

  // As the system calls; -errno on failure. `fd` is a real descriptor that the caller has made and will close.
  int open(const std::string& path, int fd);  // 0
  bool isOpen(int fd) const { return files_.contains(fd); }
  void close(int fd);
  // `argument` is the caller's pointer; it may lead nowhere, as v4l2-compliance likes to do: then EFAULT.
  int ioctl(int fd, unsigned long request, void* argument);
  std::uint32_t readiness(int fd);
  // When this file can become ready: now, at its next picture, or at the next event of the script.
  void* map(int fd, std::size_t length, int protection, int flags, std::int64_t offset,
            void* hint = nullptr);                // MAP_FAILED and errno
  bool unmap(void* address, std::size_t length);  // false: none of ours

  std::vector<FakeNode> nodes() const;
  bool hasNode(const std::string& path) const;
  std::uint64_t nodeChanges() const { return node_changes_; }  // grows when nodes come, go or change

  // Reads and writes the caller's memory; default: plain copies, with a null pointer being an error. True: done.
  std::function<bool(void* to, const void* from, std::size_t bytes)> copy;

  std::size_t openFiles() const { return files_.size(); }
  std::size_t liveMaps() const { return maps_.size(); }
  Device& device(std::size_t index = 0) { return *devices_[index]; }
  void apply(const std::string& line, std::size_t camera = 0);  // a fault from now on
  void endScript() { pending_.clear(); }                        // what was still to come does not come

 private:
  struct File {
    Device* device = nullptr;
    std::unique_ptr<OpenFile> state;
    int number = 0;  // its node's, which stays taken as long as it is open
  };
  struct Mapping {
    Device* device = nullptr;
    std::uint64_t epoch = 0;
    std::int64_t offset = 0;
    std::size_t length = 0;
  };
  struct Pending {
    Fault fault;
    bool done = false;
  };

  void apply(const Fault& fault);
  std::int64_t dueNs(const Pending& pending) const;
  int freeNumber() const;
  int extControls(File& file, unsigned long request, void* argument);

  std::vector<std::unique_ptr<Device>> devices_;
  std::vector<Pending> pending_;
  std::map<int, File> files_;
  std::map<std::uintptr_t, Mapping> maps_;
  std::int64_t now_ns_ = 0;
  std::uint64_t node_changes_ = 0;
};

}  // namespace volto::fake
