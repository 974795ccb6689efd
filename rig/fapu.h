// Facial animation parameter units: key distances of a neutral face. A displacement divided by its unit carries from one face
// to another (Queiroz, equations 1 and 2). Plain distances; the 1/1024 of MPEG-4 belongs to MPEG-4 streams alone.
#pragma once

#include <string>
#include <vector>

#include "rig/feature_points.h"

namespace volto::rig {

struct Fapu {
  double iris_diameter = 0;   // IRISD0: lid to lid, mean of both eyes
  double eye_separation = 0;  // ES0: centre of left eye to centre of right eye
  double eye_nose = 0;        // ENS0: height of the eye centres above 9.15
  double mouth_nose = 0;      // MNS0: height of 9.15 above 2.2
  double mouth_width = 0;     // MW0: 8.3 to 8.4

  double operator[](FapuUnit unit) const;
};

struct FapuMeasurement {
  Fapu fapu;                               // every unit > 0 and finite
  std::vector<std::string> substitutions;  // one line per unit that was near zero: its name, what was measured, what is used instead
};

// Positions of a neutral mask in the HEAD frame (+y up), any unit of length. A unit below 2 % of a human face's proportion to the eye
// separation (a face drawn with closed eyes) is replaced by the human proportion. Throws std::invalid_argument when a position is
// not finite or the eye separation is zero: nothing can be measured then.
FapuMeasurement measureFapu(const FeaturePointPositions& neutral);

// 84 by 3: the length, in the unit of the face that was measured, of one FAPU along each axis of each point.
FeaturePointPositions fapuScale(const Fapu& fapu);

}  // namespace volto::rig
