// Spoken sentences as mouth shapes: phones, their targets on the ARKit shapes, and how neighbours blend into each
// other.
#pragma once

#include <string_view>
#include <vector>

#include "frames/arkit_blendshapes.h"
#include "recordings/make/motion.h"

namespace volto::recordings {

// A sentence laid out in time. Blending is by dominance functions: each phone pulls the mouth towards its target, the
// more strongly the nearer it is in time and the less its shape may be given up (Cohen and Massaro 1993). Lips that
// must close, close.
class Speech {
 public:
  // `phones`: ARPAbet with stress digits, "_" a pause: "HH AH0 L OW1 _". Throws std::invalid_argument for an unknown
  // phone.
  Speech(double start_s, std::string_view phones, Random& random);

  double startS() const { return start_s_; }
  double endS() const { return end_s_; }
  // Middles of the stressed vowels: where the head nods and the brows rise.
  const std::vector<double>& stresses() const { return stresses_; }

  // Adds the mouth's shape at time t.
  void addTo(double t_s, ArkitWeights& weights) const;

 private:
  struct Target {
    std::size_t shape;
    double weight;
  };
  struct Gesture {
    double centre_s, reach_s, strength;
    std::vector<Target> targets;
  };
  void addGesture(std::string_view viseme, double centre_s, double duration_s, double loudness);

  double start_s_, end_s_;
  std::vector<Gesture> gestures_;
  std::vector<double> stresses_;
};

}  // namespace volto::recordings
