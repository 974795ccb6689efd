// p50 and p99 of the last samples. Thread-bound, fixed memory.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace volto::protocol {

class LatencyWindow {
 public:
  static constexpr std::size_t kSize = 1024;

  void add(std::int64_t ns) {
    samples_[static_cast<std::size_t>(count_ % kSize)] = ns;
    ++count_;
  }
  std::uint64_t count() const { return count_; }

  // q in 0..1 over the last kSize samples, nanoseconds; 0 without a sample.
  std::int64_t quantileNs(double q) const {
    const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(count_, kSize));
    if (n == 0) return 0;
    std::array<std::int64_t, kSize> sorted = samples_;
    const auto rank = std::min(n - 1, static_cast<std::size_t>(q * static_cast<double>(n)));
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(rank),
                     sorted.begin() + static_cast<std::ptrdiff_t>(n));
    return sorted[rank];
  }

 private:
  std::array<std::int64_t, kSize> samples_{};
  std::uint64_t count_ = 0;
};

}  // namespace volto::protocol
