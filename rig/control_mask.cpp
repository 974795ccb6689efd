#include "rig/control_mask.h"

#include <stdexcept>
#include <string>

namespace volto::rig {
namespace {

struct LabelledTriangle {
  MaskTriangle points;
  FaceRegion region;
};

// The left half; the right half is its mirror image, so symmetry is by construction. No triangle crosses the midline.
// clang-format off
constexpr std::array<LabelledTriangle, kMaskTriangleCount / 2> kLeftHalf = {{
    // forehead
    {{61, 76, 26}, FaceRegion::forehead},  // 11.1 12.13 4.1
    {{61, 26, 64}, FaceRegion::forehead},  // 11.1 4.1 12.1
    {{61, 64, 63}, FaceRegion::forehead},  // 11.1 12.1 11.3
    {{63, 64, 28}, FaceRegion::forehead},  // 11.3 12.1 4.3
    {{63, 28, 65}, FaceRegion::forehead},  // 11.3 4.3 12.2
    {{63, 65, 30}, FaceRegion::forehead},  // 11.3 12.2 4.5
    {{63, 30, 59}, FaceRegion::forehead},  // 11.3 4.5 10.9
    // left upper lid
    {{26, 22, 68}, FaceRegion::left_upper_lid},  // 4.1 3.11 12.5
    {{26, 68, 24}, FaceRegion::left_upper_lid},  // 4.1 12.5 3.13
    {{26, 24, 64}, FaceRegion::left_upper_lid},  // 4.1 3.13 12.1
    {{64, 24, 28}, FaceRegion::left_upper_lid},  // 12.1 3.13 4.3
    {{28, 24, 65}, FaceRegion::left_upper_lid},  // 4.3 3.13 12.2
    {{24, 68, 14}, FaceRegion::left_upper_lid},  // 3.13 12.5 3.1
    {{24, 14, 69}, FaceRegion::left_upper_lid},  // 3.13 3.1 12.6
    {{24, 69, 65}, FaceRegion::left_upper_lid},  // 3.13 12.6 12.2
    {{65, 69, 30}, FaceRegion::left_upper_lid},  // 12.2 12.6 4.5
    {{30, 69, 18}, FaceRegion::left_upper_lid},  // 4.5 12.6 3.7
    // left lower lid
    {{22, 20, 70}, FaceRegion::left_lower_lid},  // 3.11 3.9 12.7
    {{70, 20, 16}, FaceRegion::left_lower_lid},  // 12.7 3.9 3.3
    {{16, 20, 71}, FaceRegion::left_lower_lid},  // 3.3 3.9 12.8
    {{71, 20, 18}, FaceRegion::left_lower_lid},  // 12.8 3.9 3.7
    {{18, 20, 34}, FaceRegion::left_lower_lid},  // 3.7 3.9 5.3
    {{20, 32, 34}, FaceRegion::left_lower_lid},  // 3.9 5.1 5.3
    {{22, 54, 20}, FaceRegion::left_lower_lid},  // 3.11 9.13 3.9
    {{54, 32, 20}, FaceRegion::left_lower_lid},  // 9.13 5.1 3.9
    // left cheek
    {{30, 18, 34}, FaceRegion::left_cheek},  // 4.5 3.7 5.3
    {{30, 34, 59}, FaceRegion::left_cheek},  // 4.5 5.3 10.9
    {{59, 34, 57}, FaceRegion::left_cheek},  // 10.9 5.3 10.7
    {{54, 46, 32}, FaceRegion::left_cheek},  // 9.13 9.1 5.1
    {{46, 38, 32}, FaceRegion::left_cheek},  // 9.1 8.3 5.1
    {{38, 82, 32}, FaceRegion::left_cheek},  // 8.3 12.19 5.1
    {{32, 82, 34}, FaceRegion::left_cheek},  // 5.1 12.19 5.3
    {{34, 82, 57}, FaceRegion::left_cheek},  // 5.3 12.19 10.7
    // nose
    {{26, 76, 52}, FaceRegion::nose},  // 4.1 12.13 9.7
    {{26, 52, 22}, FaceRegion::nose},  // 4.1 9.7 3.11
    {{76, 77, 52}, FaceRegion::nose},  // 12.13 12.14 9.7
    {{77, 53, 54}, FaceRegion::nose},  // 12.14 9.12 9.13
    {{77, 54, 52}, FaceRegion::nose},  // 12.14 9.13 9.7
    {{52, 54, 22}, FaceRegion::nose},  // 9.7 9.13 3.11
    {{53, 48, 54}, FaceRegion::nose},  // 9.12 9.3 9.13
    {{54, 48, 46}, FaceRegion::nose},  // 9.13 9.3 9.1
    {{48, 56, 50}, FaceRegion::nose},  // 9.3 9.15 9.5
    {{48, 50, 46}, FaceRegion::nose},  // 9.3 9.5 9.1
    // upper lip
    {{56, 36, 45}, FaceRegion::upper_lip},  // 9.15 8.1 8.10
    {{56, 45, 50}, FaceRegion::upper_lip},  // 9.15 8.10 9.5
    {{50, 45, 40}, FaceRegion::upper_lip},  // 9.5 8.10 8.5
    {{50, 40, 46}, FaceRegion::upper_lip},  // 9.5 8.5 9.1
    {{46, 40, 38}, FaceRegion::upper_lip},  // 9.1 8.5 8.3
    {{36, 1, 45}, FaceRegion::upper_lip},  // 8.1 2.2 8.10
    {{45, 1, 5}, FaceRegion::upper_lip},  // 8.10 2.2 2.6
    {{45, 5, 40}, FaceRegion::upper_lip},  // 8.10 2.6 8.5
    {{40, 5, 3}, FaceRegion::upper_lip},  // 8.5 2.6 2.4
    {{40, 3, 38}, FaceRegion::upper_lip},  // 8.5 2.4 8.3
    // lower lip
    {{37, 78, 2}, FaceRegion::lower_lip},  // 8.2 12.15 2.3
    {{78, 7, 2}, FaceRegion::lower_lip},  // 12.15 2.8 2.3
    {{78, 42, 7}, FaceRegion::lower_lip},  // 12.15 8.7 2.8
    {{42, 3, 7}, FaceRegion::lower_lip},  // 8.7 2.4 2.8
    {{42, 38, 3}, FaceRegion::lower_lip},  // 8.7 8.3 2.4
    {{37, 9, 78}, FaceRegion::lower_lip},  // 8.2 2.10 12.15
    {{78, 10, 42}, FaceRegion::lower_lip},  // 12.15 2.11 8.7
    // chin
    {{78, 9, 10}, FaceRegion::chin},  // 12.15 2.10 2.11
    {{9, 0, 10}, FaceRegion::chin},  // 2.10 2.1 2.11
    {{10, 0, 80}, FaceRegion::chin},  // 2.11 2.1 12.17
    {{42, 10, 80}, FaceRegion::chin},  // 8.7 2.11 12.17
    // jaw
    {{42, 80, 38}, FaceRegion::jaw},  // 8.7 12.17 8.3
    {{38, 80, 12}, FaceRegion::jaw},  // 8.3 12.17 2.13
    {{38, 12, 82}, FaceRegion::jaw},  // 8.3 2.13 12.19
    {{82, 12, 57}, FaceRegion::jaw},  // 12.19 2.13 10.7
}};

struct HalfPoint {
  std::string_view id;
  double x_mm, y_mm, z_mm;
};

// Left half and midline of a neutral adult face, drawn by hand to the averages of craniofacial anthropometry (Farkas 1994, adults, women and
// men together): inner canthi 33 mm, outer canthi 90, face width at the ears 140, nose length 49, nose width 30, nose base to
// mouth 21, mouth width 52, mouth to chin 44, hair line to nasion 68, lid opening 11. Origin: middle of the four eye corners, about.
constexpr std::array<HalfPoint, 48> kReferenceHalf = {{
    {"2.1", 0, -111, 14},
    {"2.2", 0, -67, 23},
    {"2.3", 0, -68, 22},
    {"2.4", 23, -68, 10},
    {"2.6", 9, -67, 21},
    {"2.8", 9, -68, 20},
    {"2.10", 0, -96, 18},
    {"2.11", 16, -108, 11},
    {"2.13", 57, -80, -32},
    {"3.1", 31, 6, 5},
    {"3.3", 31, -5, 3},
    {"3.7", 45, 1, -5},
    {"3.9", 32, -15, 3},
    {"3.11", 17, -1, 3},
    {"3.13", 32, 12, 6},
    {"4.1", 12, 25, 16},
    {"4.3", 37, 29, 7},
    {"4.5", 56, 17, -12},
    {"5.1", 38, -36, 4},
    {"5.3", 46, -14, -2},
    {"8.1", 0, -60, 26},
    {"8.2", 0, -78, 21},
    {"8.3", 26, -68, 10},
    {"8.5", 17, -62, 19},
    {"8.7", 19, -73, 15},
    {"8.10", 7, -58, 25},
    {"9.1", 14, -45, 17},
    {"9.3", 0, -33, 39},
    {"9.5", 7, -46, 22},
    {"9.7", 8, 1, 9},
    {"9.12", 0, -21, 32},
    {"9.13", 7, -28, 22},
    {"9.15", 0, -46, 24},
    {"10.7", 71, -18, -52},
    {"10.9", 71, 2, -58},
    {"11.1", 0, 71, 5},
    {"11.3", 42, 61, -5},
    {"12.1", 24, 29, 14},
    {"12.2", 48, 25, -2},
    {"12.5", 25, 5, 5},
    {"12.6", 38, 5, 3},
    {"12.7", 25, -4, 4},
    {"12.8", 38, -4, 1},
    {"12.13", 0, 3, 17},
    {"12.14", 0, -10, 25},
    {"12.15", 10, -77, 19},
    {"12.17", 31, -104, -4},
    {"12.19", 63, -55, -33},
}};
// clang-format on

FaceRegion mirrored(FaceRegion region) {
  switch (region) {
    case FaceRegion::left_brow:
      return FaceRegion::right_brow;
    case FaceRegion::left_upper_lid:
      return FaceRegion::right_upper_lid;
    case FaceRegion::left_lower_lid:
      return FaceRegion::right_lower_lid;
    case FaceRegion::left_cheek:
      return FaceRegion::right_cheek;
    default:
      return region;
  }
}

std::uint8_t mirrorPoint(std::uint8_t point) { return featurePoints()[point].mirror; }

std::array<MaskTriangle, kMaskTriangleCount> bothHalves() {
  std::array<MaskTriangle, kMaskTriangleCount> triangles{};
  for (std::size_t i = 0; i < kLeftHalf.size(); ++i) {
    const MaskTriangle& t = kLeftHalf[i].points;
    triangles[i] = t;
    triangles[kLeftHalf.size() + i] = {mirrorPoint(t[0]), mirrorPoint(t[2]), mirrorPoint(t[1])};
  }
  return triangles;
}

}  // namespace

std::span<const MaskTriangle, kMaskTriangleCount> maskTriangles() {
  static const std::array<MaskTriangle, kMaskTriangleCount> triangles = bothHalves();
  return triangles;
}

FaceRegion maskTriangleRegion(std::size_t triangle) {
  if (triangle >= kMaskTriangleCount) throw std::out_of_range("mask triangle " + std::to_string(triangle) + " of 136");
  const std::size_t half = kLeftHalf.size();
  return triangle < half ? kLeftHalf[triangle].region : mirrored(kLeftHalf[triangle - half].region);
}

const MaskLoops& maskLoops() {
  static constexpr MaskLoops loops{.outline = {61, 63, 59, 57, 12, 80, 0, 81, 13, 58, 60, 62},
                                   .left_eye = {22, 68, 14, 69, 18, 71, 16, 70},
                                   .right_eye = {19, 72, 15, 73, 23, 75, 17, 74},
                                   .mouth = {1, 5, 3, 7, 2, 8, 4, 6}};
  return loops;
}

const FeaturePointPositions& referenceMask() {
  static const FeaturePointPositions mask = [] {
    FeaturePointPositions positions = FeaturePointPositions::Zero();
    for (const HalfPoint& p : kReferenceHalf) {
      const std::size_t i = featurePointIndex(p.id).value();
      positions.row(static_cast<Eigen::Index>(i)) << p.x_mm, p.y_mm, p.z_mm;
      const std::size_t m = featurePoints()[i].mirror;
      if (m != i) positions.row(static_cast<Eigen::Index>(m)) << -p.x_mm, p.y_mm, p.z_mm;
    }
    return positions;
  }();
  return mask;
}

}  // namespace volto::rig
