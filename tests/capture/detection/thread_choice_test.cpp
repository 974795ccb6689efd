#include "capture/detection/thread_choice.h"

#include <gtest/gtest.h>

namespace volto::capture {
namespace {

constexpr std::int64_t kMs = 1'000'000;

// A machine on which a run takes so long.
struct Machine {
  std::int64_t with_one_ns, with_all_ns;
};

// How many of the runs used all four threads.
int runsWithAll(ThreadChoice& choice, const Machine& machine, int runs) {
  int all = 0;
  for (int i = 0; i < runs; ++i) {
    const int threads = choice.threads();
    EXPECT_TRUE(threads == 1 || threads == 4);
    all += threads == 4 ? 1 : 0;
    choice.took(threads == 1 ? machine.with_one_ns : machine.with_all_ns);
  }
  return all;
}

constexpr Machine kIdle{13 * kMs, 8 * kMs};    // measured with PFLD
constexpr Machine kBusy{18 * kMs, 45 * kMs};   // ... beside a program that wants one of two processors
constexpr Machine kAlike{13 * kMs, 12 * kMs};  // hardly quicker

TEST(ThreadChoice, AllThreadsWhereTheyAreQuicker) {
  ThreadChoice choice(4);
  runsWithAll(choice, kIdle, 20);
  EXPECT_GT(runsWithAll(choice, kIdle, 1000), 960);
}

TEST(ThreadChoice, OneThreadWhereTheOthersAreWaitedFor) {
  ThreadChoice choice(4);
  runsWithAll(choice, kBusy, 20);
  EXPECT_LT(runsWithAll(choice, kBusy, 1000), 20);
}

TEST(ThreadChoice, FollowsALoadThatComesAndGoes) {
  ThreadChoice choice(4);
  runsWithAll(choice, kIdle, 500);
  EXPECT_LT(runsWithAll(choice, kBusy, 100), 20) << "what has become clearly slower is tried anew at once";
  runsWithAll(choice, kIdle, 600);  // tries have become rare
  EXPECT_GT(runsWithAll(choice, kIdle, 500), 480);
}

TEST(ThreadChoice, ProcessorsAreNotSpentOnHardlyAnyGain) {
  ThreadChoice choice(4);
  EXPECT_LT(runsWithAll(choice, kAlike, 1000), 20);
}

TEST(ThreadChoice, OneStallDoesNotChangeItForLong) {
  ThreadChoice choice(4);
  runsWithAll(choice, kIdle, 100);
  choice.took(200 * kMs);
  runsWithAll(choice, kIdle, 60);
  EXPECT_GT(runsWithAll(choice, kIdle, 1000), 950);
}

TEST(ThreadChoice, OnOneProcessorThereIsNothingToChoose) {
  ThreadChoice choice(1);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(choice.threads(), 1);
    choice.took(kMs * (1 + i % 7));
  }
}

}  // namespace
}  // namespace volto::capture
