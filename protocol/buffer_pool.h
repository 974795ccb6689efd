// Memory for messages that is lent to ZeroMQ and comes back. Not for other folders.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "protocol/codec.h"

namespace volto::protocol {

// A message in memory that is lent to ZeroMQ and comes back when its last subscriber has been served.
class Pool;
struct Buffer {
  Encoder encoder;
  Pool* pool = nullptr;
};

// Thread-safe: buffers come back from ZeroMQ's own threads.
class Pool {
 public:
  std::unique_ptr<Buffer> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!free_.empty()) {
        std::unique_ptr<Buffer> buffer = std::move(free_.back());
        free_.pop_back();
        return buffer;
      }
    }
    auto buffer = std::make_unique<Buffer>();
    buffer->pool = this;
    return buffer;
  }
  void give(std::unique_ptr<Buffer> buffer) {
    const std::lock_guard lock(mutex_);
    if (free_.size() < kKept) free_.push_back(std::move(buffer));
  }

 private:
  static constexpr std::size_t kKept = 16;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Buffer>> free_;
};

// ZeroMQ calls this, from a thread of its own, when it has done with a Buffer.
inline void giveBack(void* /*data*/, void* hint) {
  auto* buffer = static_cast<Buffer*>(hint);
  buffer->pool->give(std::unique_ptr<Buffer>(buffer));
}

}  // namespace volto::protocol
