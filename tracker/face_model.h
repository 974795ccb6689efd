// The measured points of a face as a linear model: a neutral shape, a prior over such shapes, and what each expression
// adds. Millimetres, head frame. Internal to the tracker.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "rig/expression_table.h"
#include "rig/fapu.h"
#include "rig/feature_points.h"
#include "tracker/expression_prior.h"
#include "tracker/landmark_layout.h"
#include "tracker/settings.h"

namespace volto::tracker {

// Which feature points are measured, and by which landmark.
struct MeasuredPoints {
  std::vector<int> feature;   // feature point index, ascending
  std::vector<int> landmark;  // same length
  Eigen::VectorXd trust;      // same length, 0..1
  int count() const { return static_cast<int>(feature.size()); }
};
MeasuredPoints measuredPoints(const LayoutTable& layout);

// How faces at rest differ from meanFace().
class ShapePrior {
 public:
  ShapePrior(const MeasuredPoints& points, const Settings& settings);

  const Eigen::VectorXd& mean() const { return mean_; }  // 3P: x, y, z of each measured point
  const Eigen::MatrixXd& covariance() const {
    return covariance_;
  }  // 3P by 3P; no rigid motion and no change of size in it
  const Eigen::MatrixXd& precision() const {
    return precision_;
  }  // its inverse; a rigid motion or a change of size costs next to nothing

  const Eigen::VectorXd& size() const { return size_; }  // 3P: what growing by 100 % adds, about the centre

  // All 84 points from a deviation of the measured ones from the mean: measured ones exactly, the others as their
  // neighbours say.
  rig::FeaturePointPositions complete(const Eigen::VectorXd& deviation) const;

 private:
  MeasuredPoints points_;
  Eigen::VectorXd mean_, size_;
  Eigen::MatrixXd covariance_, precision_;
  Eigen::MatrixXd fill_;  // 252 by 3P
};

// What the 52 shapes do to the measured points of a face with these units.
class ExpressionBasis {
 public:
  ExpressionBasis(const MeasuredPoints& points, const rig::ExpressionTable& table);

  // For a face at rest. Allocates nothing after construction.
  void fitTo(const rig::FeaturePointPositions& neutral_mm);

  // P by 52 for x, y and z, millimetres.
  const std::array<Eigen::MatrixXf, 3>& axes() const { return axes_; }
  // 3P by 52, the same with x, y, z of a point together.
  Eigen::MatrixXd interleaved() const;

 private:
  MeasuredPoints points_;
  const rig::ExpressionTable* table_;
  std::array<Eigen::MatrixXf, 3> axes_;
};

}  // namespace volto::tracker
