#include "tracker/region_filters.h"

#include <algorithm>
#include <string_view>

namespace volto::tracker {
namespace {

// Weights are 0..1, so a speed of 4 per second is a jaw that opens in 0.15 s: with beta 14 its cut-off is 56 Hz above
// the one at rest. The speed's own cut-off lets a blink through that lasts five pictures.
//
// Exact landmarks are hardly filtered; a detector's shake, and twice as much is taken off a face at rest.
// tests/tools/filter_table_test.cpp has the table by which these were found.
constexpr OneEuroConstants kLids{12.0, 15.0}, kLidsFromPixels{2.0, 14.0, 3.0};
constexpr OneEuroConstants kMouth{12.0, 15.0}, kMouthFromPixels{1.5, 14.0, 3.0};
constexpr OneEuroConstants kElsewhere{5.0, 5.0}, kElsewhereFromPixels{1.0, 5.0, 2.0};  // brows, nose, cheeks

// Residuals are millimetres; detector noise lives here, so they are held stiller than the weights.
constexpr OneEuroConstants kLidPoints{3.0, 0.2};
constexpr OneEuroConstants kMouthPoints{2.5, 0.15};
constexpr OneEuroConstants kOtherPoints{1.0, 0.05};

constexpr std::array<OneEuroConstants, 4> kShapeConstants = {kLids, kElsewhere, kMouth, kElsewhere};
constexpr std::array<OneEuroConstants, 4> kShapeConstantsFromPixels = {kLidsFromPixels, kElsewhereFromPixels,
                                                                       kMouthFromPixels, kElsewhereFromPixels};
constexpr std::array<OneEuroConstants, 4> kPointConstants = {kLidPoints, kOtherPoints, kMouthPoints, kOtherPoints};

}  // namespace

RegionFilters::Region RegionFilters::regionOf(std::string_view shape) {
  if (shape.starts_with("eye")) return Region::lids;
  if (shape.starts_with("brow")) return Region::brows;
  if (shape.starts_with("mouth") || shape.starts_with("jaw") || shape.starts_with("tongue")) return Region::mouth;
  return Region::cheeks;
}

RegionFilters::Region RegionFilters::regionOf(rig::FaceRegion region) {
  switch (region) {
    case rig::FaceRegion::left_upper_lid:
    case rig::FaceRegion::left_lower_lid:
    case rig::FaceRegion::right_upper_lid:
    case rig::FaceRegion::right_lower_lid:
      return Region::lids;
    case rig::FaceRegion::upper_lip:
    case rig::FaceRegion::lower_lip:
    case rig::FaceRegion::chin:
      return Region::mouth;
    case rig::FaceRegion::forehead:
    case rig::FaceRegion::left_brow:
    case rig::FaceRegion::right_brow:
      return Region::brows;
    default:
      return Region::cheeks;
  }
}

RegionFilters::RegionFilters(bool from_pixels) {
  const auto& shape_constants = from_pixels ? kShapeConstantsFromPixels : kShapeConstants;
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    shape_region_[k] = regionOf(kArkitBlendshapeNames[k]);
    shape_constants_[k] = shape_constants[static_cast<std::size_t>(shape_region_[k])];
  }
  const auto points = rig::featurePoints();
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    point_region_[i] = regionOf(points[i].region);
    point_constants_[i] = kPointConstants[static_cast<std::size_t>(point_region_[i])];
  }
}

void RegionFilters::reset() {
  for (OneEuro& f : shapes_) f.reset();
  for (OneEuro& f : points_) f.reset();
}

void RegionFilters::push(double dt_s, double smoothing, const RegionSmoothing& regions, ArkitWeights& weights,
                         rig::FeaturePointPositions& rest_mm) {
  const std::array<double, kRegions> strength = {smoothing * regions.lids, smoothing * regions.brows,
                                                 smoothing * regions.mouth, smoothing * regions.cheeks};
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const double s = strength[static_cast<std::size_t>(shape_region_[k])];
    weights[k] = std::clamp(static_cast<float>(shapes_[k].push(weights[k], dt_s, shape_constants_[k], s)), 0.0F, 1.0F);
  }
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    const double s = strength[static_cast<std::size_t>(point_region_[i])];
    for (std::size_t c = 0; c < 3; ++c) {
      double& value = rest_mm(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c));
      value = points_[3 * i + c].push(value, dt_s, point_constants_[i], s);
    }
  }
}

}  // namespace volto::tracker
