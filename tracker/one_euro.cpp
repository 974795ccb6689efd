#include "tracker/one_euro.h"

#include <cmath>
#include <numbers>

namespace volto::tracker {
namespace {

// Casiez et al., equation 5: the share of the new value in a first-order low pass.
double share(double cutoff_hz, double dt_s) {
  const double r = 2 * std::numbers::pi * cutoff_hz * dt_s;
  return r / (r + 1);
}

}  // namespace

double OneEuro::push(double value, double dt_s, const OneEuroConstants& constants, double smoothing) {
  if (empty_ || smoothing <= 0) {
    empty_ = false;
    value_ = value;
    speed_ = 0;
    return value_;
  }
  const double speed = (value - value_) / dt_s;
  speed_ += share(constants.speed_cutoff_hz, dt_s) * (speed - speed_);
  const double cutoff_hz =
      constants.min_cutoff_hz / smoothing + constants.beta / std::sqrt(smoothing) * std::abs(speed_);
  value_ += share(cutoff_hz, dt_s) * (value - value_);
  return value_;
}

}  // namespace volto::tracker
