// One-Euro filter for a pose: the rotation along its shortest way, the translation axis by axis. Internal to the
// tracker.
#pragma once

#include <array>

#include <Eigen/Core>

#include "tracker/one_euro.h"

namespace volto::tracker {

// Allocates nothing.
class HeadFilter {
 public:
  void reset();
  // In place. `translation_mm` in any frame. `smoothing` as OneEuro's.
  void push(double dt_s, double smoothing, Eigen::Matrix3d& rotation, Eigen::Vector3d& translation_mm);

 private:
  bool empty_ = true;
  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d speed_ = Eigen::Vector3d::Zero();  // radians per second, filtered
  std::array<OneEuro, 3> translation_;
};

}  // namespace volto::tracker
