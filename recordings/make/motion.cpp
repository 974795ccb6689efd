#include "recordings/make/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace volto::recordings {

double Random::unit() {
  std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
}

double Random::between(double low, double high) { return low + (high - low) * unit(); }

double Random::normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - unit()));
  return radius * std::cos(2.0 * std::numbers::pi * unit());
}

double minimumJerk(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
}

double Swell::at(double t_s) const {
  const double since = t_s - start_s;
  return minimumJerk(since / attack_s) * (1.0 - minimumJerk((since - attack_s - hold_s) / release_s));
}

Wander::Wander(Random& random, double low_hz, double high_hz) {
  constexpr int kWaves = 7;
  double power = 0.0;
  for (int i = 0; i < kWaves; ++i) {
    const double share = (i + random.unit()) / kWaves;
    const double hz = low_hz * std::pow(high_hz / low_hz, share);
    const double amplitude = std::sqrt(low_hz / hz);  // the slower, the wider
    waves_.push_back({2.0 * std::numbers::pi * hz, random.between(0.0, 2.0 * std::numbers::pi), amplitude});
    power += 0.5 * amplitude * amplitude;
  }
  for (Wave& wave : waves_) wave.amplitude /= std::sqrt(power);
}

double Wander::at(double t_s) const {
  double sum = 0.0;
  for (const Wave& wave : waves_) sum += wave.amplitude * std::sin(wave.omega * t_s + wave.phase);
  return sum;
}

double Keys::at(double t_s) const {
  double value = keys_.empty() ? 0.0 : keys_.front().value;
  for (std::size_t i = 1; i < keys_.size(); ++i) {
    const Key& key = keys_[i];
    value += (key.value - keys_[i - 1].value) * minimumJerk((t_s - key.t_s + key.travel_s) / key.travel_s);
  }
  return value;
}

}  // namespace volto::recordings
