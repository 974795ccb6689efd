#include "rig/fitting/visible_triangles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace volto::rig {
namespace {

constexpr int kSize = 300;          // pixels
constexpr double kHalf_es = 3;      // half the picture's side
constexpr double kSlack_es = 0.03;  // behind the front by this much is still seen
constexpr float kNothing = -1e9F;

class DepthPicture {
 public:
  explicit DepthPicture(const Eigen::Matrix3d& view_from_head)
      : view_(view_from_head), depth_(std::size_t{kSize} * kSize, kNothing) {}

  // Pixels and depth towards the viewer.
  Eigen::Vector3d project(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = view_ * p;
    return {(v.x() + kHalf_es) * kSize / (2 * kHalf_es), (v.y() + kHalf_es) * kSize / (2 * kHalf_es), v.z()};
  }

  void draw(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const auto range = [](double low, double high) {
      return std::pair{static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, double{kSize})),
                       static_cast<int>(std::clamp(std::ceil(high - 0.5), 0.0, double{kSize}))};
    };
    const auto [x0, x1] = range(std::min({a.x(), b.x(), c.x()}), std::max({a.x(), b.x(), c.x()}));
    const auto [y0, y1] = range(std::min({a.y(), b.y(), c.y()}), std::max({a.y(), b.y(), c.y()}));
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    if (std::abs(area) < 1e-12) return;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double v = ((px - a.x()) * (c.y() - a.y()) - (py - a.y()) * (c.x() - a.x())) / area;
        const double w = ((b.x() - a.x()) * (py - a.y()) - (b.y() - a.y()) * (px - a.x())) / area;
        if (v < 0 || w < 0 || v + w > 1) continue;
        float& depth = depth_[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
        depth = std::max(depth, static_cast<float>((1 - v - w) * a.z() + v * b.z() + w * c.z()));
      }
  }

  bool sees(const Eigen::Vector3d& p) const {
    const double x = std::floor(p.x()), y = std::floor(p.y());
    if (!(x >= 0 && y >= 0 && x < kSize && y < kSize)) return false;
    const float depth = depth_[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
    return p.z() >= static_cast<double>(depth) - kSlack_es;
  }

 private:
  Eigen::Matrix3d view_;
  std::vector<float> depth_;
};

}  // namespace

std::vector<bool> visibleTriangles(const VertexPositions& positions,
                                   const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<bool> visible(triangles.size(), false);
  std::vector<Eigen::Vector3d> projected(static_cast<std::size_t>(positions.rows()));
  constexpr double kDegree = std::numbers::pi / 180;
  for (const double pitch : {-40.0, 0.0, 40.0})
    for (const double yaw : {-75.0, -35.0, 0.0, 35.0, 75.0}) {
      const Eigen::Matrix3d view = (Eigen::AngleAxisd(pitch * kDegree, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(yaw * kDegree, Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
      DepthPicture picture(view);
      for (std::size_t v = 0; v < projected.size(); ++v)
        projected[v] = picture.project(positions.row(static_cast<Eigen::Index>(v)));
      for (const auto& t : triangles) picture.draw(projected[t[0]], projected[t[1]], projected[t[2]]);
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (visible[t]) continue;
        const Eigen::Vector3d &a = projected[triangles[t][0]], &b = projected[triangles[t][1]],
                              &c = projected[triangles[t][2]];
        if ((b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()) <= 0) continue;  // its back
        visible[t] = picture.sees(a) || picture.sees(b) || picture.sees(c) || picture.sees((a + b + c) / 3);
      }
    }
  return visible;
}

}  // namespace volto::rig
