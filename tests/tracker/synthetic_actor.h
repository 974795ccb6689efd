// An actor with known truth: a face with proportions of its own, expressions from the table, a camera, and noise. Made
// apart from the tracker's model of a face: another neutral, another focal length, and its own projection.
#pragma once

#include <random>
#include <vector>

#include <Eigen/Core>

#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"
#include "rig/feature_points.h"

namespace volto::test {

struct HeadMotion {
  double yaw_deg = 0, pitch_deg = 0, roll_deg = 0;
  Eigen::Vector3d at_mm{0, 0, 650};  // camera frame
};

class SyntheticActor {
 public:
  explicit SyntheticActor(unsigned seed = 1, double noise_px = 0.3);

  // 640 x 480 pixels, iBUG 68; 3D points too when asked for.
  LandmarkFrame frame(double time_s, const ArkitWeights& weights, const HeadMotion& head = {}, bool with_3d = false);
  // The same moment as OpenSeeFace's 66 points.
  LandmarkFrame frame66(double time_s, const ArkitWeights& weights, const HeadMotion& head = {});

  const rig::FeaturePointPositions& neutral_mm() const { return neutral_mm_; }

 private:
  rig::FeaturePointPositions neutral_mm_, scale_mm_;
  double noise_px_;
  std::mt19937 random_;
};

// Weights with these shapes, all others 0.
ArkitWeights expression(std::initializer_list<std::pair<const char*, float>> shapes);
float weightOf(const MaskFrame& mask, const char* shape);

// Lively talk with blinks, brows and a smile, at rest now and then; the same for the same time.
ArkitWeights livelyTalk(double time_s);
HeadMotion livelyHead(double time_s);

bool allFinite(const MaskFrame& mask);

}  // namespace volto::test
