// What filtering costs and what it is good for: jitter at rest, and how late a quick move arrives. Everything against
// the same performance unfiltered, since the filters stand at the tracker's end and change nothing before it.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"
#include "tracker/tracker.h"

namespace volto::test {

// One number per frame.
struct Signal {
  std::vector<double> time_s, value;
};

// All weights of a performance.
struct Tracked {
  std::vector<double> time_s;
  std::vector<ArkitWeights> weights;
  ArkitObserved observed{};

  Signal signal(std::size_t shape) const;
  // The mean of both sides: "eyeBlink", "mouthSmile".
  Signal bothSides(std::string_view shape) const;
};

// Tracked as from a detector. A neutral that is given stands; without one it is learned, which moves weights too.
Tracked track(std::span<const LandmarkFrame> frames, double smoothing, const tracker::NeutralFace* neutral);

// Shapes of one region whose filter is the region's; those that the eyes' direction moves are not in it.
enum class Region { lids, brows, mouth, cheeks };
std::vector<std::size_t> shapesOf(Region region, const Tracked& tracked);

// Standard deviation within a second, root mean square over the seconds from from_s to to_s and over the shapes.
double jitter(const Tracked& tracked, std::span<const std::size_t> shapes, double from_s, double to_s);

// The mean of the newest `frames` values (a fraction counts the oldest by its share). At the start of those there are.
Signal movingAverage(const Signal& in, double frames);
Tracked movingAverage(const Tracked& in, double frames);
// The moving average whose jitter is that of `filtered`: its length in frames, at least 1.
double equallySmooth(const Tracked& unfiltered, const Tracked& filtered, std::span<const std::size_t> shapes,
                     double from_s, double to_s);

// A quick move: it rises from `base` through `half` to its highest value.
struct Rise {
  std::size_t begin, peak;  // frames
  double base, half, highest;
};
// Those of at least `height` within 0.4 s.
std::vector<Rise> rises(const Signal& unfiltered, double height);

struct Lag {
  double mean_s = 0, worst_s = 0;  // of the moment in which half of the height is reached, over those that reach it
  double peak = 0;                 // mean share of the height that is reached
  int missed = 0;                  // moves that never reach half of their height; all of them: mean_s is infinite
};
Lag lagBehind(const Signal& unfiltered, const Signal& filtered, std::span<const Rise> rises);

}  // namespace volto::test
