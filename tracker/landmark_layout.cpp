#include "tracker/landmark_layout.h"

#include <stdexcept>
#include <string>

#include "rig/feature_points.h"

namespace volto::tracker {
namespace {

constexpr double kOutlineTrust = 0.5;

// OpenSeeFace's 66 points are the 68 without the two inner lip corners, the mouth counted anew (OpenSee.cs,
// facetracker.py).
std::int16_t openSeeFaceFromIbug(int ibug) {
  if (ibug < 48) return static_cast<std::int16_t>(ibug);
  if (ibug == 48) return 58;
  if (ibug <= 53) return static_cast<std::int16_t>(ibug - 1);
  if (ibug == 54) return 62;
  if (ibug <= 59) return static_cast<std::int16_t>(ibug - 2);
  if (ibug == 60 || ibug == 64) return -1;  // its corners stand for the outer ones
  if (ibug <= 63) return static_cast<std::int16_t>(ibug - 2);
  return static_cast<std::int16_t>(ibug - 2);
}

// MediaPipe's face mesh has no outline and no points named as iBUG's: the nearest of its 468 skin points, after
// PeizhiYan/Mediapipe_2_Dlib_Landmarks (mp2dlib.py); of two, the first. Lids, brows and lips agree well, the outline by
// a few millimetres.
constexpr std::array<std::int16_t, 68> kMediaPipeFromIbug = {
    127, 234, 93,  132, 58,  136, 150, 176, 152, 400, 379, 365, 288, 361, 323, 454, 356,  // outline
    70,  63,  105, 66,  107, 336, 296, 334, 293, 300,                                     // brows
    168, 197, 5,   4,   75,  97,  2,   326, 305,                                          // nose
    33,  160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380,                           // lids
    61,  39,  37,  0,   267, 269, 291, 321, 314, 17,  84,  91,                            // lips
    78,  82,  13,  312, 308, 317, 14,  87};

LayoutTable makeTable(LandmarkLayout layout) {
  LayoutTable table;
  const auto points = rig::featurePoints();
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    // A point between two landmarks (3.1 to 3.4) is not measured twice: the landmarks have points of their own in
    // group 12.
    const bool own = points[i].ibug68[0] >= 0 && points[i].ibug68[1] < 0;
    const int ibug = own ? points[i].ibug68[0] : -1;
    table.landmark[i] = static_cast<std::int16_t>(ibug);
    if (own && layout == LandmarkLayout::openseeface66) table.landmark[i] = openSeeFaceFromIbug(ibug);
    if (own && layout == LandmarkLayout::mediapipe478)
      table.landmark[i] = kMediaPipeFromIbug[static_cast<std::size_t>(ibug)];
    table.trust[i] = ibug >= 0 && ibug <= 16 ? kOutlineTrust : 1.0;
  }
  return table;
}

}  // namespace

std::string_view layoutName(LandmarkLayout layout) {
  switch (layout) {
    case LandmarkLayout::ibug68:
      return "ibug68";
    case LandmarkLayout::openseeface66:
      return "openseeface66";
    case LandmarkLayout::mediapipe478:
      return "mediapipe478";
  }
  return "unknown";
}

const LayoutTable& layoutTable(LandmarkLayout layout) {
  static const LayoutTable ibug68 = makeTable(LandmarkLayout::ibug68);
  static const LayoutTable openseeface66 = makeTable(LandmarkLayout::openseeface66);
  static const LayoutTable mediapipe478 = makeTable(LandmarkLayout::mediapipe478);
  switch (layout) {
    case LandmarkLayout::ibug68:
      return ibug68;
    case LandmarkLayout::openseeface66:
      return openseeface66;
    case LandmarkLayout::mediapipe478:
      return mediapipe478;
  }
  throw std::invalid_argument("landmark layout " + std::to_string(static_cast<int>(layout)) +
                              " is not understood by the tracker; use ibug68, openseeface66 or mediapipe478");
}

}  // namespace volto::tracker
