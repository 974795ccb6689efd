#include "tests/capture/fake/world.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <linux/videodev2.h>
#include <stdexcept>
#include <sys/ioctl.h>
#include <sys/mman.h>

namespace volto::fake {

namespace {

std::string nodePath(int number) { return "/dev/video" + std::to_string(number); }

}  // namespace

World::World(std::string_view script, std::int64_t now_ns) : now_ns_(now_ns) {
  copy = [](void* to, const void* from, std::size_t bytes) {
    if (to == nullptr || from == nullptr) return false;
    std::memcpy(to, from, bytes);
    return true;
  };
  const Script parsed = parseScript(script);
  for (const CameraSpec& spec : parsed.cameras) devices_.push_back(std::make_unique<Device>(spec));
  for (const Fault& fault : parsed.faults) {
    if (fault.after_ns < 0 && fault.after_frames < 0)
      apply(fault);
    else
      pending_.push_back({fault, false});
  }
}

// The lowest that no camera has and no open file holds.
int World::freeNumber() const {
  for (int number = 0;; ++number) {
    const bool taken =
        std::any_of(devices_.begin(), devices_.end(),
                    [&](const auto& d) {
                      return d->spec.number == number || (d->spec.metadata && d->spec.number + 1 == number);
                    }) ||
        std::any_of(files_.begin(), files_.end(), [&](const auto& f) { return f.second.number == number; });
    if (!taken) return number;
  }
}

void World::apply(const Fault& fault) {
  Device& device = *devices_[fault.camera];
  try {
    if (fault.words[0] == "unplug") {
      device.unplug();
      ++node_changes_;
    } else if (fault.words[0] == "replug") {
      int number = -1;
      for (std::size_t i = 1; i + 1 < fault.words.size(); i += 2) {
        const std::string& value = fault.words[i + 1];
        if (fault.words[i] == "as")
          number = static_cast<int>(parseNumber(value.substr(std::min<std::size_t>(5, value.size()))));
        else if (fault.words[i] == "bus")
          device.spec.bus = value;
        else if (fault.words[i] == "by-id")
          device.spec.by_id = value;
      }
      if (device.spec.number >= 0) device.unplug();
      device.plugIn(number >= 0 ? number : freeNumber());
      ++node_changes_;
    } else if (fault.words[0] == "chmod") {
      device.faults.errors.erase("open");  // it has been made accessible
      ++node_changes_;
    } else {
      device.faults.apply(fault.words, now_ns_, device.wrap_sequence);
    }
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("line " + std::to_string(fault.line) + ": " + error.what());
  }
}

void World::apply(const std::string& line, std::size_t camera) {
  Script script = parseScript(line);
  for (Fault& fault : script.faults) {
    fault.camera = camera;
    apply(fault);
  }
}

std::int64_t World::dueNs(const Pending& pending) const {
  const Device& device = *devices_[pending.fault.camera];
  if (pending.done || device.first_stream_ns == 0) return kForever;
  const auto start = static_cast<std::int64_t>(device.first_stream_ns);
  return start + (pending.fault.after_ns >= 0
                      ? pending.fault.after_ns
                      : static_cast<std::int64_t>(pending.fault.after_frames * device.periodNs()));
}

std::int64_t World::nextEventNs() const {
  std::int64_t next = kForever;
  for (const auto& device : devices_) next = std::min(next, device->nextPictureNs());
  for (const Pending& pending : pending_) next = std::min(next, dueNs(pending));
  return next;
}

void World::advance(std::int64_t now_ns) {
  for (;;) {
    const std::int64_t next = nextEventNs();
    if (next > now_ns) break;
    now_ns_ = std::max(now_ns_, next);
    // What the script says of a moment holds for the picture of that moment.
    const auto due = std::find_if(pending_.begin(), pending_.end(), [&](const Pending& p) { return dueNs(p) <= next; });
    if (due != pending_.end()) {
      due->done = true;
      apply(due->fault);
      continue;
    }
    for (const auto& device : devices_) {
      if (device->nextPictureNs() <= next) device->makePicture();
    }
  }
  now_ns_ = std::max(now_ns_, now_ns);
}

std::vector<FakeNode> World::nodes() const {
  std::vector<std::pair<int, FakeNode>> nodes;
  for (const auto& device : devices_) {
    const CameraSpec& spec = device->spec;
    if (spec.number < 0) continue;
    nodes.push_back({spec.number, {nodePath(spec.number), spec.by_id}});
    if (spec.metadata) nodes.push_back({spec.number + 1, {nodePath(spec.number + 1), ""}});
  }
  std::sort(nodes.begin(), nodes.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FakeNode> out;
  for (auto& node : nodes) out.push_back(std::move(node.second));
  return out;
}

bool World::hasNode(const std::string& path) const {
  const std::vector<FakeNode> all = nodes();
  return std::any_of(all.begin(), all.end(), [&](const FakeNode& n) { return n.path == path; });
}

int World::open(const std::string& path, int fd) {
  constexpr std::string_view kById = "/dev/v4l/by-id/";
  for (const auto& device : devices_) {
    const CameraSpec& spec = device->spec;
    if (spec.number < 0) continue;
    const bool metadata = spec.metadata && path == nodePath(spec.number + 1);
    const bool by_id = path.starts_with(kById) && !spec.by_id.empty() && path.substr(kById.size()) == spec.by_id;
    if (path != nodePath(spec.number) && !metadata && !by_id) continue;
    if (const int error = device->faults.takeError("open"); error != 0) return error;
    File file{device.get(), std::make_unique<OpenFile>(), metadata ? spec.number + 1 : spec.number};
    file.state->generation = device->generation;
    file.state->metadata = metadata;
    device->files.push_back(file.state.get());
    files_[fd] = std::move(file);
    return 0;
  }
  return -ENOENT;
}

void World::close(int fd) {
  const auto found = files_.find(fd);
  if (found == files_.end()) return;
  found->second.device->closed(*found->second.state);
  files_.erase(found);
}

int World::extControls(File& file, unsigned long request, void* argument) {
  v4l2_ext_controls header{};
  if (!copy(&header, argument, sizeof(header))) return -EFAULT;
  if (header.count > V4L2_CID_MAX_CTRLS) return -EINVAL;
  std::vector<v4l2_ext_control> array(header.count);
  void* const users_array = header.controls;
  if (header.count > 0 && !copy(array.data(), users_array, array.size() * sizeof(array[0]))) return -EFAULT;
  std::memset(header.reserved, 0, sizeof(header.reserved));
  const int result = file.device->extControls(*file.state, request, header, array.data(), now_ns_);
  if (header.count > 0 && !copy(users_array, array.data(), array.size() * sizeof(array[0]))) return -EFAULT;
  if (!copy(argument, &header, sizeof(header))) return -EFAULT;
  return result;
}

int World::ioctl(int fd, unsigned long request, void* argument) {
  const auto found = files_.find(fd);
  if (found == files_.end()) return -EBADF;
  File& file = found->second;
  request &= 0xFFFF'FFFFUL;  // some callers pass it sign-extended
  if (request == VIDIOC_G_EXT_CTRLS || request == VIDIOC_S_EXT_CTRLS || request == VIDIOC_TRY_EXT_CTRLS)
    return extControls(file, request, argument);
  alignas(16) std::array<std::uint8_t, 1024> local{};
  const std::size_t size = _IOC_SIZE(request);
  if (_IOC_TYPE(request) != 'V' || size > local.size()) return -ENOTTY;
  if ((_IOC_DIR(request) & _IOC_WRITE) != 0 && !copy(local.data(), argument, size)) return -EFAULT;
  const int result = file.device->ioctl(*file.state, request, local.data(), now_ns_);
  // The kernel hands the answer back on failure too where it says more than the error.
  if ((_IOC_DIR(request) & _IOC_READ) != 0 &&
      (result == 0 || request == VIDIOC_REQBUFS || request == VIDIOC_CREATE_BUFS) &&
      !copy(argument, local.data(), size))
    return -EFAULT;
  return result;
}

std::uint32_t World::readiness(int fd) {
  const auto found = files_.find(fd);
  return found == files_.end() ? 0 : found->second.device->readiness(*found->second.state);
}

void* World::map(int fd, std::size_t length, int protection, int flags, std::int64_t offset, void* hint) {
  const auto found = files_.find(fd);
  int memory = -EBADF;
  std::int64_t memory_offset = 0;
  if (found != files_.end())
    memory = found->second.device->memoryAt(*found->second.state, length, offset, memory_offset);
  if (memory >= 0 && (flags & MAP_SHARED) == 0) memory = -EINVAL;
  if (memory < 0) {
    errno = -memory;
    return MAP_FAILED;
  }
  void* const address = ::mmap(hint, length, protection, flags, memory, memory_offset);
  if (address != MAP_FAILED) {
    Device& device = *found->second.device;
    maps_[reinterpret_cast<std::uintptr_t>(address)] = {&device, device.memoryEpoch(), offset, length};
    device.mapped(offset, 1);
  }
  return address;
}

bool World::unmap(void* address, std::size_t length) {
  const auto found = maps_.find(reinterpret_cast<std::uintptr_t>(address));
  if (found == maps_.end()) return false;
  const Mapping& mapping = found->second;
  if (mapping.epoch == mapping.device->memoryEpoch()) mapping.device->mapped(mapping.offset, -1);
  maps_.erase(found);
  ::munmap(address, length);
  return true;
}

}  // namespace volto::fake
