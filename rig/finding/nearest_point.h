// Nearest neighbour among points: the one place that sees nanoflann.
#pragma once

#include <memory>
#include <span>

#include <Eigen/Core>

namespace volto::rig {

class NearestPoint {
 public:
  explicit NearestPoint(std::span<const Eigen::Vector3d> points);  // copies them; at least one
  ~NearestPoint();
  NearestPoint(NearestPoint&&) noexcept;
  NearestPoint& operator=(NearestPoint&&) noexcept;

  struct Hit {
    std::size_t index;
    double squared_distance;
  };
  Hit operator()(const Eigen::Vector3d& p) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace volto::rig
