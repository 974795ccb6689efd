// A frame must not allocate: operator new is counted in this executable.
#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "tests/tracker/synthetic_actor.h"
#include "tracker/tracker.h"

namespace {

std::atomic<long> allocations{0};

// Not inlined: g++ would else see malloc meet delete and warn.
[[gnu::noinline]] void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  void* p = alignment > alignof(std::max_align_t)
                ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
                : std::malloc(size == 0 ? 1 : size);
  if (p == nullptr) throw std::bad_alloc();
  return p;
}

[[gnu::noinline]] void release(void* p) { std::free(p); }

}  // namespace

void* operator new(std::size_t size) { return counted(size, 0); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* p) noexcept { release(p); }
void operator delete(void* p, std::size_t) noexcept { release(p); }
void operator delete(void* p, std::align_val_t) noexcept { release(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { release(p); }

namespace volto::tracker {
namespace {

TEST(TrackerAllocation, NoFrameAllocatesAfterTheFirst) {
  test::SyntheticActor actor;
  std::vector<LandmarkFrame> frames;
  for (int i = 0; i < 600; ++i) {
    const double t = i / 30.0;
    frames.push_back(actor.frame(t, test::livelyTalk(t), test::livelyHead(t)));
    if (i % 97 > 90) frames.back().face_present = false;
  }
  Tracker tracker;
  MaskFrame mask;
  for (int i = 0; i < 2; ++i) tracker.push(frames[static_cast<std::size_t>(i)], mask);
  for (std::size_t i = 2; i < frames.size(); ++i) {
    const long before = allocations;
    tracker.push(frames[i], mask);
    ASSERT_EQ(allocations - before, 0) << "frame " << i;
  }
}

}  // namespace
}  // namespace volto::tracker
