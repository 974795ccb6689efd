// BufferQueue: the driver's picture buffers, mapped, and the stream that runs through them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "capture/v4l2/handle.h"

namespace volto::capture::v4l2 {

// One buffer as the driver gave it back.
struct Dequeued {
  std::uint32_t index = 0;
  std::uint32_t sequence = 0;
  bool damaged = false;    // the driver says so, or its sizes cannot be
  bool monotonic = false;  // the clock of t_driver_ns
  std::int64_t t_driver_ns = 0;
  std::span<const std::uint8_t> bytes;  // valid until the buffer is queued again
};

// 0 or -errno everywhere; -EAGAIN from dequeue() is "nothing there".
class BufferQueue {
 public:
  static constexpr std::uint32_t kWantedBuffers = 4, kLeastBuffers = 2, kMostBuffers = 32;

  BufferQueue() { buffers_.reserve(kMostBuffers); }
  ~BufferQueue() { stop(); }
  BufferQueue(const BufferQueue&) = delete;
  BufferQueue& operator=(const BufferQueue&) = delete;

  // Requests, maps and queues the buffers and starts the stream. On failure nothing is left behind, and problem() says
  // in words what it was.
  int start(const Handle& handle);
  // Stops the stream, unmaps everything and gives the buffers back. Harmless on a device that is gone.
  void stop();

  // -EAGAIN: nothing ready. -EPROTO: the driver gave a buffer that does not exist.
  int dequeue(Dequeued& out);
  int queue(std::uint32_t index);

  const std::string& problem() const { return problem_; }
  std::size_t count() const { return buffers_.size(); }

 private:
  struct Buffer {
    void* address = nullptr;
    std::size_t length = 0;
  };
  int fail(int error, std::string what);

  const Handle* handle_ = nullptr;
  std::vector<Buffer> buffers_;
  bool requested_ = false;
  std::string problem_;
};

}  // namespace volto::capture::v4l2
