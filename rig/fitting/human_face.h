// Where the 84 points lie on people, on the average: what few landmarks are completed with.
#pragma once

#include <array>

#include "rig/feature_points.h"

namespace volto::rig {

struct HumanFace {
  FeaturePointPositions points;  // head frame, unit: the eye separation, origin between the eyes; mirror symmetric
  // How far a point lies from where the others say, person to person and annotator to annotator, in eye separations.
  std::array<double, kFeaturePointCount> spread{};
  // The same where no point of its region is given: nothing on the surface says where a brow is.
  std::array<double, kFeaturePointCount> spread_unseen{};
};

// Measured: the mean of two libraries of heads (ICT-FaceKit, MakeHuman) with equal weight, annotated by hand, after a
// similarity fit. Spread: root mean square error of each point when its own library is left out (tests/rig/README.md).
const HumanFace& humanFace();

}  // namespace volto::rig
