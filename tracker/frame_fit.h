// One frame: head pose and bounded expression weights that explain the measured points best, given the face at rest.
// Internal to the tracker.
//
// Gauss-Newton on pose and weights together. The pose is eliminated (Schur complement), the weights are found by coordinate descent
// within their bounds (warm start), and the normal matrix is composed of six Gram matrices made once per face: under a view M = A^T A
// that is nearly the same for all points, sum_i B_i^T M B_i is linear in M. Residuals and gradients are exact for every point, so the
// approximation costs convergence speed only. Outliers and missing points have their residual cut (Huber and Dutter's modified
// residuals), which leaves the matrix alone.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tracker/face_model.h"

namespace volto::tracker {

// Where the head is: p_view = rotation * p_head + translation, in a camera frame turned to x right, y up, z towards the camera; the head
// is at negative z.
struct ViewPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation{0, 0, -600};
};

// The measured points of one frame.
struct Observation {
  bool has_depth = false;
  Eigen::Matrix2Xd ray;     // 2D: x / depth, y / depth of each point, y up; (pixel - centre) / focal length
  Eigen::Matrix3Xd point;   // 3D: millimetres in the view frame at the model's scale
  Eigen::VectorXd weight;   // 0: missing; else 1, or a detector's own doubt
};

// A Gaussian over weights, as its precision matrix, and the bounds.
struct WeightPrior {
  ShapeMatrix precision = ShapeMatrix::Identity();
  ShapeVector mean = ShapeVector::Zero();
  double low = 0, high = 1;
};

class FrameFit {
 public:
  FrameFit(const MeasuredPoints& points, const Settings& settings);

  const MeasuredPoints& points() const { return points_; }

  // The face at rest (3P) and its expressions. `basis` must outlive this object; call again when it changed.
  void setFace(const Eigen::VectorXd& neutral, const ExpressionBasis& basis);

  // A small change of the face at rest: the view's normal matrices stay as they are, which costs convergence speed only.
  void moveFace(const Eigen::VectorXd& neutral) { neutral_ = neutral; }

  // A pose from nothing: similarity in the image, then Gauss-Newton on the face at rest. False when the points make no face.
  bool initialisePose(const Observation& seen, ViewPose& pose);

  // Improves pose and weights. False when the result is not a head in front of the camera; pose and weights are then unchanged.
  bool improve(const Observation& seen, const WeightPrior& prior, int iterations, int sweeps, ViewPose& pose, ShapeVector& weights);

  // Of the last improve() or evaluate(): each point's residual in the head frame (3P, what the model lacks to reach the measured
  // point, along the directions that the view shows), and the root mean square over points seen, in millimetres at the model's scale.
  const Eigen::VectorXd& residual() const { return residual_; }
  double rms_mm() const { return rms_mm_; }
  // 3P: the same, cut and weighted, times trust: the slope of the fit in each point's position, for unit variance.
  const Eigen::VectorXd& gradient() const { return gradient_; }
  // Of the last call: information matrix of the weights, pose eliminated, and of each point's position (3 by 3 blocks, per trust).
  const ShapeMatrix& information() const { return information_; }
  Eigen::Matrix3d pointInformation() const { return view_ / variance_; }

  // Residuals for a pose and weights, nothing improved. False as above.
  bool evaluate(const Observation& seen, const ViewPose& pose, const ShapeVector& weights);

 private:
  using Pose6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  void composeNormalMatrices();
  void exactPoseStep(const Observation& seen, ViewPose& pose);

  MeasuredPoints points_;
  double variance_, outlier_mm_;
  const ExpressionBasis* basis_ = nullptr;
  Eigen::VectorXd neutral_;   // 3P
  Eigen::VectorXd position_;  // 3P
  Eigen::VectorXd gradient_;  // 3P: trust * A^T r, r cut
  Eigen::VectorXd residual_;
  // Sum over points of Q_i^T e_a e_b^T Q_i and Q_i^T e_a e_b^T B_i with Q_i = (-[p_i]x, 1), for the six axis pairs / nine.
  std::array<Matrix6, 6> pose_gram_;
  std::array<Eigen::Matrix<double, 6, kShapes>, 9> cross_gram_;
  Eigen::Matrix3d view_ = Eigen::Matrix3d::Identity();  // mean of A^T A over points, unit variance
  Matrix6 pose_information_, pose_inverse_;
  Eigen::Matrix<double, 6, kShapes> cross_;
  ShapeMatrix information_, posterior_;
  Pose6 pose_gradient_;
  double rms_mm_ = 0;
};

}  // namespace volto::tracker
