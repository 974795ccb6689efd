// Which landmark of a detector's layout lies at which feature point.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"

namespace volto::tracker {

std::string_view layoutName(LandmarkLayout layout);

// What the tracker needs to know of a layout. One row per feature point; -1: this layout has no landmark there.
struct LayoutTable {
  std::array<std::int16_t, kFeaturePointCount> landmark;
  // How far a landmark can be believed, 0..1: the face's outline is drawn where the face ends in the image, so its
  // points slide over the skin as the head turns, and a detector draws them least surely.
  std::array<double, kFeaturePointCount> trust;
};

// Throws std::invalid_argument, naming the layout, for one that the tracker does not speak yet.
const LayoutTable& layoutTable(LandmarkLayout layout);

}  // namespace volto::tracker
