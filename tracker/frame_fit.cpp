#include "tracker/frame_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace volto::tracker {
namespace {

constexpr double kNearestDepth = 20.0;  // mm: no camera is nearer to a point of a face
constexpr int kSmallestFace = 6;        // points

Eigen::Matrix<double, 3, 6> motionJacobian(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> q;
  q << 0, p.z(), -p.y(), 1, 0, 0,  //
      -p.z(), 0, p.x(), 0, 1, 0,   //
      p.y(), -p.x(), 0, 0, 0, 1;
  return q;
}

// Moves a pose by a small motion of the head in its own frame: rotation vector and translation.
void moveHead(const Eigen::Matrix<double, 6, 1>& step, ViewPose& pose) {
  pose.translation += pose.rotation * step.tail<3>();
  const double angle = step.head<3>().norm();
  if (angle > 1e-12) {
    pose.rotation = pose.rotation * Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix();
    pose.rotation = Eigen::Quaterniond(pose.rotation).normalized().toRotationMatrix();
  }
}

}  // namespace

FrameFit::FrameFit(const MeasuredPoints& points, const Settings& settings)
    : points_(points), variance_(settings.point_noise_mm * settings.point_noise_mm), outlier_mm_(settings.outlier_mm) {
  const int size = 3 * points.count();
  neutral_ = position_ = gradient_ = residual_ = Eigen::VectorXd::Zero(size);
}

void FrameFit::setFace(const Eigen::VectorXd& neutral, const ExpressionBasis& basis) {
  basis_ = &basis;
  neutral_ = neutral;
  for (auto& m : pose_gram_) m.setZero();
  for (auto& m : cross_gram_) m.setZero();
  constexpr std::array<std::array<int, 2>, 6> kPairs = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  for (int p = 0; p < points_.count(); ++p) {
    const Eigen::Matrix<double, 3, 6> q = motionJacobian(neutral_.segment<3>(3 * p));
    const double trust = points_.trust[p];
    for (std::size_t k = 0; k < kPairs.size(); ++k) {
      const auto [a, b] = kPairs[k];
      pose_gram_[k].noalias() += trust * q.row(a).transpose() * q.row(b);
      if (a != b) pose_gram_[k].noalias() += trust * q.row(b).transpose() * q.row(a);
    }
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        cross_gram_[static_cast<std::size_t>(3 * a + b)].noalias() +=
            (trust * q.row(a).transpose()) * basis_->matrix().row(3 * p + b);
  }
}

bool FrameFit::evaluate(const Observation& seen, const ViewPose& pose, const ShapeVector& weights) {
  position_ = neutral_;
  for (int k = 0; k < kShapes; ++k)
    if (weights[k] != 0) position_.noalias() += weights[k] * basis_->matrix().col(k);

  const double distance = std::max(-pose.translation.z(), kNearestDepth);
  double sum = 0, weight_sum = 0;
  view_.setZero();
  pose_gradient_.setZero();
  for (int p = 0; p < points_.count(); ++p) {
    const Eigen::Vector3d in_head = position_.segment<3>(3 * p);
    const Eigen::Vector3d in_view = pose.rotation * in_head + pose.translation;
    Eigen::Vector3d pull;  // A^T r
    double norm = 0;
    double cut = seen.weight[p];
    if (seen.has_depth) {
      const Eigen::Vector3d r = seen.point.col(p) - in_view;
      norm = r.norm();
      pull = pose.rotation.transpose() * r;
    } else {
      const double depth = -in_view.z();
      if (!(depth > kNearestDepth)) return false;
      const Eigen::Vector2d at = in_view.head<2>() / depth;
      const Eigen::Vector2d r = (seen.ray.col(p) - at) * distance;  // millimetres at the head's distance
      norm = r.norm();
      Eigen::Matrix<double, 2, 3> a;
      a << 1, 0, at.x(), 0, 1, at.y();
      a = (distance / depth) * a * pose.rotation;
      pull.noalias() = a.transpose() * r;
      view_.noalias() += points_.trust[p] * (a.transpose() * a);
    }
    residual_.segment<3>(3 * p) = seen.weight[p] > 0 ? pull : Eigen::Vector3d::Zero();
    sum += cut * norm * norm;
    weight_sum += cut;
    if (norm > outlier_mm_) cut *= outlier_mm_ / norm;
    pull *= cut * points_.trust[p];
    gradient_.segment<3>(3 * p) = pull;
    pose_gradient_.head<3>() += in_head.cross(pull);
    pose_gradient_.tail<3>() += pull;
  }
  view_ /= points_.trust.sum();
  if (seen.has_depth) view_.setIdentity();
  rms_mm_ = weight_sum > 0 ? std::sqrt(sum / weight_sum) : 0;
  return std::isfinite(sum);
}

void FrameFit::composeNormalMatrices() {
  const double s = 1 / variance_;
  const std::array<double, 6> m = {s * view_(0, 0), s * view_(1, 1), s * view_(2, 2), s * view_(0, 1), s * view_(0, 2), s * view_(1, 2)};
  pose_information_ = Matrix6::Identity() * 1e-9;
  for (std::size_t k = 0; k < 6; ++k) pose_information_ += m[k] * pose_gram_[k];
  const auto& gram = basis_->gram();
  information_ = m[0] * gram[0] + m[1] * gram[1] + m[2] * gram[2] + m[3] * gram[3] + m[4] * gram[4] + m[5] * gram[5];
  cross_.setZero();
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) cross_ += (s * view_(a, b)) * cross_gram_[static_cast<std::size_t>(3 * a + b)];
  pose_inverse_ = pose_information_.inverse();
  information_.noalias() -= cross_.transpose() * (pose_inverse_ * cross_);
}

bool FrameFit::improve(const Observation& seen, const WeightPrior& prior, int iterations, int sweeps, ViewPose& pose,
                       ShapeVector& weights) {
  ViewPose tried_pose = pose;
  ShapeVector tried = weights;
  if (!evaluate(seen, tried_pose, tried)) return false;
  composeNormalMatrices();
  posterior_ = information_ + prior.precision;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    pose_gradient_ /= variance_;
    const Pose6 free_pose = pose_inverse_ * pose_gradient_;
    ShapeVector slope = basis_->matrix().transpose() * gradient_;
    slope /= variance_;
    slope.noalias() -= cross_.transpose() * free_pose;
    slope.noalias() -= prior.precision * (tried - prior.mean);
    const ShapeVector before = tried;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      double largest = 0;
      for (int k = 0; k < kShapes; ++k) {
        const double moved = std::clamp(tried[k] + slope[k] / posterior_(k, k), prior.low, prior.high) - tried[k];
        if (moved == 0) continue;
        tried[k] += moved;
        slope.noalias() -= moved * posterior_.col(k);
        largest = std::max(largest, std::abs(moved));
      }
      if (largest < 1e-4) break;
    }
    const Pose6 step = free_pose - pose_inverse_ * (cross_ * (tried - before));
    moveHead(step, tried_pose);
    if (!evaluate(seen, tried_pose, tried)) return false;
  }
  if (!tried.allFinite() || !tried_pose.rotation.allFinite() || !tried_pose.translation.allFinite()) return false;
  pose = tried_pose;
  weights = tried;
  return true;
}

void FrameFit::exactPoseStep(const Observation& seen, ViewPose& pose) {
  Matrix6 normal = Matrix6::Zero();
  const double distance = std::max(-pose.translation.z(), kNearestDepth);
  for (int p = 0; p < points_.count(); ++p) {
    const Eigen::Vector3d in_head = neutral_.segment<3>(3 * p);
    const Eigen::Vector3d in_view = pose.rotation * in_head + pose.translation;
    const Eigen::Matrix<double, 3, 6> q = motionJacobian(in_head);
    if (seen.has_depth) {
      normal.noalias() += points_.trust[p] * seen.weight[p] * q.transpose() * q;
    } else {
      const double depth = std::max(-in_view.z(), kNearestDepth);
      Eigen::Matrix<double, 2, 3> a;
      a << 1, 0, in_view.x() / depth, 0, 1, in_view.y() / depth;
      const Eigen::Matrix<double, 2, 6> j = ((distance / depth) * a * pose.rotation) * q;
      normal.noalias() += points_.trust[p] * seen.weight[p] * j.transpose() * j;
    }
  }
  normal.diagonal() *= 1.001;
  normal.diagonal().array() += 1e-9;
  Pose6 step = normal.ldlt().solve(pose_gradient_);
  const double turn = step.head<3>().norm();
  if (turn > 0.5) step *= 0.5 / turn;  // a large first step of Gauss-Newton overshoots
  moveHead(step, pose);
}

bool FrameFit::initialisePose(const Observation& seen, ViewPose& pose) {
  // Similarity between the face at rest, seen from the front, and the image: in-plane rotation, distance, position.
  Eigen::Vector2d image_mean = Eigen::Vector2d::Zero(), model_mean = Eigen::Vector2d::Zero();
  double depth_mean = 0, total = 0;
  int count = 0;
  for (int p = 0; p < points_.count(); ++p) {
    const double w = seen.weight[p];
    if (w <= 0) continue;
    ++count;
    total += w;
    image_mean += w * (seen.has_depth ? Eigen::Vector2d(seen.point.col(p).head<2>()) : Eigen::Vector2d(seen.ray.col(p)));
    model_mean += w * neutral_.segment<2>(3 * p);
    if (seen.has_depth) depth_mean += w * (seen.point(2, p) - neutral_[3 * p + 2]);
  }
  if (count < kSmallestFace) return false;
  image_mean /= total;
  model_mean /= total;
  double along = 0, across = 0, model_spread = 0, image_spread = 0;
  for (int p = 0; p < points_.count(); ++p) {
    const double w = seen.weight[p];
    if (w <= 0) continue;
    const Eigen::Vector2d at = seen.has_depth ? Eigen::Vector2d(seen.point.col(p).head<2>()) : Eigen::Vector2d(seen.ray.col(p));
    const Eigen::Vector2d y = at - image_mean;
    const Eigen::Vector2d x = neutral_.segment<2>(3 * p) - model_mean;
    along += w * x.dot(y);
    across += w * (x.x() * y.y() - x.y() * y.x());
    model_spread += w * x.squaredNorm();
    image_spread += w * y.squaredNorm();
  }
  if (!(image_spread > 0) || !std::isfinite(image_spread) || !std::isfinite(along)) return false;
  const double roll = std::atan2(across, along);
  pose.rotation = Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  if (seen.has_depth) {
    pose.translation.z() = depth_mean / total;
    pose.translation.head<2>() = image_mean - (pose.rotation * Eigen::Vector3d(model_mean.x(), model_mean.y(), 0)).head<2>();
  } else {
    const double distance = std::sqrt(model_spread / image_spread);
    if (!(distance > 2 * kNearestDepth && distance < 1e6)) return false;
    pose.translation.z() = -distance;
    pose.translation.head<2>() =
        image_mean * distance - (pose.rotation * Eigen::Vector3d(model_mean.x(), model_mean.y(), 0)).head<2>();
  }
  const ShapeVector rest = ShapeVector::Zero();
  for (int iteration = 0; iteration < 15; ++iteration) {
    if (!evaluate(seen, pose, rest)) return false;
    exactPoseStep(seen, pose);
  }
  return evaluate(seen, pose, rest) && pose.translation.allFinite() && pose.rotation.allFinite();
}

}  // namespace volto::tracker
