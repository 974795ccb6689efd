// Building blocks of natural motion: reproducible random numbers, smooth moves, slow wandering.
#pragma once

#include <cstdint>
#include <vector>

namespace volto::recordings {

// splitmix64: the same numbers everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double unit();  // 0..1
  double between(double low, double high);
  double normal();  // mean 0, deviation 1

 private:
  std::uint64_t state_;
};

// 0 before 0, 1 after 1, with no jerk at either end: how a hand or a head moves (Flash and Hogan 1985).
double minimumJerk(double t);

// Rises from 0 at `start_s` within `attack_s`, stays at 1 for `hold_s`, falls within `release_s`.
struct Swell {
  double start_s = 0, attack_s = 0.3, hold_s = 0.5, release_s = 0.5;
  double at(double t_s) const;
};

// A value that wanders: sines between two frequencies with random phases, deviation 1.
class Wander {
 public:
  Wander(Random& random, double low_hz, double high_hz);
  double at(double t_s) const;

 private:
  struct Wave {
    double omega, phase, amplitude;
  };
  std::vector<Wave> waves_;
};

// Goes from one key to the next by minimum jerk, within `travel_s` and arriving at `t_s`.
struct Key {
  double t_s, value, travel_s;
};
class Keys {
 public:
  explicit Keys(std::vector<Key> keys) : keys_(std::move(keys)) {}
  double at(double t_s) const;

 private:
  std::vector<Key> keys_;
};

}  // namespace volto::recordings
