#include "tracker/observability.h"

#include <Eigen/Cholesky>

#include "tracker/frame_fit.h"

namespace volto::tracker {

ShapeVector observability(const MeasuredPoints& points, const rig::ExpressionTable& table, const ExpressionPrior& expression,
                          const Settings& settings) {
  const ExpressionBasis basis(points, table);
  FrameFit fit(points, settings);
  const ShapePrior shape(points, settings);
  fit.setFace(shape.mean(), basis);
  // The mean face as a camera sees it from the front.
  Observation seen;
  seen.ray.resize(2, points.count());
  seen.point.setZero(3, points.count());
  seen.weight.setOnes(points.count());
  ViewPose pose;
  for (int p = 0; p < points.count(); ++p) {
    const Eigen::Vector3d at = shape.mean().segment<3>(3 * p) + pose.translation;
    seen.ray.col(p) = -at.head<2>() / at.z();
  }
  const ShapeMatrix usual = expression.secondMoment(0);  // what the points say, not what other shapes suggest
  WeightPrior prior;
  prior.precision = usual.llt().solve(ShapeMatrix::Identity());
  prior.low = -1;
  ShapeVector weights = ShapeVector::Zero();
  fit.improve(seen, prior, 1, 1, pose, weights);
  const ShapeMatrix left = (fit.information() + prior.precision).llt().solve(ShapeMatrix::Identity());
  return ShapeVector::Ones() - left.diagonal().cwiseQuotient(usual.diagonal());
}

ArkitObserved observableShapes(const MeasuredPoints& points, const rig::ExpressionTable& table, const ExpressionPrior& expression,
                               const Settings& settings) {
  const ShapeVector share = observability(points, table, expression, settings);
  ArkitObserved observed;
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const std::string_view name = kArkitBlendshapeNames[k];
    const bool eyeball = name.starts_with("eyeLookIn") || name.starts_with("eyeLookOut");
    observed[k] = table.movesMask(k) && !eyeball && share[static_cast<Eigen::Index>(k)] >= kLeastObservability;
  }
  return observed;
}

}  // namespace volto::tracker
