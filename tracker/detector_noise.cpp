#include "tracker/detector_noise.h"

#include "rig/feature_points.h"

namespace volto::tracker {
namespace {

constexpr double kOutlineTrust = 0.2, kBrowTrust = 0.5;  // shares of what the layout's table says

}  // namespace

Settings settingsFor(const TrackerOptions& options) {
  Settings settings;
  if (!options.from_pixels) return settings;
  // Against 64 points that are off by more than a millimetre, and not independently, what people do counts for more:
  // with the constants for measured landmarks the shapes of both sides fight each other to explain the detector.
  settings.point_noise_mm = 1.2;
  // What a detector draws fits less well, and along one linearisation three steps do not settle on a head that turns.
  settings.linear_within_rad = 0.006;
  settings.correlation = 0.9;
  settings.habit_frames = 60;
  settings.expression_memory_s = 0.1;  // or a blink is over before it is believed
  settings.rest_quantile = 0.2;        // a shape's lowest values are the detector's, not the actor's
  settings.rest_deviation = 0.02;
  return settings;
}

MeasuredPoints measuredPoints(const LayoutTable& layout, const TrackerOptions& options) {
  MeasuredPoints points = measuredPoints(layout);
  if (!options.from_pixels) return points;
  const auto table = rig::featurePoints();
  for (int p = 0; p < points.count(); ++p) {
    const int ibug = table[static_cast<std::size_t>(points.feature[static_cast<std::size_t>(p)])].ibug68[0];
    if (ibug <= 16) {
      points.trust[p] *= kOutlineTrust;
    } else if (ibug <= 26) {
      points.trust[p] *= kBrowTrust;
    }
  }
  return points;
}

}  // namespace volto::tracker
