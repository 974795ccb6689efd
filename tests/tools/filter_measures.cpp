#include "tests/tools/filter_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace volto::test {
namespace {

constexpr double kRise_s = 0.4;  // a blink closes in 0.1 s, a jaw opens in 0.2 s
constexpr double kAfter_s = 0.3;

std::size_t indexOf(const std::string& shape) {
  const auto index = arkitBlendshapeIndex(shape);
  if (!index) throw std::invalid_argument("no shape " + shape);
  return *index;
}

// Where it is highest.
std::size_t highestFrame(const Signal& signal, std::size_t begin, std::size_t end) {
  const auto from = signal.value.begin();
  return static_cast<std::size_t>(
      std::max_element(from + static_cast<std::ptrdiff_t>(begin), from + static_cast<std::ptrdiff_t>(end)) - from);
}

// When the value passes `level` for the last time before it is highest, between frames by a straight line.
std::optional<double> crossing(const Signal& signal, std::size_t begin, std::size_t end, double level) {
  for (std::size_t i = highestFrame(signal, begin, end); i > begin; --i) {
    const double before = signal.value[i - 1], after = signal.value[i];
    if (before < level && after >= level)
      return signal.time_s[i - 1] + (level - before) / (after - before) * (signal.time_s[i] - signal.time_s[i - 1]);
  }
  return std::nullopt;
}

}  // namespace

Signal Tracked::signal(std::size_t shape) const {
  Signal out{time_s, {}};
  for (const ArkitWeights& w : weights) out.value.push_back(w[shape]);
  return out;
}

Signal Tracked::bothSides(std::string_view shape) const {
  Signal out = signal(indexOf(std::string(shape) + "Left"));
  const Signal right = signal(indexOf(std::string(shape) + "Right"));
  for (std::size_t i = 0; i < out.value.size(); ++i) out.value[i] = 0.5 * (out.value[i] + right.value[i]);
  return out;
}

Tracked track(std::span<const LandmarkFrame> frames, double smoothing, const tracker::NeutralFace* neutral) {
  tracker::TrackerOptions options;
  options.from_pixels = true;
  options.regions.head = 1;
  options.smoothing = smoothing;
  tracker::Tracker tracker(options);
  if (neutral != nullptr) tracker.setNeutral(*neutral);
  Tracked out;
  MaskFrame mask;
  for (const LandmarkFrame& frame : frames) {
    tracker.push(frame, mask);
    out.time_s.push_back(1e-9 * static_cast<double>(frame.t_capture_ns));
    out.weights.push_back(mask.arkit_weights);
  }
  out.observed = mask.arkit_observed;
  return out;
}

std::vector<std::size_t> shapesOf(Region region, const Tracked& tracked) {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const std::string_view name = kArkitBlendshapeNames[k];
    const bool in = region == Region::lids    ? name.starts_with("eye") && !name.starts_with("eyeLook")
                    : region == Region::brows ? name.starts_with("brow")
                    : region == Region::mouth ? name.starts_with("mouth") || name.starts_with("jaw")
                                              : name.starts_with("cheek") || name.starts_with("nose");
    if (in && tracked.observed[k]) out.push_back(k);
  }
  return out;
}

double jitter(const Tracked& tracked, std::span<const std::size_t> shapes, double from_s, double to_s) {
  double variance = 0;
  int groups = 0;
  for (double second = from_s; second + 1 <= to_s + 1e-9; second += 1) {
    for (const std::size_t shape : shapes) {
      double sum = 0, squares = 0;
      int n = 0;
      for (std::size_t i = 0; i < tracked.time_s.size(); ++i) {
        if (tracked.time_s[i] < second || tracked.time_s[i] >= second + 1) continue;
        sum += tracked.weights[i][shape];
        squares += static_cast<double>(tracked.weights[i][shape]) * tracked.weights[i][shape];
        ++n;
      }
      if (n < 2) continue;
      variance += std::max(squares / n - (sum / n) * (sum / n), 0.0);
      ++groups;
    }
  }
  return groups > 0 ? std::sqrt(variance / groups) : 0;
}

Signal movingAverage(const Signal& in, double frames) {
  Signal out{in.time_s, {}};
  const auto whole = static_cast<std::size_t>(frames);
  for (std::size_t i = 0; i < in.value.size(); ++i) {
    double sum = 0, weight = 0;
    for (std::size_t back = 0; back <= whole && back <= i; ++back) {
      const double share = back < whole ? 1 : frames - static_cast<double>(whole);
      sum += share * in.value[i - back];
      weight += share;
    }
    out.value.push_back(sum / weight);
  }
  return out;
}

Tracked movingAverage(const Tracked& in, double frames) {
  Tracked out = in;
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const Signal averaged = movingAverage(in.signal(k), frames);
    for (std::size_t i = 0; i < averaged.value.size(); ++i) out.weights[i][k] = static_cast<float>(averaged.value[i]);
  }
  return out;
}

double equallySmooth(const Tracked& unfiltered, const Tracked& filtered, std::span<const std::size_t> shapes,
                     double from_s, double to_s) {
  const double wanted = jitter(filtered, shapes, from_s, to_s);
  double low = 1, high = 40;
  for (int step = 0; step < 16; ++step) {
    const double middle = 0.5 * (low + high);
    (jitter(movingAverage(unfiltered, middle), shapes, from_s, to_s) > wanted ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

std::vector<Rise> rises(const Signal& unfiltered, double height) {
  std::vector<Rise> out;
  const auto& v = unfiltered.value;
  for (std::size_t i = 1; i + 1 < v.size(); ++i) {
    if (v[i] < v[i - 1] || v[i] <= v[i + 1]) continue;  // no peak
    std::size_t begin = i;
    while (begin > 0 && unfiltered.time_s[i] - unfiltered.time_s[begin - 1] <= kRise_s) --begin;
    const auto lowest = static_cast<std::size_t>(
        std::min_element(v.begin() + static_cast<std::ptrdiff_t>(begin), v.begin() + static_cast<std::ptrdiff_t>(i)) -
        v.begin());
    if (v[i] - v[lowest] < height) continue;
    const Rise rise{lowest, i, v[lowest], 0.5 * (v[lowest] + v[i]), v[i]};
    // A second peak on the way is the same move; the higher one counts.
    if (!out.empty() && unfiltered.time_s[i] - unfiltered.time_s[out.back().peak] < kRise_s) {
      if (rise.highest > out.back().highest && rise.begin <= out.back().peak) out.back() = rise;
      continue;
    }
    out.push_back(rise);
  }
  return out;
}

Lag lagBehind(const Signal& unfiltered, const Signal& filtered, std::span<const Rise> rises) {
  Lag out;
  int counted = 0;
  for (const Rise& rise : rises) {
    std::size_t end = rise.peak + 1;
    while (end < filtered.value.size() && filtered.time_s[end] - filtered.time_s[rise.peak] <= kAfter_s) ++end;
    const auto there = crossing(unfiltered, rise.begin, end, rise.half);
    const auto here = crossing(filtered, rise.begin, end, rise.half);
    const double highest = filtered.value[highestFrame(filtered, rise.begin, end)];
    out.peak += (highest - rise.base) / (rise.highest - rise.base) / static_cast<double>(rises.size());
    if (!there || !here) {
      ++out.missed;
      continue;
    }
    ++counted;
    out.mean_s += *here - *there;
    out.worst_s = std::max(out.worst_s, *here - *there);
  }
  out.mean_s = counted > 0 ? out.mean_s / counted : std::numeric_limits<double>::infinity();
  return out;
}

}  // namespace volto::test
