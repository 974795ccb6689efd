// The mean face: what a face at rest looks like before anything is known of the actor.
#pragma once

#include <string>
#include <string_view>

#include "rig/feature_points.h"

namespace volto::tracker {

// 84 by 3, millimetres, head frame, exactly mirror symmetric. tracker/assets/mean_face.csv, compiled into the library.
const rig::FeaturePointPositions& meanFace();

// Reads that file's format. Throws std::invalid_argument, naming line and what is wrong.
rig::FeaturePointPositions parseMeanFace(std::string_view csv, const std::string& name_for_errors);

}  // namespace volto::tracker
