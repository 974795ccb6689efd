#include "tracker/face_model.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>

#include "tracker/mean_face.h"

namespace volto::tracker {
namespace {

constexpr int kAll = static_cast<int>(3 * kFeaturePointCount);
constexpr double kFreeVariance = 1e4;  // mm^2: a similarity transform is no feature of a face

// Columns: the 6 rigid motions and the change of size of the mean face, as displacements of all 84 points.
Eigen::MatrixXd similarityDirections(const rig::FeaturePointPositions& face) {
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(kAll, 7);
  const Eigen::RowVector3d centre = face.colwise().mean();
  for (int i = 0; i < static_cast<int>(kFeaturePointCount); ++i) {
    const Eigen::Vector3d p = (face.row(i) - centre).transpose();
    for (int c = 0; c < 3; ++c) {
      directions(3 * i + c, c) = 1;
      directions.block<3, 1>(3 * i, 3 + c) = Eigen::Vector3d::Unit(c).cross(p);
    }
    directions.block<3, 1>(3 * i, 6) = p;
  }
  return directions;
}

// Deviations of all 84 points, before similarity transforms are taken out.
Eigen::MatrixXd smoothCovariance(const rig::FeaturePointPositions& face, const Settings& settings) {
  constexpr int n = static_cast<int>(kFeaturePointCount);
  Eigen::MatrixXd kernel(n, n);
  const double reach = 2 * settings.shape_reach_mm * settings.shape_reach_mm;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      kernel(i, j) = settings.shape_deviation_mm * settings.shape_deviation_mm *
                     std::exp(-(face.row(i) - face.row(j)).squaredNorm() / reach);
      if (i == j) kernel(i, j) += settings.shape_point_mm * settings.shape_point_mm;
    }
  // Symmetric and antisymmetric parts of a field d under the mirror map m, (m d)_i = diag(-1, 1, 1) d_mirror(i), are
  // independent; for a kernel that the mirror leaves as it is, the covariance of the part (1 +- m) / 2 d is (kernel +-
  // kernel(., mirror)) / 2.
  const auto points = rig::featurePoints();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(kAll, kAll);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double here = kernel(i, j);
      const double there = kernel(i, points[static_cast<std::size_t>(j)].mirror);
      for (int c = 0; c < 3; ++c) {
        const double mirrored = c == 0 ? -there : there;
        covariance(3 * i + c, 3 * j + c) = 0.5 * (here + mirrored) + settings.shape_asymmetry * 0.5 * (here - mirrored);
      }
    }
  return covariance;
}

Eigen::MatrixXd rowsOf(const Eigen::MatrixXd& all, const MeasuredPoints& points) {
  Eigen::MatrixXd measured(3 * points.count(), all.cols());
  for (int p = 0; p < points.count(); ++p)
    measured.middleRows<3>(3 * p) = all.middleRows<3>(3 * points.feature[static_cast<std::size_t>(p)]);
  return measured;
}

}  // namespace

MeasuredPoints measuredPoints(const LayoutTable& layout) {
  MeasuredPoints points;
  std::vector<double> trust;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    if (layout.landmark[i] < 0) continue;
    points.feature.push_back(static_cast<int>(i));
    points.landmark.push_back(layout.landmark[i]);
    trust.push_back(layout.trust[i]);
  }
  points.trust = Eigen::Map<const Eigen::VectorXd>(trust.data(), static_cast<Eigen::Index>(trust.size()));
  return points;
}

ShapePrior::ShapePrior(const MeasuredPoints& points, const Settings& settings) : points_(points) {
  const rig::FeaturePointPositions& face = meanFace();
  const Eigen::Map<const Eigen::VectorXd> flat(face.data(), kAll);
  mean_ = rowsOf(flat, points);

  // Take out of every deviation the similarity transform that the measured points would see in it: pose has that.
  const Eigen::MatrixXd directions = similarityDirections(face);
  const Eigen::MatrixXd seen = rowsOf(directions, points);
  size_ = seen.col(6);
  const Eigen::MatrixXd normal = seen.transpose() * seen;
  const Eigen::MatrixXd pick = normal.ldlt().solve(seen.transpose());  // 7 by 3P
  Eigen::MatrixXd all = smoothCovariance(face, settings);
  const Eigen::MatrixXd measured_rows = rowsOf(all, points);                            // 3P by 252
  const Eigen::MatrixXd once = all - directions * (pick * measured_rows);               // T S
  const Eigen::MatrixXd measured_columns = rowsOf(once.transpose(), points);            // (T S)^T, measured rows
  all = once - (directions * (pick * measured_columns)).transpose();                    // T S T^T
  const Eigen::MatrixXd all_by_measured = rowsOf(all.transpose(), points).transpose();  // 252 by 3P
  covariance_ = rowsOf(all_by_measured, points);
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();

  const int size = 3 * points.count();
  const Eigen::MatrixXd free =
      seen * normal.llt().matrixL().solve(Eigen::MatrixXd::Identity(7, 7)).transpose();  // orthonormal
  Eigen::MatrixXd regular = covariance_ + kFreeVariance * free * free.transpose();
  regular.diagonal().array() += 1e-6;
  precision_ = regular.llt().solve(Eigen::MatrixXd::Identity(size, size));
  fill_ = all_by_measured * precision_;
}

rig::FeaturePointPositions ShapePrior::complete(const Eigen::VectorXd& deviation) const {
  rig::FeaturePointPositions face = meanFace();
  Eigen::Map<Eigen::VectorXd>(face.data(), kAll).noalias() += fill_ * deviation;
  for (int p = 0; p < points_.count(); ++p)
    face.row(points_.feature[static_cast<std::size_t>(p)]) =
        (mean_.segment<3>(3 * p) + deviation.segment<3>(3 * p)).transpose();
  return face;
}

ExpressionBasis::ExpressionBasis(const MeasuredPoints& points, const rig::ExpressionTable& table)
    : points_(points), table_(&table) {
  for (Eigen::MatrixXf& axis : axes_) axis.setZero(points.count(), kShapes);
  fitTo(meanFace());
}

void ExpressionBasis::fitTo(const rig::FeaturePointPositions& neutral_mm) {
  const rig::FeaturePointPositions scale = rig::fapuScale(rig::measureFapu(neutral_mm).fapu);
  for (int k = 0; k < kShapes; ++k)
    for (int p = 0; p < points_.count(); ++p) {
      const int feature = points_.feature[static_cast<std::size_t>(p)];
      for (int c = 0; c < 3; ++c)
        axes_[static_cast<std::size_t>(c)](p, k) =
            static_cast<float>(table_->basis()(3 * feature + c, k) * scale(feature, c));
    }
}

Eigen::MatrixXd ExpressionBasis::interleaved() const {
  Eigen::MatrixXd all(3 * points_.count(), kShapes);
  for (int p = 0; p < points_.count(); ++p)
    for (std::size_t c = 0; c < 3; ++c) all.row(3 * p + static_cast<int>(c)) = axes_[c].row(p).cast<double>();
  return all;
}

}  // namespace volto::tracker
