#include "tools/pipeline/latency_histogram.h"

#include <algorithm>
#include <cmath>

namespace volto::pipeline {

void LatencyHistogram::add(std::int64_t duration_ns) {
  const double value = static_cast<double>(std::max<std::int64_t>(duration_ns, 1));
  const auto bucket = static_cast<std::size_t>(std::ceil(std::log2(value) * kPerOctave));
  ++buckets_[std::min(bucket, buckets_.size() - 1)];
  ++count_;
  maximum_ = std::max(maximum_, duration_ns);
}

std::int64_t LatencyHistogram::percentile(double fraction) const {
  if (count_ == 0) return 0;
  const auto wanted =
      static_cast<std::uint64_t>(std::ceil(std::clamp(fraction, 0.0, 1.0) * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < buckets_.size(); ++i) {
    seen += buckets_[i];
    if (seen >= std::max<std::uint64_t>(wanted, 1)) {
      return std::min(maximum_,
                      static_cast<std::int64_t>(std::llround(std::exp2(static_cast<double>(i) / kPerOctave))));
    }
  }
  return maximum_;
}

}  // namespace volto::pipeline
