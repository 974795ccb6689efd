#include "tracker/neutral_face.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/LU>
#include <Eigen/SVD>

namespace volto::tracker {

NeutralFace makeNeutralFace(const ShapePrior& shape, const MeasuredPoints& points, const Eigen::VectorXd& deviation,
                            double scale) {
  NeutralFace face;
  face.positions_mm = scale * shape.complete(deviation);
  face.confidence.fill(0.5F);
  for (int p = 0; p < points.count(); ++p)
    face.confidence[static_cast<std::size_t>(points.feature[static_cast<std::size_t>(p)])] =
        static_cast<float>(points.trust[p]);
  return face;
}

// S. Umeyama: Least-squares estimation of transformation parameters between two point patterns, PAMI 1991.
Deviation deviationOf(const NeutralFace& face, const ShapePrior& shape, const MeasuredPoints& points) {
  if (!face.positions_mm.allFinite())
    throw std::invalid_argument("the neutral face has a position that is not a number; measure it again");
  Eigen::Matrix3Xd given(3, points.count()), mean(3, points.count());
  for (int p = 0; p < points.count(); ++p) {
    given.col(p) = face.positions_mm.row(points.feature[static_cast<std::size_t>(p)]).transpose();
    mean.col(p) = shape.mean().segment<3>(3 * p);
  }
  const Eigen::Vector3d given_centre = given.rowwise().mean(), mean_centre = mean.rowwise().mean();
  given.colwise() -= given_centre;
  mean.colwise() -= mean_centre;
  const double spread = given.squaredNorm();
  if (!(spread > 1e-6)) throw std::invalid_argument("the neutral face has all points in one place; measure it again");
  const Eigen::Matrix3d covariance = mean * given.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign.z() = -1;
  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  const double scale = svd.singularValues().dot(sign) / spread;
  if (!(scale > 1e-6 && scale < 1e6))
    throw std::invalid_argument("the neutral face does not look like a face; measure it again");
  Eigen::VectorXd deviation(3 * points.count());
  for (int p = 0; p < points.count(); ++p) deviation.segment<3>(3 * p) = scale * rotation * given.col(p) - mean.col(p);
  return {deviation, 1 / scale};
}

}  // namespace volto::tracker
