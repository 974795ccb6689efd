#include "tracker/frame_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace volto::tracker {
namespace {

constexpr double kNearestDepth = 20.0;  // mm: no camera is nearer to a point of a face
constexpr double kMostCounted = 3.0;    // one point far astray says no more about the fit than this many outlier limits
constexpr int kSmallestFace = 6;        // points
constexpr double kRunsAway = 1.1;       // a step that makes the fit worse by more than this is none; a little worse it
                                        // may become, since residuals are counted at the head's distance, which moves

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

// For small angles, radians.
double turnBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) { return (a - b).norm() / std::numbers::sqrt2; }

}  // namespace

FrameFit::FrameFit(const MeasuredPoints& points, const Settings& settings)
    : points_(points),
      variance_(settings.point_noise_mm * settings.point_noise_mm),
      outlier_mm_(settings.outlier_mm),
      linear_within_rad_(settings.linear_within_rad) {
  const int size = points.count();
  neutral_ = position_ = gradient_ = residual_ = Eigen::VectorXd::Zero(3 * size);
  for (auto& v : moved_) v.setZero(size);
  for (auto& v : pull_) v.setZero(size);
  for (auto& row : view_)
    for (auto& v : row) v.setZero(size);
  jacobian_.setZero(3 * size, 6 + kShapes);
  gram_.setZero(6 + kShapes, 6 + kShapes);
}

void FrameFit::setFace(const Eigen::VectorXd& neutral, const ExpressionBasis& basis) {
  basis_ = &basis;
  neutral_ = neutral;
}

bool FrameFit::evaluate(const Observation& seen, const ViewPose& pose, const ShapeVector& weights) {
  const Eigen::Matrix<float, kShapes, 1> w = weights.cast<float>();
  for (std::size_t c = 0; c < 3; ++c) moved_[c].noalias() = basis_->axes()[c] * w;

  const double distance = std::max(-pose.translation.z(), kNearestDepth);
  double sum = 0, weight_sum = 0, cost = 0;
  pose_gradient_.setZero();
  view_rows_ = seen.has_depth ? 3 : 2;
  for (int p = 0; p < points_.count(); ++p) {
    const Eigen::Vector3d in_head =
        neutral_.segment<3>(3 * p) + Eigen::Vector3d(moved_[0][p], moved_[1][p], moved_[2][p]);
    position_.segment<3>(3 * p) = in_head;
    const Eigen::Vector3d in_view = pose.rotation * in_head + pose.translation;
    Eigen::Vector3d pull;  // A^T r
    double norm = 0;
    double cut = seen.weight[p];
    Eigen::Matrix3d a = pose.rotation;
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
      const double enlarged = distance / depth;
      a.row(0) = enlarged * (pose.rotation.row(0) + at.x() * pose.rotation.row(2));
      a.row(1) = enlarged * (pose.rotation.row(1) + at.y() * pose.rotation.row(2));
      pull.noalias() = a.topRows<2>().transpose() * r;
    }
    for (std::size_t row = 0; row < static_cast<std::size_t>(view_rows_); ++row)
      for (std::size_t c = 0; c < 3; ++c)
        view_[row][c][p] = static_cast<float>(a(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c)));
    residual_.segment<3>(3 * p) = seen.weight[p] > 0 ? pull : Eigen::Vector3d::Zero();
    const double counted = std::min(norm, kMostCounted * outlier_mm_);
    sum += cut * counted * counted;
    weight_sum += cut;
    cost +=
        cut * points_.trust[p] * (norm > outlier_mm_ ? outlier_mm_ * (norm - 0.5 * outlier_mm_) : 0.5 * norm * norm);
    if (norm > outlier_mm_) cut *= outlier_mm_ / norm;
    pull *= cut * points_.trust[p];
    gradient_.segment<3>(3 * p) = pull;
    for (std::size_t c = 0; c < 3; ++c) pull_[c][p] = static_cast<float>(pull[static_cast<Eigen::Index>(c)]);
    pose_gradient_.head<3>() += in_head.cross(pull);
    pose_gradient_.tail<3>() += pull;
  }
  rms_mm_ = weight_sum > 0 ? std::sqrt(sum / weight_sum) : 0;
  cost_ = cost / variance_;
  return std::isfinite(sum) && pose_gradient_.allFinite();
}

void FrameFit::composeNormalMatrices(const Observation& seen) {
  const int size = points_.count();
  for (int row = 0; row < view_rows_; ++row) {
    auto& a = view_[static_cast<std::size_t>(row)];
    // A (-[x]x, 1): the row a of A gives x cross a for rotation, a for translation.
    for (int p = 0; p < size; ++p) {
      const auto root = static_cast<float>(std::sqrt(points_.trust[p] * seen.weight[p] / variance_));
      const Eigen::Vector3f x = position_.segment<3>(3 * p).cast<float>();
      const Eigen::Vector3f direction(root * a[0][p], root * a[1][p], root * a[2][p]);
      jacobian_.block<1, 3>(row * size + p, 0) = x.cross(direction).transpose();
      jacobian_.block<1, 3>(row * size + p, 3) = direction.transpose();
      for (int c = 0; c < 3; ++c) a[static_cast<std::size_t>(c)][p] = direction[c];
    }
    for (int k = 0; k < kShapes; ++k)
      jacobian_.col(6 + k).segment(row * size, size).array() = a[0].array() * basis_->axes()[0].col(k).array() +
                                                               a[1].array() * basis_->axes()[1].col(k).array() +
                                                               a[2].array() * basis_->axes()[2].col(k).array();
  }
  gram_.setZero();
  gram_.selfadjointView<Eigen::Lower>().rankUpdate(jacobian_.topRows(view_rows_ * size).transpose());
  Matrix6 pose_information = gram_.topLeftCorner<6, 6>().selfadjointView<Eigen::Lower>().toDenseMatrix().cast<double>();
  pose_information.diagonal().array() += 1e-9;
  normal_.pose_inverse = pose_information.inverse();
  normal_.cross = gram_.bottomLeftCorner<kShapes, 6>().transpose().cast<double>();
  normal_.information =
      gram_.bottomRightCorner<kShapes, kShapes>().selfadjointView<Eigen::Lower>().toDenseMatrix().cast<double>();
  normal_.information.noalias() -= normal_.cross.transpose() * (normal_.pose_inverse * normal_.cross);
}

void FrameFit::addPointInformation(const Observation& seen, Eigen::Matrix<double, 3, Eigen::Dynamic>& blocks) const {
  for (int p = 0; p < points_.count(); ++p) {
    const double weight = points_.trust[p] * seen.weight[p];
    for (std::size_t row = 0; row < static_cast<std::size_t>(view_rows_); ++row) {
      const Eigen::Vector3d a(view_[row][0][p], view_[row][1][p], view_[row][2][p]);
      blocks.block<3, 3>(0, 3 * p).noalias() += weight * a * a.transpose();
    }
  }
}

bool FrameFit::improve(const Observation& seen, const WeightPrior& prior, int iterations, int sweeps, ViewPose& pose,
                       ShapeVector& weights, const NormalMatrices* kept) {
  ViewPose tried_pose = pose;
  ShapeVector tried = weights;
  if (!evaluate(seen, tried_pose, tried)) return false;
  const NormalMatrices& normal = kept != nullptr ? *kept : normal_;
  Eigen::Matrix3d linearised_at = pose.rotation;
  const auto linearise = [&] {
    linearised_at = tried_pose.rotation;
    composeNormalMatrices(seen);
    posterior_ = normal_.information + prior.tightness * prior.precision;
  };
  if (kept == nullptr) {
    linearise();
  } else {
    posterior_ = kept->information + prior.tightness * prior.precision;
  }
  ShapeVector prior_pull;  // the prior's slope at the weights that were asked for last
  const auto costOf = [&](const ShapeVector& w) {
    const ShapeVector off = w - prior.mean;
    prior_pull.noalias() = prior.precision * off;
    prior_pull *= prior.tightness;
    return cost_ + 0.5 * off.dot(prior_pull);
  };
  double cost = costOf(tried);
  bool linearised_here = true;  // at the pose and weights that the next step starts from
  for (int iteration = 0; iteration < iterations; ++iteration) {
    pose_gradient_ /= variance_;
    const Pose6 free_pose = normal.pose_inverse * pose_gradient_;
    Eigen::Matrix<float, kShapes, 1> pull = basis_->axes()[0].transpose() * pull_[0];
    pull.noalias() += basis_->axes()[1].transpose() * pull_[1];
    pull.noalias() += basis_->axes()[2].transpose() * pull_[2];
    ShapeVector slope = pull.cast<double>() / variance_;
    slope.noalias() -= normal.cross.transpose() * free_pose;
    slope -= prior_pull;
    const ShapeVector before = tried;
    const ViewPose pose_before = tried_pose;
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
    const Pose6 step = free_pose - normal.pose_inverse * (normal.cross * (tried - before));
    moveHead(step, tried_pose);
    const bool possible = evaluate(seen, tried_pose, tried);
    const double now = possible ? costOf(tried) : std::numeric_limits<double>::infinity();
    if (kept != nullptr) {
      if (!possible) return false;
      continue;
    }
    if (now <= kRunsAway * cost) {
      cost = std::min(cost, now);
      linearised_here =
          iteration + 1 < iterations && turnBetween(linearised_at, tried_pose.rotation) > linear_within_rad_;
      if (linearised_here) linearise();
      continue;
    }
    // Steps along an old linearisation may run away (a face far from rest, a pose from nothing): back, and anew.
    tried = before;
    tried_pose = pose_before;
    if (!evaluate(seen, tried_pose, tried)) return false;
    if (linearised_here) break;
    linearise();
    costOf(tried);
    linearised_here = true;
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
    image_mean +=
        w * (seen.has_depth ? Eigen::Vector2d(seen.point.col(p).head<2>()) : Eigen::Vector2d(seen.ray.col(p)));
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
    const Eigen::Vector2d at =
        seen.has_depth ? Eigen::Vector2d(seen.point.col(p).head<2>()) : Eigen::Vector2d(seen.ray.col(p));
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
    pose.translation.head<2>() =
        image_mean - (pose.rotation * Eigen::Vector3d(model_mean.x(), model_mean.y(), 0)).head<2>();
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
