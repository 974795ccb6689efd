#include "tracker/head_filter.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace volto::tracker {
namespace {

constexpr OneEuroConstants kTurn{1.5, 8.0};  // radians: a head that turns 60 degrees in half a second is not held back
constexpr OneEuroConstants kSideways{1.5, 0.08};  // millimetres
constexpr OneEuroConstants kDistance{0.8, 0.02};  // seen by the face's size alone, so the noisiest

double share(double cutoff_hz, double dt_s) {
  const double r = 2 * std::numbers::pi * cutoff_hz * dt_s;
  return r / (r + 1);
}

}  // namespace

void HeadFilter::reset() {
  empty_ = true;
  for (OneEuro& filter : translation_) filter.reset();
}

void HeadFilter::push(double dt_s, double smoothing, Eigen::Matrix3d& rotation, Eigen::Vector3d& translation_mm) {
  if (smoothing <= 0) return;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    translation_mm[axis] = translation_[static_cast<std::size_t>(axis)].push(
        translation_mm[axis], dt_s, axis == 2 ? kDistance : kSideways, smoothing);
  }
  if (empty_) {
    empty_ = false;
    rotation_ = rotation;
    speed_.setZero();
    return;
  }
  const Eigen::AngleAxisd way(rotation_.transpose() * rotation);
  const Eigen::Vector3d turn = way.angle() * way.axis();
  speed_ += share(kTurn.speed_cutoff_hz, dt_s) * (turn / dt_s - speed_);
  const double cutoff_hz = kTurn.min_cutoff_hz / smoothing + kTurn.beta / std::sqrt(smoothing) * speed_.norm();
  rotation_ = Eigen::Quaterniond(rotation_ *
                                 Eigen::AngleAxisd(share(cutoff_hz, dt_s) * way.angle(), way.axis()).toRotationMatrix())
                  .normalized()
                  .toRotationMatrix();
  rotation = rotation_;
}

}  // namespace volto::tracker
