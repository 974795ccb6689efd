#include "tools/pipeline/slot.h"

#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace volto::pipeline {
namespace {

using namespace std::chrono_literals;
using Numbers = Slot<std::vector<int>>;

TEST(Slot, LiveTheNewestWinsAndWhatItReplacedIsCounted) {
  Numbers slot(SlotPolicy::newest_wins);
  for (int i = 0; i < 4; ++i) {
    std::vector<int> item{i};
    EXPECT_TRUE(slot.put(item));
  }
  std::vector<int> got;
  EXPECT_EQ(slot.waiting(), 1U);
  ASSERT_EQ(slot.take(got, 0s), Numbers::Taken::item);
  EXPECT_EQ(got, std::vector<int>{3});
  EXPECT_EQ(slot.replaced(), 3U);
  EXPECT_EQ(slot.take(got, 1ms), Numbers::Taken::nothing);
}

TEST(Slot, WhenEveryFrameCountsNoneIsLostAndTheOrderIsKept) {
  Numbers slot(SlotPolicy::every_frame);
  std::thread putter([&] {
    for (int i = 0; i < 1000; ++i) {
      std::vector<int> item{i};
      slot.put(item);
    }
    slot.close();
  });
  std::vector<int> got;
  int expected = 0;
  for (;;) {
    const auto taken = slot.take(got, 1s);
    if (taken == Numbers::Taken::closed) break;
    ASSERT_EQ(taken, Numbers::Taken::item);
    ASSERT_EQ(got[0], expected++);
  }
  putter.join();
  EXPECT_EQ(expected, 1000);
  EXPECT_EQ(slot.replaced(), 0U);
}

TEST(Slot, WithRoomForAFewTheyComeInTheirOrderAndTheOldestGivesWay) {
  Numbers slot(SlotPolicy::newest_wins, 3);
  std::vector<int> got;
  int next = 0;
  for (int round = 0; round < 4; ++round) {  // round the ring
    for (int i = 0; i < 5; ++i) {
      std::vector<int> item{next++};
      EXPECT_TRUE(slot.put(item));
    }
    EXPECT_EQ(slot.waiting(), 3U);
    for (int i = 3; i > 0; --i) {
      ASSERT_EQ(slot.take(got, 0s), Numbers::Taken::item);
      EXPECT_EQ(got, std::vector<int>{next - i});
    }
    EXPECT_EQ(slot.take(got, 0s), Numbers::Taken::nothing);
  }
  EXPECT_EQ(slot.replaced(), 8U);
}

TEST(Slot, WhatStillWaitsWhenItIsClosedIsTakenUnlessItIsThrownAway) {
  for (const bool throw_away : {false, true}) {
    Numbers slot(SlotPolicy::newest_wins, 3);
    for (int i = 0; i < 2; ++i) {
      std::vector<int> item{i};
      slot.put(item);
    }
    slot.close(throw_away);
    std::vector<int> got;
    for (int i = 0; i < 2 && !throw_away; ++i) {
      ASSERT_EQ(slot.take(got, 0s), Numbers::Taken::item);
      EXPECT_EQ(got, std::vector<int>{i});
    }
    EXPECT_EQ(slot.take(got, 0s), Numbers::Taken::closed);
  }
}

TEST(Slot, MemoryGoesRound) {
  Numbers slot(SlotPolicy::newest_wins);
  std::vector<int> a(100, 1), b;
  const int* const memory = a.data();
  slot.put(a);
  ASSERT_EQ(slot.take(b, 0s), Numbers::Taken::item);
  EXPECT_EQ(b.data(), memory);
}

TEST(Slot, ClosingWakesWhoeverWaits) {
  Numbers full(SlotPolicy::every_frame), empty(SlotPolicy::newest_wins);
  std::vector<int> item{1};
  full.put(item);
  bool put = true;
  auto taken = Numbers::Taken::item;
  std::thread putter([&] {
    std::vector<int> next{2};
    put = full.put(next);
  });
  std::thread taker([&] {
    std::vector<int> got;
    taken = empty.take(got, 60s);
  });
  std::this_thread::sleep_for(20ms);
  full.close(true);
  empty.close();
  putter.join();
  taker.join();
  EXPECT_FALSE(put);
  EXPECT_EQ(taken, Numbers::Taken::closed);
  EXPECT_EQ(full.take(item, 0s), Numbers::Taken::closed) << "thrown away";
}

}  // namespace
}  // namespace volto::pipeline
