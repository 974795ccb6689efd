#include "capture/detection/thread_choice.h"

#include <algorithm>

namespace volto::capture {
namespace {

constexpr int kRunsOfATry = 2;
constexpr double kGain = 0.1;
constexpr double kClearlyQuicker = 0.85;  // the other choice must take less than this share of the present one's time
constexpr double kClearlySlower = 1.5;    // than at the last decision: something has changed, so look soon

}  // namespace

void ThreadChoice::took(std::int64_t ns) {
  if (most_ <= 1) return;
  const auto time = static_cast<double>(ns);
  if (trying_ > 0) {
    tried_ns_ = std::max(tried_ns_, time);
    if (--trying_ == 0) decide();
    return;
  }
  mean_ns_ = mean_ns_ > 0 ? mean_ns_ + kGain * (time - mean_ns_) : time;
  --until_try_;
  if (accepted_ns_ > 0 && mean_ns_ > kClearlySlower * accepted_ns_) {
    interval_ = kFirstInterval;
    until_try_ = std::min(until_try_, 0);
  }
  if (until_try_ > 0) return;
  trying_ = kRunsOfATry;
  tried_ns_ = 0;
}

void ThreadChoice::decide() {
  if (tried_ns_ < kClearlyQuicker * mean_ns_) {
    all_ = !all_;
    mean_ns_ = tried_ns_;
    interval_ = kFirstInterval;
  } else {
    interval_ = std::min(2 * interval_, kLongestInterval);
  }
  accepted_ns_ = mean_ns_;
  until_try_ = interval_;
}

}  // namespace volto::capture
