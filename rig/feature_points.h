// The 84 feature points of the control mask: MPEG-4 (ISO/IEC 14496-2, Annex C) points of the face's front, and group 12, the
// tracked points that connect the 68-point annotation. Left and right are the subject's.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "frames/mask_frame.h"

namespace volto::rig {

// One row per feature point. In a control mask's own frame and unit unless said otherwise.
using FeaturePointPositions = Eigen::Matrix<double, static_cast<int>(kFeaturePointCount), 3, Eigen::RowMajor>;

enum class FaceRegion : std::uint8_t {
  forehead, left_brow, right_brow, left_upper_lid, left_lower_lid, right_upper_lid, right_lower_lid,
  nose, left_cheek, right_cheek, upper_lip, lower_lip, chin, jaw,
};
inline constexpr std::size_t kFaceRegionCount = 14;
std::string_view regionName(FaceRegion region);

// Facial animation parameter unit that an axis of a point is measured in (rig/fapu.h).
enum class FapuUnit : std::uint8_t { iris_diameter, eye_separation, eye_nose, mouth_nose, mouth_width };

struct FeaturePoint {
  std::string_view id;             // "2.1"
  std::string_view name;           // "bottom of the chin"
  FaceRegion region;
  std::uint8_t mirror;             // index of the other side's point; its own index on the midline
  std::array<FapuUnit, 3> fapu;    // unit of x, y, z
  std::array<std::int8_t, 2> ibug68;  // landmark(s) of the 68-point annotation at this point: {62, -1}, {43, 44} = between, {-1, -1} = derived
};

// In the order 2.1 .. 2.14, 3.1 .. 3.14 (without 3.5, 3.6), 4.*, 5.*, 8.*, 9.1-9.7, 9.12-9.15, 10.7-10.10, 11.1-11.3, 12.1-12.20.
// This order is the row order of every mask array in Volto, and on the wire.
std::span<const FeaturePoint, kFeaturePointCount> featurePoints();

// Index of "8.3"; nothing for an id that is not in the mask.
std::optional<std::size_t> featurePointIndex(std::string_view id);

}  // namespace volto::rig
