#include "rig/fitting/landmark_warp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace volto::rig {
namespace {

// Variances in squared eye separations, found on heads left out: a face's overall place and proportions are free,
// local differences grow with distance.
constexpr double kPlace = 10, kProportion = 0.005, kLocal = 0.005, kReach = 20;
// How much of a displacement is one side's own.
constexpr double kOneSided = 0.3;
constexpr double kNugget = 1e-7;

double covariance(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  return kPlace + kProportion * x.dot(y) + kLocal * (kReach - (x - y).norm());
}

// Of the displacements at x and y along the x axis (kind 0) and along y or z (kind 1).
std::array<double, 2> sidedCovariances(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  const double same = covariance(x, y), mirrored = covariance({-x.x(), x.y(), x.z()}, y);
  return {(same - mirrored) / 2 + kOneSided * same, (same + mirrored) / 2 + kOneSided * same};
}

double sidedCovariance(const Eigen::Vector3d& x, const Eigen::Vector3d& y, int kind) {
  return sidedCovariances(x, y)[static_cast<std::size_t>(kind)];
}

}  // namespace

SimilarityFit fitSimilarity(std::span<const WarpLandmark> landmarks, bool mirrored) {
  SimilarityFit out;
  if (landmarks.empty()) return out;
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = from;
  double total = 0;
  const auto weightOf = [](const WarpLandmark& l) { return 1 / ((l.sigma + 0.05) * (l.sigma + 0.05)); };
  for (const WarpLandmark& l : landmarks) {
    const double w = weightOf(l);
    from += w * l.from;
    to += w * l.to;
    total += w;
  }
  from /= total;
  to /= total;
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero(), own = cross;
  double variance = 0;
  for (const WarpLandmark& l : landmarks) {
    const double w = weightOf(l) / total;
    cross += w * (l.to - to) * (l.from - from).transpose();
    own += w * (l.to - to) * (l.to - to).transpose();
    variance += w * (l.from - from).squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, 1);
  if (((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) != mirrored) sign.z() = -1;
  Similarity& s = out.similarity;
  s.rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  s.scale = variance > 0 ? svd.singularValues().dot(sign) / variance : 0;
  s.translation = to - s.scale * (s.rotation * from);
  out.extent = Eigen::JacobiSVD<Eigen::Matrix3d>(own).singularValues().cwiseMax(0.0).cwiseSqrt();
  double left = 0;
  for (const WarpLandmark& l : landmarks) left += weightOf(l) / total * (s(l.from) - l.to).squaredNorm();
  out.rms = s.scale > 0 ? std::sqrt(left) / s.scale : std::sqrt(left);
  return out;
}

LandmarkWarp::LandmarkWarp(std::vector<WarpLandmark> landmarks) : landmarks_(std::move(landmarks)) {
  const auto n = static_cast<Eigen::Index>(landmarks_.size());
  weights_.setZero(n, 3);
  for (int kind = 0; kind < 2; ++kind) {
    Eigen::MatrixXd matrix(n, n), displacement(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const WarpLandmark& l = landmarks_[static_cast<std::size_t>(i)];
      displacement.row(i) = (l.to - l.from).transpose();
      for (Eigen::Index j = 0; j < n; ++j)
        matrix(i, j) = sidedCovariance(l.from, landmarks_[static_cast<std::size_t>(j)].from, kind);
      matrix(i, i) += kNugget + l.sigma * l.sigma;
    }
    const Eigen::MatrixXd inverse = matrix.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
    if (kind == 0)
      weights_.col(0) = inverse * displacement.col(0);
    else
      weights_.rightCols<2>() = inverse * displacement.rightCols<2>();
    inverse_[static_cast<std::size_t>(kind)] = inverse;
  }
}

Eigen::Vector3d LandmarkWarp::operator()(const Eigen::Vector3d& x) const {
  Eigen::Vector3d out = x;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto [along_x, along_yz] = sidedCovariances(x, landmarks_[i].from);
    out += weights_.row(row).transpose().cwiseProduct(Eigen::Vector3d(along_x, along_yz, along_yz));
  }
  return out;
}

double LandmarkWarp::deviation(const Eigen::Vector3d& x) const {
  double variance = 0;
  for (int kind = 0; kind < 2; ++kind) {
    Eigen::VectorXd k(static_cast<Eigen::Index>(landmarks_.size()));
    for (std::size_t i = 0; i < landmarks_.size(); ++i)
      k[static_cast<Eigen::Index>(i)] = sidedCovariance(x, landmarks_[i].from, kind);
    const double left = sidedCovariance(x, x, kind) - k.dot(inverse_[static_cast<std::size_t>(kind)] * k);
    variance += (kind + 1) * std::max(0.0, left);
  }
  return std::sqrt(variance);
}

}  // namespace volto::rig
