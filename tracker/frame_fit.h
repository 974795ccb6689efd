// One frame: head pose and bounded expression weights that explain the measured points best, given the face at rest.
// Internal to the tracker.
//
// Gauss-Newton on pose and weights together: the pose is eliminated (Schur complement), the weights are found by
// coordinate descent within their bounds (warm start). The normal matrix is made once per frame and again where the
// head has turned since (Settings::linear_within_rad), residuals and gradients in every iteration; a step that makes
// the fit worse is taken back, and the matrix made anew. Outliers have their residual cut (the modified residuals of
// Huber and Dutter), which leaves the matrix alone.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "tracker/face_model.h"

namespace volto::tracker {

// Where the head is: p_view = rotation * p_head + translation, in a camera frame turned to x right, y up, z towards the
// camera; the head is at negative z.
struct ViewPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation{0, 0, -600};
};

// The measured points of one frame.
struct Observation {
  bool has_depth = false;
  Eigen::Matrix2Xd ray;    // 2D: x / depth, y / depth of each point, y up; (pixel - centre) / focal length
  Eigen::Matrix3Xd point;  // 3D: millimetres in the view frame at the model's scale
  Eigen::VectorXd weight;  // 0: missing; else 1, or a detector's own doubt
};

// A Gaussian over weights, and the bounds. Its precision is `tightness` times the matrix.
struct WeightPrior {
  ShapeMatrix precision = ShapeMatrix::Identity();
  double tightness = 1;
  ShapeVector mean = ShapeVector::Zero();
  double low = 0, high = 1;
};

// The linearised fit of one frame: what it knows of pose and weights. It changes little while the fit improves, so it
// can be kept.
struct NormalMatrices {
  Eigen::Matrix<double, 6, 6> pose_inverse;
  Eigen::Matrix<double, 6, kShapes> cross;
  ShapeMatrix information;  // of the weights, pose eliminated
};

class FrameFit {
 public:
  FrameFit(const MeasuredPoints& points, const Settings& settings);

  const MeasuredPoints& points() const { return points_; }

  // The face at rest (3P) and its expressions. `basis` must outlive this object. Allocates nothing.
  void setFace(const Eigen::VectorXd& neutral, const ExpressionBasis& basis);

  // A pose from nothing: similarity in the image, then Gauss-Newton on the face at rest. False when the points make no
  // face.
  bool initialisePose(const Observation& seen, ViewPose& pose);

  // Improves pose and weights. False when the result is not a head in front of the camera; pose and weights are then
  // unchanged. `kept`, if given, is used instead of linearising anew.
  bool improve(const Observation& seen, const WeightPrior& prior, int iterations, int sweeps, ViewPose& pose,
               ShapeVector& weights, const NormalMatrices* kept = nullptr);

  // Of the last improve() or evaluate(): each point's residual in the head frame (3P, what the model lacks to reach the
  // measured point, along the directions that the view shows), and the root mean square over points seen, in
  // millimetres at the model's scale.
  const Eigen::VectorXd& residual() const { return residual_; }
  double rms_mm() const { return rms_mm_; }
  // 3P: the same, cut and weighted, times trust: the slope of the fit in each point's position, for unit variance.
  const Eigen::VectorXd& gradient() const { return gradient_; }
  // Of the last improve() without `kept`.
  const NormalMatrices& normal() const { return normal_; }
  // Of the last call: adds what this frame knows of each point's place, 3 by 3 blocks side by side, unit variance.
  void addPointInformation(const Observation& seen, Eigen::Matrix<double, 3, Eigen::Dynamic>& blocks) const;

  // Residuals for a pose and weights, nothing improved. False as above.
  bool evaluate(const Observation& seen, const ViewPose& pose, const ShapeVector& weights);

 private:
  using Pose6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  void composeNormalMatrices(const Observation& seen);
  void exactPoseStep(const Observation& seen, ViewPose& pose);

  MeasuredPoints points_;
  double variance_, outlier_mm_, linear_within_rad_;
  const ExpressionBasis* basis_ = nullptr;
  Eigen::VectorXd neutral_;   // 3P
  Eigen::VectorXd position_;  // 3P
  Eigen::VectorXd gradient_;  // 3P: trust * A^T r, r cut
  Eigen::VectorXd residual_;
  std::array<Eigen::VectorXf, 3> moved_, pull_;         // P: expression's part of a position; the gradient by axis
  std::array<std::array<Eigen::VectorXf, 3>, 3> view_;  // A of each point: row, column, P values; 2D uses two rows
  int view_rows_ = 2;
  Eigen::MatrixXf jacobian_;  // rows 2P or 3P, columns 6 pose and 52 weights, square root of weight in it
  Eigen::MatrixXf gram_;      // 58 by 58
  NormalMatrices normal_;
  ShapeMatrix posterior_;
  Pose6 pose_gradient_;
  double rms_mm_ = 0;
  double cost_ = 0;  // of the points' residuals: what the steps make smaller, without the prior's share
};

}  // namespace volto::tracker
