// The actor's face at rest, found in frames of which none need be at rest. Internal to the tracker.
//
// A stored frame shows the face at rest N plus an expression B w. The two are told apart in two steps:
// 1. What moves. Frames are explained as a mean face M (N and the usual expression together), a head pose each, and a
// deviation v from
//    the usual expression, v ~ Gaussian(0, S), by alternating: pose and v of each frame, M from all frames (its prior
//    takes both a person's shape and a usual expression into account), S from the deviations (expectation maximisation:
//    their scatter plus what the points leave open, the general statistics counting as a few frames).
// 2. What is rest. M - B u is a face at rest for any usual expression u; the data cannot tell, people can: weights are
// never negative,
//    and most come to rest now and then. So each shape's low quantile over the take is put at zero, softly, against how
//    likely the face that is left over is (ShapePrior). A quadratic programme of 52 unknowns.
//
// All work is cut into small pieces, so that a live stream can afford it: work() does one.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "tracker/expression_prior.h"
#include "tracker/face_model.h"
#include "tracker/frame_fit.h"
#include "tracker/settings.h"

namespace volto::tracker {

class NeutralEstimator {
 public:
  // Borrows nothing but `table`. Stores at most `capacity` frames.
  NeutralEstimator(const MeasuredPoints& points, const ShapePrior& shape, const rig::ExpressionTable& table,
                   const ExpressionPrior& expression, const Settings& settings, int capacity);

  // The neutral is known: from now on only the actor's habits are learned, starting from these.
  void fixNeutral(const Eigen::VectorXd& deviation, const rig::FeaturePointPositions& neutral_mm,
                  const ShapeVector& usual, const ShapeMatrix& habits);

  // When the store is full every second frame is forgotten. False when it is too early for another one. Allocates
  // nothing.
  bool wants(double time_s) const { return count_ == 0 || time_s - last_time_s_ >= interval_s_; }
  void add(const Observation& seen, const ViewPose& pose, double time_s);
  void setInterval(double interval_s) { interval_s_ = interval_s; }

  // One piece of work, about one frame's fit. True when it finished a pass and the results below are new. Allocates
  // nothing.
  bool work();
  int passes() const { return passes_; }
  bool hasResult() const { return has_result_; }

  const Eigen::VectorXd& neutralDeviation() const { return neutral_; }  // 3P, from the mean face
  const ShapeVector& usualExpression() const { return usual_; }
  const ShapeMatrix& habits() const { return habits_; }  // covariance of weights about the usual expression
  int frames() const { return count_; }

 private:
  struct Stored {
    Observation seen;
    ViewPose pose;
    ShapeVector weights;
    double time_s = 0;
    int fits = 0;           // since it was stored
    NormalMatrices normal;  // of an earlier fit
  };
  enum class Stage { begin, frames, solve, finish };

  void beginPass();
  void fitOne(Stored& stored);
  void endOfFrames();
  bool solveSome();
  void learnHabits();
  void findRest();
  double independentFrames() const;

  MeasuredPoints points_;
  Settings settings_;
  const rig::ExpressionTable* table_;
  const ShapePrior shape_;
  ExpressionBasis basis_;
  Eigen::MatrixXd basis_matrix_;
  FrameFit fit_;
  ShapeMatrix general_;             // the general statistics' deviation
  Eigen::MatrixXd mean_precision_;  // of M
  Eigen::MatrixXd rest_pull_;       // 52 by 3P: B^T precision
  ShapeMatrix rest_normal_;         // B^T precision B

  std::vector<Stored> store_;
  int count_ = 0;
  double interval_s_;
  double last_time_s_ = 0;

  Stage stage_ = Stage::begin;
  int next_ = 0, in_pass_ = 0, iterations_ = 0;
  int passes_ = 0;
  bool fixed_ = false, has_result_ = false;
  Eigen::VectorXd mean_;  // deviation of M from the mean face
  Eigen::VectorXd neutral_;
  ShapeVector usual_ = ShapeVector::Zero();
  ShapeMatrix habits_;
  WeightPrior prior_;

  // Sums of a pass.
  Eigen::VectorXd pull_;                            // 3P
  Eigen::Matrix<double, 3, Eigen::Dynamic> block_;  // 3 by 3P: information of each point
  ShapeVector sum_;
  ShapeMatrix scatter_, information_;
  Eigen::VectorXd solution_, direction_, remainder_, product_, preconditioned_;  // conjugate gradients
  double remainder_norm_ = 0, first_norm_ = 0;
  std::vector<double> sorted_;
};

}  // namespace volto::tracker
