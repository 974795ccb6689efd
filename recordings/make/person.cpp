#include "recordings/make/person.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/sha256.h"
#include "recordings/make/motion.h"
#include "rig/control_mask.h"
#include "rig/expression_table.h"
#include "rig/fapu.h"

namespace volto::recordings {
namespace {

using rig::FaceRegion;

constexpr Eigen::Index kPoints = static_cast<Eigen::Index>(kFeaturePointCount);

FaceRegion regionOf(Eigen::Index point) { return rig::featurePoints()[static_cast<std::size_t>(point)].region; }

bool isUpperLid(FaceRegion r) { return r == FaceRegion::left_upper_lid || r == FaceRegion::right_upper_lid; }
bool isLid(FaceRegion r) {
  return isUpperLid(r) || r == FaceRegion::left_lower_lid || r == FaceRegion::right_lower_lid;
}
bool isJaw(FaceRegion r) { return r == FaceRegion::jaw || r == FaceRegion::chin || r == FaceRegion::lower_lip; }

Eigen::RowVector3d eyeCentre(const rig::FeaturePointPositions& mask, bool left) {
  const auto corner = [&](const char* id) { return mask.row(static_cast<Eigen::Index>(*rig::featurePointIndex(id))); };
  return left ? 0.5 * (corner("3.7") + corner("3.11")) : 0.5 * (corner("3.8") + corner("3.12"));
}

// The reference mask with the proportions of somebody else: a broader jaw, a longer nose and chin, a wider mouth,
// narrower eyes, and not quite symmetric.
rig::FeaturePointPositions somebody() {
  rig::FeaturePointPositions mask = rig::referenceMask();
  const rig::FeaturePointPositions reference = mask;
  for (Eigen::Index p = 0; p < kPoints; ++p) {
    const FaceRegion region = regionOf(p);
    double x = reference(p, 0), y = reference(p, 1), z = reference(p, 2);
    if (isLid(region)) {
      const Eigen::RowVector3d eye = eyeCentre(reference, x > 0.0);
      y = eye.y() + 0.92 * (y - eye.y());
    } else if (region == FaceRegion::left_brow || region == FaceRegion::right_brow) {
      y += 1.8;
    } else if (y < 0.0) {
      y *= 1.05;
      if (isJaw(region)) y -= 0.05 * std::max(0.0, -y - 60.0);
    }
    if (region == FaceRegion::upper_lip || region == FaceRegion::lower_lip) x *= 1.05;
    if (region == FaceRegion::nose) z += 0.04 * std::max(0.0, z);
    x *= 1.03 + 0.05 * std::clamp((-y - 20.0) / 80.0, 0.0, 1.0);
    x += 0.010 * y;  // the chin a little to one side
    if (region == FaceRegion::left_brow) y += 0.8;
    mask.row(p) << x, y, z;
  }
  return mask;
}

// A point that turns about `centre` does not move along the straight line `move` but along an arc: how far, and which
// way, it is off the line at `weight`.
Eigen::RowVector3d arc(const Eigen::RowVector3d& at, const Eigen::RowVector3d& move, double weight,
                       const Eigen::RowVector3d& centre) {
  const Eigen::RowVector3d arm = at + 0.5 * move - centre;
  const double radius = arm.norm();
  return 4.0 * weight * (1.0 - weight) * move.squaredNorm() / (8.0 * radius * radius) * arm;
}

// The feature point that is at each landmark, -1 where there is none.
std::array<int, kLandmarks> pointOfLandmark() {
  std::array<int, kLandmarks> out;
  out.fill(-1);
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const auto& at = rig::featurePoints()[p].ibug68;
    if (at[0] >= 0 && at[1] < 0) out[static_cast<std::size_t>(at[0])] = static_cast<int>(p);
  }
  return out;
}

}  // namespace

Person::Person() : neutral_(somebody()) {
  const rig::FeaturePointPositions scale = rig::fapuScale(rig::measureFapu(neutral_).fapu);
  const rig::ExpressionTable& table = rig::ExpressionTable::standard();
  Random random(77);
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const double habit = random.between(0.86, 1.12);  // this person's own measure of the expression
    for (Eigen::Index p = 0; p < kPoints; ++p) {
      const double own = habit * (1.0 + 0.05 * random.normal());
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        moves_[k](p, axis) = own * scale(p, axis) * table.basis()(3 * p + axis, static_cast<Eigen::Index>(k));
      }
    }
  }
}

Person::Landmarks Person::landmarks(const ArkitWeights& weights) const {
  static const std::array<int, kLandmarks> point_of = pointOfLandmark();
  static const std::size_t jaw_open = *arkitBlendshapeIndex("jawOpen");
  static const std::array<std::size_t, 2> blink{*arkitBlendshapeIndex("eyeBlinkLeft"),
                                                *arkitBlendshapeIndex("eyeBlinkRight")};
  // The jaw hangs a little before and below the ear, the eyeball's centre behind the lids.
  const Eigen::RowVector3d left_ear = neutral_.row(static_cast<Eigen::Index>(*rig::featurePointIndex("10.7")));
  const Eigen::RowVector3d condyle(0.0, left_ear.y() + 15.0, left_ear.z());

  rig::FeaturePointPositions mask = neutral_;
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    if (weights[k] != 0.0F) mask += static_cast<double>(weights[k]) * moves_[k];
  }
  for (Eigen::Index p = 0; p < kPoints; ++p) {
    const FaceRegion region = regionOf(p);
    const Eigen::RowVector3d at = neutral_.row(p);
    if (isJaw(region)) {
      const double w = static_cast<double>(weights[jaw_open]);
      mask.row(p) += arc(at, moves_[jaw_open].row(p), w, Eigen::RowVector3d(at.x(), condyle.y(), condyle.z()));
    } else if (isUpperLid(region)) {
      const bool left = at.x() > 0.0;
      const Eigen::RowVector3d ball = eyeCentre(neutral_, left) - Eigen::RowVector3d(0.0, 0.0, 12.0);
      const std::size_t k = blink[left ? 0 : 1];
      mask.row(p) +=
          arc(at, moves_[k].row(p), static_cast<double>(weights[k]), Eigen::RowVector3d(at.x(), ball.y(), ball.z()));
    }
  }

  Landmarks out;
  for (std::size_t i = 0; i < kLandmarks; ++i) {
    if (point_of[i] >= 0) out[i] = mask.row(point_of[i]).transpose();
  }
  // Landmarks that are no feature point lie on the jaw line between others: a cubic through the four nearest.
  for (std::size_t i = 2; i < 15; ++i) {
    if (point_of[i] < 0) out[i] = (9.0 * (out[i - 1] + out[i + 1]) - (out[i - 2] + out[i + 2])) / 16.0;
  }
  return out;
}

std::string Person::digest() const {
  std::string text;
  const auto add = [&text](const rig::FeaturePointPositions& points) {
    for (Eigen::Index p = 0; p < kPoints; ++p) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) text += std::to_string(std::llround(1e6 * points(p, axis))) + ' ';
    }
  };
  add(neutral_);
  for (const rig::FeaturePointPositions& move : moves_) add(move);
  return capture::sha256Hex(text);
}

}  // namespace volto::recordings
