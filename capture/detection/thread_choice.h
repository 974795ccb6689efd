// ThreadChoice: how many threads a network should run on, found by trying. Two are hardly twice as quick as one, and
// when other programs want the processors too, each layer waits for the thread that was put aside: then one is quicker,
// up to twice and more. Which of them it is changes while a show runs.
#pragma once

#include <cstdint>

namespace volto::capture {

// Of one network. Thread-bound. Before each run ask for threads(), after it tell how long it took.
class ThreadChoice {
 public:
  // One thread or `most`.
  explicit ThreadChoice(int most) : most_(most) {}

  int threads() const { return trying_ > 0 ? other() : current(); }
  void took(std::int64_t ns);

 private:
  int current() const { return all_ ? most_ : 1; }
  int other() const { return all_ ? 1 : most_; }
  void decide();

  int most_;
  bool all_ = false;
  double mean_ns_ = 0;      // of the current choice, the last runs counting most; 0: not known
  double accepted_ns_ = 0;  // what that was at the last decision
  double tried_ns_ = 0;     // the slower of the runs of the other choice
  int trying_ = 0;          // runs with the other choice that are still to come
  int until_try_ = kFirstInterval;
  int interval_ = kFirstInterval;

  static constexpr int kFirstInterval = 8, kLongestInterval = 512;
};

}  // namespace volto::capture
