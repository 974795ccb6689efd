#include "tracker/lid_range.h"

#include <algorithm>
#include <cmath>

namespace volto::tracker {
namespace {

constexpr float kBegins = 0.10F;            // above the open eye: a blink may have begun
constexpr float kSmallestPeak = 0.18F;      // above the open eye: it was one
constexpr double kLongest_s = 0.6;          // longer is a closed or a narrowed eye, not a blink
constexpr float kUp = 0.6F, kDown = 0.15F;  // share by which one blink moves the range; a picture now and then misses
                                            // the moment of closing, so a weaker one counts less
constexpr float kSmallestRange = 0.15F;
constexpr double kOpenMemory_s = 20;  // over what time the open eye is averaged

}  // namespace

void LidCalibration::start(const LidRange& range) {
  *this = {};
  if (!(range.closed > range.open)) return;
  range_ = range;
  known_ = true;
}

float LidCalibration::push(float blink, double dt_s) {
  learn(blink, dt_s);
  const float reach = known_ ? std::max(range_.closed - range_.open, kSmallestRange) : 1.0F;
  return std::clamp((blink - range_.open) / reach, 0.0F, 1.0F);
}

void LidCalibration::learn(float blink, double dt_s) {
  const float above = blink - range_.open;
  if (!closing_ && above > kBegins) {
    closing_ = true;
    peak_ = 0;
    closed_s_ = 0;
  }
  if (closing_) {
    closed_s_ += dt_s;
    peak_ = std::max(peak_, blink);
    if (above > kBegins) return;
    closing_ = false;
    if (peak_ - range_.open < kSmallestPeak || closed_s_ > kLongest_s) return;
    if (!known_) {
      range_.closed = peak_;
      known_ = true;
    } else {
      range_.closed += (peak_ > range_.closed ? kUp : kDown) * (peak_ - range_.closed);
    }
    range_.closed = std::clamp(range_.closed, range_.open + kSmallestRange, 1.0F);
    return;
  }
  // Open: what is left of the weight then is the neutral's error. Falling is believed sooner than rising.
  const double memory_s = blink < range_.open ? kOpenMemory_s / 4 : kOpenMemory_s;
  range_.open += static_cast<float>(1 - std::exp(-dt_s / memory_s)) * (blink - range_.open);
}

}  // namespace volto::tracker
