// Device: a fake camera as the kernel's V4L2 core and videobuf2 present one. Answers measured on the kernel's own test
// driver are in the table of tests/capture/fake/README.md.
#pragma once

#include <cstdint>
#include <deque>
#include <linux/videodev2.h>
#include <map>
#include <string>
#include <vector>

#include "tests/capture/fake/control_set.h"
#include "tests/capture/fake/fault_state.h"
#include "tests/capture/fake/script.h"

namespace volto::fake {

// An open file.
struct OpenFile {
  std::uint64_t generation = 0;  // of the device when it was opened; another one now: it was unplugged
  std::uint32_t priority = V4L2_PRIORITY_INTERACTIVE;
  bool metadata = false;
  std::vector<v4l2_event_subscription> subscriptions;
  std::vector<v4l2_event> events;  // oldest first
  std::uint32_t event_sequence = 0;
};

class Device {
 public:
  explicit Device(CameraSpec spec);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  CameraSpec spec;
  FaultState faults;
  std::uint64_t generation = 1;
  std::vector<OpenFile*> files;  // that are open on it

  bool alive(const OpenFile& file) const { return spec.number >= 0 && file.generation == generation; }
  void unplug();  // open files see it at once
  void plugIn(int number);
  void closed(OpenFile& file);

  // `argument` is this function's own copy of what the caller gave. `array` of extended controls too.
  int ioctl(OpenFile& file, unsigned long request, void* argument, std::int64_t now_ns);
  int extControls(OpenFile& file, unsigned long request, v4l2_ext_controls& header, v4l2_ext_control* array,
                  std::int64_t now_ns);
  std::uint32_t readiness(const OpenFile& file);  // POLLIN, POLLERR, ...

  // The file behind a buffer's offset, to be mapped at `out_offset`; -errno.
  int memoryAt(const OpenFile& file, std::size_t length, std::int64_t offset, std::int64_t& out_offset);
  void mapped(std::int64_t offset, int change);  // +1, -1
  std::uint64_t memoryEpoch() const { return memory_epoch_; }

  // When the next picture is due; kForever: not streaming.
  std::int64_t nextPictureNs() const { return streaming_ ? next_picture_ns_ : kForever; }
  void makePicture();  // the one that is due then
  bool streaming() const { return streaming_; }
  double periodNs() const;
  bool frozen(std::int64_t now_ns) const;

  std::uint64_t pictures_made = 0;    // since the script began
  std::uint64_t pictures_lost = 0;    // no buffer was there, or dropped by the script
  std::uint64_t first_stream_ns = 0;  // 0: never streamed
  bool wrap_sequence = false;

 private:
  enum class State { dequeued, prepared, queued, done };
  struct Buffer {
    State state = State::dequeued;
    std::size_t length = 0;
    std::int64_t offset = 0;
    int maps = 0;
    std::uint32_t bytesused = 0, flags = 0, sequence = 0;
    timeval timestamp{};
  };

  int subscribe(OpenFile& file, const v4l2_event_subscription& subscription, std::int64_t now_ns);
  static int unsubscribe(OpenFile& file, const v4l2_event_subscription& subscription);
  static int dequeueEvent(OpenFile& file, v4l2_event& event);
  void queueEvent(OpenFile& file, std::uint32_t id, std::uint32_t changes, std::int64_t now_ns) const;
  void tellChanges(const OpenFile& setter, const std::vector<int>& values_before, std::int64_t now_ns);
  int enumFormat(v4l2_fmtdesc& entry) const;
  int enumSizes(v4l2_frmsizeenum& entry) const;
  int enumIntervals(v4l2_frmivalenum& entry) const;
  void fillFormat(v4l2_pix_format& pix) const;  // the nearest to what is asked
  int setFormat(v4l2_format& format);
  int streamParm(v4l2_streamparm& parm, bool set);
  int requestBuffers(OpenFile& file, v4l2_requestbuffers& request);
  int createBuffers(OpenFile& file, v4l2_create_buffers& request);
  void allocate(std::uint32_t count, std::size_t size);
  void freeBuffers();
  int queueBuffer(v4l2_buffer& buffer, bool prepare_only);
  int dequeueBuffer(v4l2_buffer& buffer);
  void describe(std::uint32_t index, v4l2_buffer& buffer) const;
  int streamOn(OpenFile& file, std::int64_t now_ns);
  void streamOff();
  bool happens(Dose& dose);
  std::uint32_t highestPriority() const;
  const FormatSpec* findFormat(const std::string& fourcc, int width, int height) const;
  void fill(Buffer& buffer);
  std::int64_t stampOf(std::int64_t now_ns, bool& monotonic);

  ControlSet controls_;
  v4l2_pix_format format_{};
  v4l2_fract interval_{1, 30};
  std::vector<Buffer> buffers_;
  std::deque<std::uint32_t> queued_, done_;
  int memory_fd_ = -1;
  std::int64_t memory_bytes_ = 0;
  std::uint64_t memory_epoch_ = 0;
  OpenFile* owner_ = nullptr;
  bool streaming_ = false;
  std::int64_t next_picture_ns_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint32_t random_ = 12345;
  std::int64_t calls_ = 0;
  std::vector<std::uint8_t> picture_;
  std::string drawn_;  // what is in it
  std::map<std::string, std::vector<std::uint8_t>> jpegs_;
};

std::uint32_t fourccCode(const std::string& name);
std::string fourccText(std::uint32_t code);

}  // namespace volto::fake
