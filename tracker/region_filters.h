// One-Euro filters for a MaskFrame: constants per region of the face, since a lid closes in 0.1 s and a brow takes its
// time. Internal to the tracker.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "frames/mask_frame.h"
#include "rig/feature_points.h"
#include "tracker/one_euro.h"
#include "tracker/tracker.h"

namespace volto::tracker {

// Filters weights, and what the measured points add to them, each with the constants of its region.
class RegionFilters {
 public:
  // `from_pixels`: for landmarks of a detector (TrackerOptions::from_pixels).
  explicit RegionFilters(bool from_pixels);

  void reset();
  // In place. `rest_mm`: displacement of each point beyond what the weights explain, 84 by 3.
  void push(double dt_s, double smoothing, const RegionSmoothing& regions, ArkitWeights& weights,
            rig::FeaturePointPositions& rest_mm);

 private:
  enum class Region : std::uint8_t { lids, brows, mouth, cheeks };
  static constexpr std::size_t kRegions = 4;
  static Region regionOf(std::string_view shape);
  static Region regionOf(rig::FaceRegion region);

  std::array<Region, kArkitBlendshapeCount> shape_region_;
  std::array<Region, kFeaturePointCount> point_region_;
  std::array<OneEuroConstants, kArkitBlendshapeCount> shape_constants_;
  std::array<OneEuroConstants, kFeaturePointCount> point_constants_;
  std::array<OneEuro, kArkitBlendshapeCount> shapes_;
  std::array<OneEuro, 3 * kFeaturePointCount> points_;
};

}  // namespace volto::tracker
