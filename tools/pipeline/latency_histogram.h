// Percentiles of a stream of durations, without allocation per value and without an end to how many there are.
#pragma once

#include <array>
#include <cstdint>

namespace volto::pipeline {

// Buckets grow by 2^(1/16), about 4.4 %: a percentile is exact to that. Durations from 0 to about 68 s; longer ones
// count as that.
class LatencyHistogram {
 public:
  void add(std::int64_t duration_ns);
  std::uint64_t count() const { return count_; }
  // `fraction` 0..1; the upper edge of the bucket that holds it, never above the maximum. 0 when empty.
  std::int64_t percentile(double fraction) const;
  std::int64_t maximum() const { return maximum_; }

 private:
  static constexpr int kPerOctave = 16;
  static constexpr int kOctaves = 36;
  std::array<std::uint64_t, kPerOctave * kOctaves + 1> buckets_{};
  std::uint64_t count_ = 0;
  std::int64_t maximum_ = 0;
};

}  // namespace volto::pipeline
