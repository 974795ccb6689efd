#include "rig/feature_points.h"

namespace volto::rig {
namespace {

using Axes = std::array<FapuUnit, 3>;
constexpr Axes kMouthAxes{FapuUnit::mouth_width, FapuUnit::mouth_nose, FapuUnit::mouth_nose};
constexpr Axes kLidAxes{FapuUnit::eye_separation, FapuUnit::iris_diameter, FapuUnit::eye_separation};
constexpr Axes kBrowAxes{FapuUnit::eye_separation, FapuUnit::eye_nose, FapuUnit::eye_separation};
constexpr Axes kNoseAxes{FapuUnit::eye_nose, FapuUnit::eye_nose, FapuUnit::eye_nose};

// clang-format off
constexpr std::array<FeaturePoint, kFeaturePointCount> kFeaturePoints = {{
    {"2.1", "bottom of the chin", FaceRegion::chin, 0, kMouthAxes, {8, -1}},
    {"2.2", "middle of inner upper lip contour", FaceRegion::upper_lip, 1, kMouthAxes, {62, -1}},
    {"2.3", "middle of inner lower lip contour", FaceRegion::lower_lip, 2, kMouthAxes, {66, -1}},
    {"2.4", "left corner of inner lip contour", FaceRegion::upper_lip, 4, kMouthAxes, {64, -1}},
    {"2.5", "right corner of inner lip contour", FaceRegion::upper_lip, 3, kMouthAxes, {60, -1}},
    {"2.6", "inner upper lip, left of the middle", FaceRegion::upper_lip, 6, kMouthAxes, {63, -1}},
    {"2.7", "inner upper lip, right of the middle", FaceRegion::upper_lip, 5, kMouthAxes, {61, -1}},
    {"2.8", "inner lower lip, left of the middle", FaceRegion::lower_lip, 8, kMouthAxes, {65, -1}},
    {"2.9", "inner lower lip, right of the middle", FaceRegion::lower_lip, 7, kMouthAxes, {67, -1}},
    {"2.10", "chin boss", FaceRegion::chin, 9, kMouthAxes, {-1, -1}},
    {"2.11", "left corner of the chin", FaceRegion::chin, 11, kMouthAxes, {9, -1}},
    {"2.12", "right corner of the chin", FaceRegion::chin, 10, kMouthAxes, {7, -1}},
    {"2.13", "left corner of the jaw bone", FaceRegion::jaw, 13, kMouthAxes, {12, -1}},
    {"2.14", "right corner of the jaw bone", FaceRegion::jaw, 12, kMouthAxes, {4, -1}},
    {"3.1", "centre of the left upper lid margin", FaceRegion::left_upper_lid, 15, kLidAxes, {43, 44}},
    {"3.2", "centre of the right upper lid margin", FaceRegion::right_upper_lid, 14, kLidAxes, {37, 38}},
    {"3.3", "centre of the left lower lid margin", FaceRegion::left_lower_lid, 17, kLidAxes, {46, 47}},
    {"3.4", "centre of the right lower lid margin", FaceRegion::right_lower_lid, 16, kLidAxes, {40, 41}},
    {"3.7", "left (outer) corner of the left eye", FaceRegion::left_upper_lid, 23, kLidAxes, {45, -1}},
    {"3.8", "left (inner) corner of the right eye", FaceRegion::right_upper_lid, 22, kLidAxes, {39, -1}},
    {"3.9", "left lower lid, where it meets the cheek", FaceRegion::left_lower_lid, 21, kLidAxes, {-1, -1}},
    {"3.10", "right lower lid, where it meets the cheek", FaceRegion::right_lower_lid, 20, kLidAxes, {-1, -1}},
    {"3.11", "right (inner) corner of the left eye", FaceRegion::left_upper_lid, 19, kLidAxes, {42, -1}},
    {"3.12", "right (outer) corner of the right eye", FaceRegion::right_upper_lid, 18, kLidAxes, {36, -1}},
    {"3.13", "left upper lid crease", FaceRegion::left_upper_lid, 25, kLidAxes, {-1, -1}},
    {"3.14", "right upper lid crease", FaceRegion::right_upper_lid, 24, kLidAxes, {-1, -1}},
    {"4.1", "inner end of the left eyebrow", FaceRegion::left_brow, 27, kBrowAxes, {22, -1}},
    {"4.2", "inner end of the right eyebrow", FaceRegion::right_brow, 26, kBrowAxes, {21, -1}},
    {"4.3", "uppermost point of the left eyebrow", FaceRegion::left_brow, 29, kBrowAxes, {24, -1}},
    {"4.4", "uppermost point of the right eyebrow", FaceRegion::right_brow, 28, kBrowAxes, {19, -1}},
    {"4.5", "outer end of the left eyebrow", FaceRegion::left_brow, 31, kBrowAxes, {26, -1}},
    {"4.6", "outer end of the right eyebrow", FaceRegion::right_brow, 30, kBrowAxes, {17, -1}},
    {"5.1", "centre of the left cheek", FaceRegion::left_cheek, 33, kBrowAxes, {-1, -1}},
    {"5.2", "centre of the right cheek", FaceRegion::right_cheek, 32, kBrowAxes, {-1, -1}},
    {"5.3", "left cheek bone", FaceRegion::left_cheek, 35, kBrowAxes, {-1, -1}},
    {"5.4", "right cheek bone", FaceRegion::right_cheek, 34, kBrowAxes, {-1, -1}},
    {"8.1", "middle of outer upper lip contour", FaceRegion::upper_lip, 36, kMouthAxes, {51, -1}},
    {"8.2", "middle of outer lower lip contour", FaceRegion::lower_lip, 37, kMouthAxes, {57, -1}},
    {"8.3", "left corner of outer lip contour", FaceRegion::upper_lip, 39, kMouthAxes, {54, -1}},
    {"8.4", "right corner of outer lip contour", FaceRegion::upper_lip, 38, kMouthAxes, {48, -1}},
    {"8.5", "outer upper lip, towards the left corner", FaceRegion::upper_lip, 41, kMouthAxes, {53, -1}},
    {"8.6", "outer upper lip, towards the right corner", FaceRegion::upper_lip, 40, kMouthAxes, {49, -1}},
    {"8.7", "outer lower lip, towards the left corner", FaceRegion::lower_lip, 43, kMouthAxes, {55, -1}},
    {"8.8", "outer lower lip, towards the right corner", FaceRegion::lower_lip, 42, kMouthAxes, {59, -1}},
    {"8.9", "right high point of the Cupid's bow", FaceRegion::upper_lip, 45, kMouthAxes, {50, -1}},
    {"8.10", "left high point of the Cupid's bow", FaceRegion::upper_lip, 44, kMouthAxes, {52, -1}},
    {"9.1", "left wing of the nose", FaceRegion::nose, 47, kNoseAxes, {35, -1}},
    {"9.2", "right wing of the nose", FaceRegion::nose, 46, kNoseAxes, {31, -1}},
    {"9.3", "tip of the nose", FaceRegion::nose, 48, kNoseAxes, {30, -1}},
    {"9.4", "bottom right edge of the nose", FaceRegion::nose, 50, kNoseAxes, {32, -1}},
    {"9.5", "bottom left edge of the nose", FaceRegion::nose, 49, kNoseAxes, {34, -1}},
    {"9.6", "right upper edge of the nose bone", FaceRegion::nose, 52, kNoseAxes, {-1, -1}},
    {"9.7", "left upper edge of the nose bone", FaceRegion::nose, 51, kNoseAxes, {-1, -1}},
    {"9.12", "middle lower edge of the nose bone", FaceRegion::nose, 53, kNoseAxes, {29, -1}},
    {"9.13", "left lower edge of the nose bone", FaceRegion::nose, 55, kNoseAxes, {-1, -1}},
    {"9.14", "right lower edge of the nose bone", FaceRegion::nose, 54, kNoseAxes, {-1, -1}},
    {"9.15", "bottom middle edge of the nose", FaceRegion::nose, 56, kNoseAxes, {33, -1}},
    {"10.7", "lower contact of the left ear lobe and the face", FaceRegion::jaw, 58, kNoseAxes, {15, -1}},
    {"10.8", "lower contact of the right ear lobe and the face", FaceRegion::jaw, 57, kNoseAxes, {1, -1}},
    {"10.9", "upper contact of the left ear and the face", FaceRegion::forehead, 60, kNoseAxes, {16, -1}},
    {"10.10", "upper contact of the right ear and the face", FaceRegion::forehead, 59, kNoseAxes, {0, -1}},
    {"11.1", "middle of the hair line", FaceRegion::forehead, 61, kNoseAxes, {-1, -1}},
    {"11.2", "right hair line", FaceRegion::forehead, 63, kNoseAxes, {-1, -1}},
    {"11.3", "left hair line", FaceRegion::forehead, 62, kNoseAxes, {-1, -1}},
    {"12.1", "left eyebrow, between inner end and top", FaceRegion::left_brow, 66, kBrowAxes, {23, -1}},
    {"12.2", "left eyebrow, between top and outer end", FaceRegion::left_brow, 67, kBrowAxes, {25, -1}},
    {"12.3", "right eyebrow, between inner end and top", FaceRegion::right_brow, 64, kBrowAxes, {20, -1}},
    {"12.4", "right eyebrow, between top and outer end", FaceRegion::right_brow, 65, kBrowAxes, {18, -1}},
    {"12.5", "left upper lid margin, inner", FaceRegion::left_upper_lid, 72, kLidAxes, {43, -1}},
    {"12.6", "left upper lid margin, outer", FaceRegion::left_upper_lid, 73, kLidAxes, {44, -1}},
    {"12.7", "left lower lid margin, inner", FaceRegion::left_lower_lid, 74, kLidAxes, {47, -1}},
    {"12.8", "left lower lid margin, outer", FaceRegion::left_lower_lid, 75, kLidAxes, {46, -1}},
    {"12.9", "right upper lid margin, inner", FaceRegion::right_upper_lid, 68, kLidAxes, {38, -1}},
    {"12.10", "right upper lid margin, outer", FaceRegion::right_upper_lid, 69, kLidAxes, {37, -1}},
    {"12.11", "right lower lid margin, inner", FaceRegion::right_lower_lid, 70, kLidAxes, {40, -1}},
    {"12.12", "right lower lid margin, outer", FaceRegion::right_lower_lid, 71, kLidAxes, {41, -1}},
    {"12.13", "nasion, root of the nose", FaceRegion::nose, 76, kNoseAxes, {27, -1}},
    {"12.14", "middle of the nose bridge", FaceRegion::nose, 77, kNoseAxes, {28, -1}},
    {"12.15", "outer lower lip, left of the middle", FaceRegion::lower_lip, 79, kMouthAxes, {56, -1}},
    {"12.16", "outer lower lip, right of the middle", FaceRegion::lower_lip, 78, kMouthAxes, {58, -1}},
    {"12.17", "left jaw line", FaceRegion::jaw, 81, kMouthAxes, {10, -1}},
    {"12.18", "right jaw line", FaceRegion::jaw, 80, kMouthAxes, {6, -1}},
    {"12.19", "left cheek above the jaw", FaceRegion::jaw, 83, kMouthAxes, {13, -1}},
    {"12.20", "right cheek above the jaw", FaceRegion::jaw, 82, kMouthAxes, {3, -1}},
}};
// clang-format on

constexpr std::array<std::string_view, kFaceRegionCount> kRegionNames = {
    "forehead", "left brow", "right brow", "left upper lid", "left lower lid", "right upper lid", "right lower lid",
    "nose", "left cheek", "right cheek", "upper lip", "lower lip", "chin", "jaw"};

}  // namespace

std::string_view regionName(FaceRegion region) { return kRegionNames.at(static_cast<std::size_t>(region)); }

std::span<const FeaturePoint, kFeaturePointCount> featurePoints() { return kFeaturePoints; }

std::optional<std::size_t> featurePointIndex(std::string_view id) {
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    if (kFeaturePoints[i].id == id) return i;
  return std::nullopt;
}

}  // namespace volto::rig
