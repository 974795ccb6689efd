// What is known of expressions before a face has been seen: how far each blendshape is usually used, and which go
// together.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "frames/arkit_blendshapes.h"

namespace volto::tracker {

inline constexpr int kShapes = static_cast<int>(kArkitBlendshapeCount);
using ShapeVector = Eigen::Matrix<double, kShapes, 1>;
using ShapeMatrix = Eigen::Matrix<double, kShapes, kShapes>;

class ExpressionPrior {
 public:
  // The statistics shipped with Volto, tracker/assets/expression_prior.csv, compiled into the library.
  static const ExpressionPrior& standard();
  // Throws std::invalid_argument, naming line and column.
  static ExpressionPrior parse(std::string_view csv, const std::string& name_for_errors);

  // Second moment about zero: a weight's usual size. Symmetric, positive definite; correlations times `correlation`
  // (0..1), so that what a few people do together does not become a rule for everybody.
  ShapeMatrix secondMoment(double correlation) const { return covarianceOf(rms_, correlation); }
  // Covariance about a recording's own mean.
  ShapeMatrix deviation(double correlation) const { return covarianceOf(deviation_, correlation); }

  // Covariance of somebody who uses each shape by `scale`. A scale below a floor is taken to be the floor.
  ShapeMatrix covarianceOf(const ShapeVector& scale, double correlation) const;

 private:
  ShapeVector rms_ = ShapeVector::Zero();
  ShapeVector deviation_ = ShapeVector::Zero();
  ShapeMatrix correlation_ = ShapeMatrix::Identity();
};

}  // namespace volto::tracker
