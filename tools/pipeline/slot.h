// Slot: where one stage leaves a frame for the next. Live the newest frame wins; when every frame counts the stages
// wait for each other. Frames are swapped in and out, so their memory goes round and nothing is allocated.
// A slot holds one frame, or a few where a stall of the next stage may be made up for afterwards (a video, whose frames
// bear their own times): in their order, and of more than that the oldest are replaced.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

namespace volto::pipeline {

enum class SlotPolicy : std::uint8_t {
  newest_wins,  // a frame that still waits when there is no room is replaced and counted
  every_frame   // put() waits for room
};

// One thread puts, one takes; anybody may close.
template <typename T>
class Slot {
 public:
  enum class Taken : std::uint8_t { item, nothing, closed };

  // `room`: frames that may wait, at least 1.
  explicit Slot(SlotPolicy policy, std::size_t room = 1) : policy_(policy), items_(room) {}

  // Swaps `item` in; what comes back is an old frame to be filled again. False when the slot is closed.
  bool put(T& item) {
    std::unique_lock lock(mutex_);
    if (policy_ == SlotPolicy::every_frame) changed_.wait(lock, [&] { return waiting_ < items_.size() || closed_; });
    if (closed_) return false;
    if (waiting_ == items_.size()) {
      first_ = (first_ + 1) % items_.size();
      --waiting_;
      ++replaced_;
    }
    std::swap(items_[(first_ + waiting_) % items_.size()], item);
    ++waiting_;
    changed_.notify_all();
    return true;
  }

  Taken take(T& item, std::chrono::nanoseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return waiting_ > 0 || closed_; });
    if (waiting_ > 0) {
      std::swap(items_[first_], item);
      --waiting_;
      // When none waits, the same place is taken again: its memory is still in the processor's cache.
      first_ = waiting_ == 0 ? 0 : (first_ + 1) % items_.size();
      changed_.notify_all();
      return Taken::item;
    }
    return closed_ ? Taken::closed : Taken::nothing;
  }

  // Nothing comes in any more; frames that wait can still be taken, unless they are thrown away.
  void close(bool throw_away = false) {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    if (throw_away) waiting_ = 0;
    changed_.notify_all();
  }

  std::uint64_t replaced() const {
    const std::lock_guard lock(mutex_);
    return replaced_;
  }
  unsigned waiting() const {
    const std::lock_guard lock(mutex_);
    return static_cast<unsigned>(waiting_);
  }

 private:
  SlotPolicy policy_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<T> items_;  // a ring
  std::size_t first_ = 0, waiting_ = 0;
  bool closed_ = false;
  std::uint64_t replaced_ = 0;
};

}  // namespace volto::pipeline
