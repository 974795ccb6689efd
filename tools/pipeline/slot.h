// Slot: where one stage leaves a frame for the next. Live the newest frame wins; when every frame counts the stages
// wait for each other. Frames are swapped in and out, so their memory goes round and nothing is allocated.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <utility>

namespace volto::pipeline {

enum class SlotPolicy : std::uint8_t {
  newest_wins,  // a frame that still waits is replaced and counted
  every_frame   // put() waits for room
};

// One thread puts, one takes; anybody may close.
template <typename T>
class Slot {
 public:
  enum class Taken : std::uint8_t { item, nothing, closed };

  explicit Slot(SlotPolicy policy) : policy_(policy) {}

  // Swaps `item` in; what comes back is an old frame to be filled again. False when the slot is closed.
  bool put(T& item) {
    std::unique_lock lock(mutex_);
    if (policy_ == SlotPolicy::every_frame) changed_.wait(lock, [&] { return !full_ || closed_; });
    if (closed_) return false;
    if (full_) ++replaced_;
    std::swap(item_, item);
    full_ = true;
    changed_.notify_all();
    return true;
  }

  Taken take(T& item, std::chrono::nanoseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return full_ || closed_; });
    if (full_) {
      std::swap(item_, item);
      full_ = false;
      changed_.notify_all();
      return Taken::item;
    }
    return closed_ ? Taken::closed : Taken::nothing;
  }

  // Nothing comes in any more; the frame that waits can still be taken, unless it is thrown away.
  void close(bool throw_away = false) {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    if (throw_away) full_ = false;
    changed_.notify_all();
  }

  std::uint64_t replaced() const {
    const std::lock_guard lock(mutex_);
    return replaced_;
  }
  unsigned waiting() const {
    const std::lock_guard lock(mutex_);
    return full_ ? 1 : 0;
  }

 private:
  SlotPolicy policy_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  T item_{};
  bool full_ = false, closed_ = false;
  std::uint64_t replaced_ = 0;
};

}  // namespace volto::pipeline
