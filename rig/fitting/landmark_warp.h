// From a few landmarks to a smooth warp of space: thin-plate splines (Orvalho, Zacur, Susin, section 4.1, kernel
// |x - p|), written as a Gaussian process, so that a landmark may be uncertain, four are enough, and the warp knows
// how sure it is.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace volto::rig {

// x -> scale * rotation * x + translation. Mirrored: determinant of rotation is -1.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const { return scale * (rotation * x) + translation; }
  Eigen::Vector3d inverse(const Eigen::Vector3d& y) const { return rotation.transpose() * (y - translation) / scale; }
};

struct WarpLandmark {
  Eigen::Vector3d from, to;
  double sigma = 0;  // standard deviation of `to`, in the unit of `from`; 0: exact
};

// Least squares, weights 1 / (sigma + 0.05)^2. `mirrored` asks for determinant -1. rms: what is left, in units of
// `from`, weighted. Meaningless below three landmarks or for landmarks on one line.
struct SimilarityFit {
  Similarity similarity;
  double rms = 0;
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();  // singular values of the landmarks' spread, largest first
};
SimilarityFit fitSimilarity(std::span<const WarpLandmark> landmarks, bool mirrored = false);

// Frame and unit: a head's frame, x = 0 its plane of symmetry, unit the eye separation. Displacements are taken to be
// mostly the same on both sides; what differs is followed too. Reentrant once built.
class LandmarkWarp {
 public:
  explicit LandmarkWarp(std::vector<WarpLandmark> landmarks);

  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const;
  // Standard deviation of the warped point (root of the sum over the axes).
  double deviation(const Eigen::Vector3d& x) const;

 private:
  std::vector<WarpLandmark> landmarks_;
  Eigen::MatrixX3d weights_;                // per landmark and axis
  std::array<Eigen::MatrixXd, 2> inverse_;  // of the covariance: x axis; y and z axes
};

}  // namespace volto::rig
