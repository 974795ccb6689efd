// One-Euro filter: a first-order low pass whose cut-off rises with speed, so that a face at rest is still and a fast
// one is not late. G. Casiez, N. Roussel, D. Vogel: 1 euro filter: a simple speed-based low-pass filter for noisy input
// in interactive systems, CHI 2012.
#pragma once

namespace volto::tracker {

struct OneEuroConstants {
  double min_cutoff_hz;  // cut-off at rest; lower is stiller
  double beta;           // Hz of cut-off per unit of speed (unit of the signal per second); higher is less late
  double speed_cutoff_hz = 1.0;
};

// One signal. Allocates nothing; the state is three numbers.
class OneEuro {
 public:
  // dt_s > 0. `smoothing` divides the cut-off at rest, and its square root beta, since a detector's shaking is speed
  // too: 1 as the constants say, 4 four times as stiff at rest and half as ready to follow. 0 passes the signal
  // through.
  double push(double value, double dt_s, const OneEuroConstants& constants, double smoothing);
  // The next value is taken as it is.
  void reset() { empty_ = true; }
  double value() const { return value_; }

 private:
  bool empty_ = true;
  double value_ = 0;
  double speed_ = 0;
};

}  // namespace volto::tracker
