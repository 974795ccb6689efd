#include "capture/v4l2/buffer_queue.h"

#include <cerrno>
#include <cstring>
#include <linux/videodev2.h>
#include <utility>

namespace volto::capture::v4l2 {

namespace {

// A picture of the largest size with four bytes a pixel, and some room.
constexpr std::size_t kMostBufferBytes = std::size_t{512} << 20;

v4l2_buffer emptyBuffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

int BufferQueue::fail(int error, std::string what) {
  stop();
  problem_ = std::move(what);
  return error;
}

int BufferQueue::start(const Handle& handle) {
  stop();
  handle_ = &handle;
  v4l2_requestbuffers request{};
  request.count = kWantedBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = handle.ioctl(VIDIOC_REQBUFS, &request); error != 0)
    return fail(error, std::string("refuses buffers: ") + std::strerror(-error));
  requested_ = true;
  if (request.count < kLeastBuffers)
    return fail(-ENOMEM, "gives " + std::to_string(request.count) + " buffer, and a stream needs two");
  if (request.count > kMostBuffers) return fail(-EPROTO, "gives " + std::to_string(request.count) + " buffers");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = emptyBuffer(i);
    if (const int error = handle.ioctl(VIDIOC_QUERYBUF, &buffer); error != 0)
      return fail(error, std::string("does not describe its buffers: ") + std::strerror(-error));
    if (buffer.length == 0 || buffer.length > kMostBufferBytes)
      return fail(-EPROTO, "has buffers of " + std::to_string(buffer.length) + " bytes");
    void* const address = handle.system().map(handle.fd(), buffer.length, buffer.m.offset);
    if (address == nullptr) return fail(-ENOMEM, "does not let its buffers be mapped; is memory short?");
    buffers_.push_back({address, buffer.length});
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    if (const int error = queue(i); error != 0)
      return fail(error, std::string("takes no buffer: ") + std::strerror(-error));
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = handle.ioctl(VIDIOC_STREAMON, &type); error != 0)
    return fail(error, std::string("does not start: ") + std::strerror(-error));
  problem_.clear();
  return 0;
}

void BufferQueue::stop() {
  if (handle_ == nullptr) return;
  if (requested_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    handle_->ioctl(VIDIOC_STREAMOFF, &type);
  }
  for (const Buffer& buffer : buffers_) handle_->system().unmap(buffer.address, buffer.length);
  buffers_.clear();
  if (requested_) {
    v4l2_requestbuffers none{};
    none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    none.memory = V4L2_MEMORY_MMAP;
    handle_->ioctl(VIDIOC_REQBUFS, &none);
  }
  requested_ = false;
  handle_ = nullptr;
}

int BufferQueue::dequeue(Dequeued& out) {
  v4l2_buffer buffer = emptyBuffer(0);
  if (const int error = handle_->ioctl(VIDIOC_DQBUF, &buffer); error != 0) return error;
  if (buffer.index >= buffers_.size()) return -EPROTO;
  const Buffer& mapped = buffers_[buffer.index];
  out.index = buffer.index;
  out.sequence = buffer.sequence;
  out.damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || buffer.bytesused > mapped.length;
  out.monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  // A driver's numbers: they may be anything, and must not overflow.
  const auto seconds = static_cast<std::uint64_t>(buffer.timestamp.tv_sec);
  const auto microseconds = static_cast<std::uint64_t>(buffer.timestamp.tv_usec);
  constexpr std::uint64_t kMostSeconds = 4'000'000'000;  // more than a century of uptime
  out.t_driver_ns = seconds <= kMostSeconds && microseconds < 1'000'000
                        ? static_cast<std::int64_t>(seconds * 1'000'000'000 + microseconds * 1000)
                        : -1;
  out.bytes = out.damaged ? std::span<const std::uint8_t>()
                          : std::span(static_cast<const std::uint8_t*>(mapped.address), buffer.bytesused);
  return 0;
}

int BufferQueue::queue(std::uint32_t index) {
  v4l2_buffer buffer = emptyBuffer(index);
  return handle_->ioctl(VIDIOC_QBUF, &buffer);
}

}  // namespace volto::capture::v4l2
