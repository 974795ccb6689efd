#include "tests/capture/fake/device.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <poll.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "tests/capture/fake/pictures.h"

namespace volto::fake {

namespace {

constexpr std::int64_t kPage = 4096;
constexpr std::uint32_t kMostBuffers = 32;
constexpr std::uint32_t kBufferCaps = V4L2_BUF_CAP_SUPPORTS_MMAP | V4L2_BUF_CAP_SUPPORTS_ORPHANED_BUFS;

template <std::size_t N>
void putText(std::uint8_t (&out)[N], const std::string& text) {
  std::memset(out, 0, N);
  std::memcpy(out, text.data(), std::min(text.size(), N - 1));
}

// Commands that a file of lower priority than another's is refused (v4l2-ioctl.c, INFO_FL_PRIO).
bool needsPriority(unsigned long request) {
  switch (request) {
    case VIDIOC_S_FMT:
    case VIDIOC_REQBUFS:
    case VIDIOC_CREATE_BUFS:
    case VIDIOC_STREAMON:
    case VIDIOC_STREAMOFF:
    case VIDIOC_S_PARM:
    case VIDIOC_S_INPUT:
    case VIDIOC_S_CTRL:
    case VIDIOC_S_EXT_CTRLS:
    case VIDIOC_S_PRIORITY:
      return true;
    default:
      return false;
  }
}

const char* scriptName(unsigned long request) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      return "querycap";
    case VIDIOC_ENUM_FMT:
      return "enum_fmt";
    case VIDIOC_ENUM_FRAMESIZES:
      return "enum_sizes";
    case VIDIOC_S_FMT:
      return "s_fmt";
    case VIDIOC_S_PARM:
      return "s_parm";
    case VIDIOC_G_PARM:
      return "g_parm";
    case VIDIOC_REQBUFS:
      return "reqbufs";
    case VIDIOC_QUERYBUF:
      return "querybuf";
    case VIDIOC_QBUF:
      return "qbuf";
    case VIDIOC_DQBUF:
      return "dqbuf";
    case VIDIOC_STREAMON:
      return "streamon";
    case VIDIOC_S_CTRL:
      return "s_ctrl";
    default:
      return "";
  }
}

}  // namespace

std::uint32_t fourccCode(const std::string& name) {
  std::uint32_t code = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    code |= static_cast<std::uint32_t>(i < name.size() ? static_cast<unsigned char>(name[i]) : ' ') << (8 * i);
  }
  return code;
}

std::string fourccText(std::uint32_t code) {
  std::string name;
  for (int i = 0; i < 4; ++i) name += static_cast<char>((code >> (8 * i)) & 0xFF);
  while (!name.empty() && name.back() == ' ') name.pop_back();
  return name;
}

Device::Device(CameraSpec camera) : spec(std::move(camera)) {
  format_.pixelformat = fourccCode(spec.formats.front().fourcc);
  format_.width = static_cast<std::uint32_t>(spec.formats.front().width);
  format_.height = static_cast<std::uint32_t>(spec.formats.front().height);
  fillFormat(format_);
  if (spec.button) controls_.addDisconnectButton();
}

Device::~Device() { freeBuffers(); }

double Device::periodNs() const {
  const double agreed = interval_.denominator > 0 ? 1e9 * interval_.numerator / interval_.denominator : 1e9 / 30;
  return faults.rate_hz > 0 ? 1e9 / faults.rate_hz : agreed;
}

bool Device::frozen(std::int64_t now_ns) const {
  return now_ns < faults.frozen_until_ns || faults.frozen_until_streamoff || faults.frozen_until_reopen;
}

void Device::unplug() {
  streamOff();
  freeBuffers();
  owner_ = nullptr;
  spec.number = -1;
  ++generation;
}

void Device::plugIn(int number) { spec.number = number; }

void Device::closed(OpenFile& file) {
  if (owner_ == &file) {
    streamOff();
    freeBuffers();
    owner_ = nullptr;
  }
  std::erase(files, &file);
  if (files.empty()) faults.frozen_until_reopen = false;
}

bool Device::happens(Dose& dose) {
  if (dose.left > 0) {
    if (dose.left != kForever) --dose.left;
    return true;
  }
  if (dose.probability <= 0) return false;
  random_ = random_ * 1664525U + 1013904223U;
  return static_cast<double>(random_ >> 8) / (1 << 24) < dose.probability;
}

std::uint32_t Device::highestPriority() const {
  std::uint32_t highest = V4L2_PRIORITY_UNSET;
  for (const OpenFile* const file : files) highest = std::max(highest, file->priority);
  return highest;
}

const FormatSpec* Device::findFormat(const std::string& fourcc, int width, int height) const {
  for (const FormatSpec& each : spec.formats) {
    if (each.fourcc == fourcc && (width == 0 || (each.width == width && each.height == height))) return &each;
  }
  return nullptr;
}

int Device::enumFormat(v4l2_fmtdesc& entry) const {
  if (entry.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
  std::vector<std::string> names;
  if (!faults.enum_only.empty()) {
    names.push_back(faults.enum_only);
  } else {
    for (const FormatSpec& each : spec.formats) {
      if (std::find(names.begin(), names.end(), each.fourcc) == names.end()) names.push_back(each.fourcc);
    }
  }
  const std::uint32_t index = entry.index;
  if (index >= names.size() || entry.mbus_code != 0) return -EINVAL;
  entry = {};
  entry.index = index;
  entry.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  entry.pixelformat = fourccCode(names[index]);
  if (names[index] == "MJPG") entry.flags = V4L2_FMT_FLAG_COMPRESSED;
  putText(entry.description, names[index] == "MJPG"   ? "Motion-JPEG"
                             : names[index] == "YUYV" ? "YUYV 4:2:2"
                             : names[index] == "NV12" ? "Y/UV 4:2:0"
                             : names[index] == "GREY" ? "8-bit Greyscale"
                                                      : names[index]);
  return 0;
}

int Device::enumSizes(v4l2_frmsizeenum& entry) const {
  std::uint32_t index = 0;
  for (const FormatSpec& each : spec.formats) {
    if (fourccCode(each.fourcc) != entry.pixel_format || index++ != entry.index) continue;
    entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    entry.discrete = {static_cast<std::uint32_t>(each.width), static_cast<std::uint32_t>(each.height)};
    std::memset(entry.reserved, 0, sizeof(entry.reserved));
    return 0;
  }
  return -EINVAL;
}

int Device::enumIntervals(v4l2_frmivalenum& entry) const {
  const FormatSpec* const format =
      findFormat(fourccText(entry.pixel_format), static_cast<int>(entry.width), static_cast<int>(entry.height));
  if (format == nullptr || entry.width == 0 || entry.index >= format->rates_hz.size()) return -EINVAL;
  entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  entry.discrete = {1000, static_cast<std::uint32_t>(std::lround(format->rates_hz[entry.index] * 1000))};
  std::memset(entry.reserved, 0, sizeof(entry.reserved));
  return 0;
}

void Device::fillFormat(v4l2_pix_format& pix) const {
  std::string fourcc = fourccText(pix.pixelformat);
  if (findFormat(fourcc, 0, 0) == nullptr) fourcc = spec.formats.front().fourcc;
  // The nearest size, as v4l2_find_nearest_size does it.
  const FormatSpec* best = nullptr;
  std::int64_t best_error = kForever;
  for (const FormatSpec& each : spec.formats) {
    if (each.fourcc != fourcc) continue;
    const std::int64_t error =
        std::llabs(std::int64_t{each.width} - pix.width) + std::llabs(std::int64_t{each.height} - pix.height);
    if (error < best_error) best = &each, best_error = error;
  }
  int width = best->width, height = best->height;
  if (faults.adjust_width >= 0) width = faults.adjust_width, height = faults.adjust_height;
  if (!faults.adjust_fourcc.empty()) fourcc = faults.adjust_fourcc;
  pix = {};
  pix.width = static_cast<std::uint32_t>(width);
  pix.height = static_cast<std::uint32_t>(height);
  pix.pixelformat = fourccCode(fourcc);
  pix.field = V4L2_FIELD_NONE;
  pix.bytesperline = static_cast<std::uint32_t>(pictureStride(fourcc, width));
  pix.sizeimage = static_cast<std::uint32_t>(pictureBytes(fourcc, width, height));
  pix.colorspace = V4L2_COLORSPACE_SRGB;
  pix.priv = V4L2_PIX_FMT_PRIV_MAGIC;
  pix.ycbcr_enc = V4L2_YCBCR_ENC_601;
  pix.quantization = fourcc == "MJPG" ? V4L2_QUANTIZATION_FULL_RANGE : V4L2_QUANTIZATION_LIM_RANGE;
  pix.xfer_func = V4L2_XFER_FUNC_SRGB;
}

int Device::setFormat(v4l2_format& format) {
  if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
  if (!buffers_.empty() || faults.busy) return -EBUSY;
  fillFormat(format.fmt.pix);
  format_ = format.fmt.pix;
  // The rate that was set may not be one of this size.
  v4l2_streamparm parm{};
  parm.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parm.parm.capture.timeperframe = interval_;
  return streamParm(parm, true);
}

int Device::streamParm(v4l2_streamparm& parm, bool set) {
  if (parm.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
  const v4l2_fract wanted = parm.parm.capture.timeperframe;
  std::memset(&parm.parm, 0, sizeof(parm.parm));
  if (set) {
    const FormatSpec* const format =
        findFormat(fourccText(format_.pixelformat), static_cast<int>(format_.width), static_cast<int>(format_.height));
    double best = format == nullptr ? 30.0 : format->rates_hz.front();
    if (format != nullptr && wanted.numerator > 0 && wanted.denominator > 0) {
      const double hz = static_cast<double>(wanted.denominator) / wanted.numerator;
      for (const double rate : format->rates_hz) {
        if (std::abs(rate - hz) < std::abs(best - hz)) best = rate;
      }
    }
    interval_ = {1000, static_cast<std::uint32_t>(std::lround(best * 1000))};
    if (faults.interval_den > 0)
      interval_ = {static_cast<std::uint32_t>(faults.interval_num), static_cast<std::uint32_t>(faults.interval_den)};
  }
  parm.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
  parm.parm.capture.timeperframe = interval_;
  parm.parm.capture.readbuffers = 0;  // read() is not there
  return 0;
}

void Device::allocate(std::uint32_t count, std::size_t size) {
  if (memory_fd_ < 0) {
    memory_fd_ = memfd_create("fake camera", MFD_CLOEXEC);
    memory_bytes_ = 0;
    ++memory_epoch_;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    Buffer buffer;
    buffer.length = size;
    buffer.offset = memory_bytes_;
    memory_bytes_ += (static_cast<std::int64_t>(size) + kPage - 1) / kPage * kPage;
    buffers_.push_back(buffer);
  }
  if (ftruncate(memory_fd_, memory_bytes_) != 0) std::perror("fake camera: memory");
}

// Memory that is still mapped lives on behind the mappings.
void Device::freeBuffers() {
  buffers_.clear();
  queued_.clear();
  done_.clear();
  if (memory_fd_ >= 0) ::close(memory_fd_);
  memory_fd_ = -1;
}

int Device::requestBuffers(OpenFile& file, v4l2_requestbuffers& request) {
  const std::uint32_t wanted = request.count;
  std::memset(request.reserved, 0, sizeof(request.reserved));
  request.capabilities = kBufferCaps;
  request.flags = 0;
  if (request.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || request.memory != V4L2_MEMORY_MMAP) return -EINVAL;
  if (faults.busy || (owner_ != nullptr && owner_ != &file)) return -EBUSY;
  if (streaming_) return -EBUSY;
  freeBuffers();
  owner_ = nullptr;
  request.count = 0;
  if (wanted == 0) return 0;
  request.count = std::clamp(wanted, 2U, kMostBuffers);
  if (faults.grant >= 0) request.count = static_cast<std::uint32_t>(faults.grant);
  if (request.count == 0) return -ENOMEM;
  allocate(request.count, format_.sizeimage);
  owner_ = &file;
  return 0;
}

int Device::createBuffers(OpenFile& file, v4l2_create_buffers& request) {
  std::memset(request.reserved, 0, sizeof(request.reserved));
  request.capabilities = kBufferCaps;
  request.flags = 0;
  request.index = static_cast<std::uint32_t>(buffers_.size());
  if (request.format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || request.memory != V4L2_MEMORY_MMAP) return -EINVAL;
  if (request.count == 0) return 0;
  if (faults.busy || (owner_ != nullptr && owner_ != &file)) return -EBUSY;
  const std::uint32_t size = request.format.fmt.pix.sizeimage;
  if (size < format_.sizeimage) return -EINVAL;
  if (buffers_.size() >= kMostBuffers) return -ENOBUFS;
  request.count = std::min(request.count, kMostBuffers - request.index);
  allocate(request.count, size);
  owner_ = &file;
  return 0;
}

void Device::describe(std::uint32_t index, v4l2_buffer& buffer) const {
  const Buffer& b = buffers_[index];
  buffer = {};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.length = static_cast<std::uint32_t>(b.length);
  buffer.m.offset = static_cast<std::uint32_t>(b.offset);
  buffer.bytesused = b.bytesused;
  buffer.field = b.state == State::dequeued ? static_cast<std::uint32_t>(V4L2_FIELD_NONE)
                                            : static_cast<std::uint32_t>(V4L2_FIELD_ANY);
  buffer.flags = b.flags | (b.maps > 0 ? V4L2_BUF_FLAG_MAPPED : 0U);
  if ((b.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == 0 && faults.time_mode != "realtime")
    buffer.flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (b.state == State::queued) buffer.flags |= V4L2_BUF_FLAG_QUEUED;
  if (b.state == State::done) buffer.flags |= V4L2_BUF_FLAG_DONE;
  if (b.state == State::prepared) buffer.flags |= V4L2_BUF_FLAG_PREPARED;
  buffer.timestamp = b.timestamp;
  buffer.sequence = b.sequence;
}

int Device::queueBuffer(v4l2_buffer& buffer, bool prepare_only) {
  if (buffer.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || buffer.memory != V4L2_MEMORY_MMAP ||
      buffer.index >= buffers_.size() || (buffer.flags & V4L2_BUF_FLAG_REQUEST_FD) != 0)
    return -EINVAL;
  if (faults.fatal) return -EIO;
  Buffer& b = buffers_[buffer.index];
  if (b.state != State::dequeued && (prepare_only || b.state != State::prepared)) return -EINVAL;
  b.state = prepare_only ? State::prepared : State::queued;
  b.bytesused = 0;
  b.flags = 0;
  b.timestamp = {};
  b.sequence = 0;
  if (!prepare_only) queued_.push_back(buffer.index);
  describe(buffer.index, buffer);
  return 0;
}

int Device::dequeueBuffer(v4l2_buffer& buffer) {
  if (buffer.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || buffer.memory != V4L2_MEMORY_MMAP) return -EINVAL;
  if (!streaming_) return -EINVAL;
  if (faults.fatal) return -EIO;
  if (done_.empty()) return -EAGAIN;
  const std::uint32_t index = done_.front();
  done_.pop_front();
  Buffer& b = buffers_[index];
  b.state = State::dequeued;
  describe(index, buffer);
  if (happens(faults.index_dose)) buffer.index = faults.wrong_index;
  return 0;
}

int Device::streamOn(OpenFile& file, std::int64_t now_ns) {
  if (faults.busy || (owner_ != nullptr && owner_ != &file)) return -EBUSY;
  if (buffers_.empty()) return -EINVAL;
  if (streaming_) return 0;
  streaming_ = true;
  sequence_ = 0;
  next_picture_ns_ = now_ns + static_cast<std::int64_t>(periodNs());
  if (first_stream_ns == 0) first_stream_ns = static_cast<std::uint64_t>(now_ns);
  return 0;
}

void Device::streamOff() {
  streaming_ = false;
  faults.frozen_until_streamoff = false;
  faults.fatal = false;
  queued_.clear();
  done_.clear();
  for (Buffer& buffer : buffers_) {
    buffer.state = State::dequeued;
    buffer.flags = buffer.bytesused = buffer.sequence = 0;
    buffer.timestamp = {};
  }
}

std::uint32_t Device::readiness(const OpenFile& file) {
  if (!alive(file)) return POLLERR | POLLHUP | POLLPRI;
  const std::uint32_t events = file.events.empty() ? 0 : POLLPRI;
  if (!streaming_ || faults.fatal) return events | POLLERR;
  if (!done_.empty()) return events | POLLIN | POLLRDNORM;
  if (faults.spurious > 0) {
    if (faults.spurious != kForever) --faults.spurious;
    return events | POLLIN | POLLRDNORM;
  }
  return events;
}

// v4l2-event.c and v4l2-ctrls-api.c: one waiting event for each control of each file; a newer one takes its place.
void Device::queueEvent(OpenFile& file, std::uint32_t id, std::uint32_t changes, std::int64_t now_ns) const {
  const FakeControl* const control = controls_.find(id);
  v4l2_event event{};
  event.type = V4L2_EVENT_CTRL;
  event.id = id;
  event.sequence = file.event_sequence++;
  event.timestamp = {now_ns / 1'000'000'000, now_ns % 1'000'000'000};
  event.u.ctrl.changes = changes;
  event.u.ctrl.type = control->type;
  event.u.ctrl.value = control->value;
  if (control->type == V4L2_CTRL_TYPE_CTRL_CLASS)
    event.u.ctrl.flags = V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_WRITE_ONLY;
  event.u.ctrl.minimum = control->minimum;
  event.u.ctrl.maximum = control->maximum;
  event.u.ctrl.step = control->step;
  event.u.ctrl.default_value = control->default_value;
  std::erase_if(file.events, [&](const v4l2_event& old) {
    if (old.id == id) event.u.ctrl.changes |= old.u.ctrl.changes;
    return old.id == id;
  });
  file.events.push_back(event);
}

int Device::subscribe(OpenFile& file, const v4l2_event_subscription& subscription, std::int64_t now_ns) {
  const FakeControl* const control = controls_.find(subscription.id);
  if (subscription.type != V4L2_EVENT_CTRL || control == nullptr) return -EINVAL;
  for (const v4l2_event_subscription& each : file.subscriptions) {
    if (each.id == subscription.id) return 0;
  }
  file.subscriptions.push_back(subscription);
  // Headings have nothing to tell.
  if ((subscription.flags & V4L2_EVENT_SUB_FL_SEND_INITIAL) != 0 && control->type != V4L2_CTRL_TYPE_CTRL_CLASS)
    queueEvent(file, subscription.id, V4L2_EVENT_CTRL_CH_FLAGS | V4L2_EVENT_CTRL_CH_VALUE, now_ns);
  return 0;
}

int Device::unsubscribe(OpenFile& file, const v4l2_event_subscription& subscription) {
  const bool all = subscription.type == V4L2_EVENT_ALL;
  std::erase_if(file.subscriptions, [&](const auto& each) { return all || each.id == subscription.id; });
  std::erase_if(file.events, [&](const v4l2_event& each) { return all || each.id == subscription.id; });
  return 0;
}

int Device::dequeueEvent(OpenFile& file, v4l2_event& event) {
  if (file.events.empty()) return -ENOENT;
  event = file.events.front();
  file.events.erase(file.events.begin());
  event.pending = static_cast<std::uint32_t>(file.events.size());
  return 0;
}

void Device::tellChanges(const OpenFile& setter, const std::vector<int>& values_before, std::int64_t now_ns) {
  for (std::size_t i = 0; i < values_before.size(); ++i) {
    const FakeControl& control = controls_.all()[i];
    if (control.value == values_before[i]) continue;
    for (OpenFile* const file : files) {
      for (const v4l2_event_subscription& each : file->subscriptions) {
        if (each.id == control.id && (file != &setter || (each.flags & V4L2_EVENT_SUB_FL_ALLOW_FEEDBACK) != 0))
          queueEvent(*file, control.id, V4L2_EVENT_CTRL_CH_VALUE, now_ns);
      }
    }
  }
}

int Device::memoryAt(const OpenFile& file, std::size_t length, std::int64_t offset, std::int64_t& out_offset) {
  if (!alive(file)) return -ENODEV;
  if (const int error = faults.takeError("mmap"); error != 0) return error;
  for (const Buffer& buffer : buffers_) {
    if (buffer.offset != offset) continue;
    if (length > static_cast<std::size_t>((static_cast<std::int64_t>(buffer.length) + kPage - 1) / kPage * kPage))
      return -EINVAL;
    out_offset = buffer.offset;
    return memory_fd_;
  }
  return -EINVAL;
}

void Device::mapped(std::int64_t offset, int change) {
  for (Buffer& buffer : buffers_) {
    if (buffer.offset == offset) buffer.maps += change;
  }
}

std::int64_t Device::stampOf(std::int64_t now_ns, bool& monotonic) {
  monotonic = true;
  if (faults.time_mode.empty() || !happens(faults.time_dose)) return now_ns;
  if (faults.time_mode == "0") return 0;
  if (faults.time_mode == "stuck") return 1'000'000'000;
  if (faults.time_mode == "realtime") {
    monotonic = false;
    return now_ns + 1'700'000'000'000'000'000;
  }
  return std::max<std::int64_t>(now_ns + faults.time_offset_ns, 0);
}

void Device::fill(Buffer& b) {
  const std::string fourcc = fourccText(format_.pixelformat);
  const int width = static_cast<int>(format_.width), height = static_cast<int>(format_.height);
  const std::vector<std::uint8_t>* bytes = &picture_;
  if (fourcc == "MJPG") {
    const std::string how = faults.jpeg != "ok" && happens(faults.jpeg_dose) ? faults.jpeg : "ok";
    std::vector<std::uint8_t>& jpeg = jpegs_[how + std::to_string(width) + "x" + std::to_string(height)];
    if (jpeg.empty()) jpeg = makeJpeg(width, height, how);
    bytes = &jpeg;
  } else {
    const std::string drawn = fourcc + std::to_string(width) + "x" + std::to_string(height);
    if (drawn != drawn_) drawRaw(fourcc, width, height, picture_);
    drawn_ = drawn;
    numberRaw(fourcc, width, height, pictures_made, picture_);
  }
  const std::size_t size = std::min(bytes->size(), b.length);
  if (pwrite(memory_fd_, bytes->data(), size, b.offset) < 0) std::perror("fake camera: picture");
  b.bytesused = static_cast<std::uint32_t>(size);
  if (!faults.bytes_used.empty() && happens(faults.bytes_dose)) {
    if (faults.bytes_used == "0") b.bytesused = 0;
    if (faults.bytes_used == "short") b.bytesused /= 2;
    if (faults.bytes_used == "length+1") b.bytesused = static_cast<std::uint32_t>(b.length) + 1;
  }
}

void Device::makePicture() {
  const std::int64_t now = next_picture_ns_;
  next_picture_ns_ += static_cast<std::int64_t>(periodNs());
  if (frozen(now) || faults.fatal) return;
  if (wrap_sequence) {
    sequence_ = 0xFFFF'FFFE;
    wrap_sequence = false;
  }
  const std::uint32_t sequence = sequence_;
  if (!faults.sequence_stuck) ++sequence_;
  ++pictures_made;
  if (happens(faults.drop) || queued_.empty()) {
    ++pictures_lost;
    return;
  }
  const std::uint32_t index = queued_.front();
  queued_.pop_front();
  Buffer& b = buffers_[index];
  fill(b);
  b.state = State::done;
  bool monotonic = true;
  const std::int64_t stamp = stampOf(now, monotonic);
  b.timestamp = {stamp / 1'000'000'000, stamp % 1'000'000'000 / 1000};
  b.sequence = sequence;
  b.flags = monotonic ? V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC : V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  if (happens(faults.flag_error)) b.flags |= V4L2_BUF_FLAG_ERROR;
  done_.push_back(index);
}

int Device::extControls(OpenFile& file, unsigned long request, v4l2_ext_controls& header, v4l2_ext_control* array,
                        std::int64_t now_ns) {
  if (!alive(file)) return -ENODEV;
  if (file.metadata) return -ENOTTY;
  if (request == VIDIOC_S_EXT_CTRLS && file.priority < highestPriority()) return -EBUSY;
  const std::vector<int> before = controls_.values();
  const int result = controls_.extCtrls(header, array,
                                        request == VIDIOC_G_EXT_CTRLS   ? ControlSet::Access::get
                                        : request == VIDIOC_S_EXT_CTRLS ? ControlSet::Access::set
                                                                        : ControlSet::Access::attempt);
  tellChanges(file, before, now_ns);
  return result;
}

int Device::ioctl(OpenFile& file, unsigned long request, void* argument, std::int64_t now_ns) {
  if (!alive(file)) return -ENODEV;
  if (faults.interrupt_every > 0 && ++calls_ % faults.interrupt_every == 0) return -EINTR;
  if (const int error = faults.takeError(scriptName(request)); error != 0) return error;
  if (request == VIDIOC_QUERYCAP) {
    auto& caps = *static_cast<v4l2_capability*>(argument);
    caps = {};
    putText(caps.driver, spec.driver);
    putText(caps.card, spec.card);
    putText(caps.bus_info, spec.bus);
    caps.version = 0x060100;
    const std::uint32_t all = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_EXT_PIX_FORMAT;
    const std::uint32_t meta = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_EXT_PIX_FORMAT;
    caps.capabilities = all | (spec.metadata ? meta : 0U) | V4L2_CAP_DEVICE_CAPS;
    caps.device_caps = file.metadata ? meta : all;
    return 0;
  }
  if (file.metadata) return -ENOTTY;
  if (needsPriority(request) && file.priority < highestPriority()) return -EBUSY;
  // videobuf2: the stream belongs to who requested its buffers.
  const bool others = owner_ != nullptr && owner_ != &file;
  switch (request) {
    case VIDIOC_ENUM_FMT:
      return enumFormat(*static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return enumSizes(*static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return enumIntervals(*static_cast<v4l2_frmivalenum*>(argument));
    case VIDIOC_G_FMT: {
      auto& format = *static_cast<v4l2_format*>(argument);
      if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
      std::memset(&format.fmt, 0, sizeof(format.fmt));
      format.fmt.pix = format_;
      return 0;
    }
    case VIDIOC_TRY_FMT: {
      auto& format = *static_cast<v4l2_format*>(argument);
      if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
      fillFormat(format.fmt.pix);
      return 0;
    }
    case VIDIOC_S_FMT:
      return setFormat(*static_cast<v4l2_format*>(argument));
    case VIDIOC_G_PARM:
      return streamParm(*static_cast<v4l2_streamparm*>(argument), false);
    case VIDIOC_S_PARM:
      return streamParm(*static_cast<v4l2_streamparm*>(argument), true);
    case VIDIOC_ENUMINPUT: {
      auto& input = *static_cast<v4l2_input*>(argument);
      if (input.index != 0) return -EINVAL;
      input = {};
      putText(input.name, "Camera 1");
      input.type = V4L2_INPUT_TYPE_CAMERA;
      return 0;
    }
    case VIDIOC_G_INPUT:
      *static_cast<int*>(argument) = 0;
      return 0;
    case VIDIOC_S_INPUT:
      return *static_cast<int*>(argument) == 0 ? 0 : -EINVAL;
    case VIDIOC_G_PRIORITY:
      *static_cast<std::uint32_t*>(argument) = highestPriority();
      return 0;
    case VIDIOC_S_PRIORITY: {
      const std::uint32_t priority = *static_cast<std::uint32_t*>(argument);
      if (priority < V4L2_PRIORITY_BACKGROUND || priority > V4L2_PRIORITY_RECORD) return -EINVAL;
      file.priority = priority;
      return 0;
    }
    case VIDIOC_QUERYCTRL:
      return controls_.queryCtrl(*static_cast<v4l2_queryctrl*>(argument));
    case VIDIOC_QUERY_EXT_CTRL:
      return controls_.queryExtCtrl(*static_cast<v4l2_query_ext_ctrl*>(argument));
    case VIDIOC_QUERYMENU:
      return controls_.queryMenu(*static_cast<v4l2_querymenu*>(argument));
    case VIDIOC_G_CTRL:
      return controls_.getCtrl(*static_cast<v4l2_control*>(argument));
    case VIDIOC_S_CTRL: {
      const std::vector<int> before = controls_.values();
      const int result = controls_.setCtrl(*static_cast<v4l2_control*>(argument));
      tellChanges(file, before, now_ns);
      if (controls_.takeDisconnect()) {
        const int number = spec.number;
        unplug();
        plugIn(number);  // those who have it open have lost it; it can be opened again
      }
      return result;
    }
    case VIDIOC_REQBUFS:
      return requestBuffers(file, *static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_CREATE_BUFS:
      return createBuffers(file, *static_cast<v4l2_create_buffers*>(argument));
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || buffer.index >= buffers_.size()) return -EINVAL;
      describe(buffer.index, buffer);
      if (faults.bad_offset) buffer.m.offset = 0x7FFF'F000;
      return 0;
    }
    case VIDIOC_SUBSCRIBE_EVENT:
      return subscribe(file, *static_cast<v4l2_event_subscription*>(argument), now_ns);
    case VIDIOC_UNSUBSCRIBE_EVENT:
      return unsubscribe(file, *static_cast<v4l2_event_subscription*>(argument));
    case VIDIOC_DQEVENT:
      return dequeueEvent(file, *static_cast<v4l2_event*>(argument));
    case VIDIOC_PREPARE_BUF:
      return others ? -EBUSY : queueBuffer(*static_cast<v4l2_buffer*>(argument), true);
    case VIDIOC_QBUF:
      return others ? -EBUSY : queueBuffer(*static_cast<v4l2_buffer*>(argument), false);
    case VIDIOC_DQBUF:
      return others ? -EBUSY : dequeueBuffer(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      if (*static_cast<int*>(argument) != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
      return streamOn(file, now_ns);
    case VIDIOC_STREAMOFF:
      if (*static_cast<int*>(argument) != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
      if (others) return -EBUSY;
      streamOff();
      return 0;
    default:
      return -ENOTTY;
  }
}

}  // namespace volto::fake
