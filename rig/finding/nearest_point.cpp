#include "rig/finding/nearest_point.h"

#include <nanoflann.hpp>
#include <vector>

namespace volto::rig {

struct NearestPoint::Tree {
  struct Cloud {
    std::vector<Eigen::Vector3d> points;
    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][static_cast<Eigen::Index>(axis)]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3>;

  explicit Tree(std::span<const Eigen::Vector3d> points)
      : cloud{{points.begin(), points.end()}}, index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8)) {
    index.buildIndex();
  }
  Cloud cloud;
  Index index;
};

NearestPoint::NearestPoint(std::span<const Eigen::Vector3d> points) : tree_(std::make_unique<Tree>(points)) {}
NearestPoint::~NearestPoint() = default;
NearestPoint::NearestPoint(NearestPoint&&) noexcept = default;
NearestPoint& NearestPoint::operator=(NearestPoint&&) noexcept = default;

NearestPoint::Hit NearestPoint::operator()(const Eigen::Vector3d& p) const {
  Hit hit{0, 0};
  nanoflann::KNNResultSet<double> result(1);
  result.init(&hit.index, &hit.squared_distance);
  tree_->index.findNeighbors(result, p.data(), nanoflann::SearchParams());
  return hit;
}

}  // namespace volto::rig
