#include "rig/fitting/openings.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace volto::rig {
namespace {

constexpr int kSize = 256;  // pixels a side
constexpr float kNothing = -1e9F;
constexpr double kRimSlope = 1.0;

std::size_t indexOf(std::string_view id) { return featurePointIndex(id).value(); }

// Depth of the nearest front side of the skin, looked at along -`towards` (unit); depth grows towards the viewer.
class SkinPicture {
 public:
  SkinPicture(const VertexPositions& positions, const std::vector<std::array<std::uint32_t, 3>>& triangles,
              const Eigen::Vector3d& centre, const Eigen::Vector3d& towards, double half)
      : centre_(centre), half_(half), depth_(std::size_t{kSize} * kSize, kNothing) {
    axes_.row(0) = Eigen::Vector3d::UnitY().cross(towards).normalized().transpose();
    axes_.row(2) = towards.transpose();
    axes_.row(1) = axes_.row(2).cross(axes_.row(0));
    std::vector<float> back(depth_.size(), kNothing);
    for (const auto& t : triangles) {
      const Eigen::Vector3d a = project(positions.row(t[0])), b = project(positions.row(t[1])),
                            c = project(positions.row(t[2]));
      const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
      if (std::abs(area) > 1e-12) draw(a, b, c, area, area > 0 ? depth_ : back);
    }
    for (std::size_t i = 0; i < depth_.size(); ++i)
      if (back[i] > depth_[i] + 1e-4) depth_[i] = kNothing;  // an inside is seen: no skin in front of it
  }

  Eigen::Vector3d project(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = axes_ * (p - centre_);
    return {(v.x() / half_ + 1) * kSize / 2, (v.y() / half_ + 1) * kSize / 2, v.z()};
  }
  Eigen::Vector3d place(int x, int y) const {
    const Eigen::Vector3d v(((x + 0.5) * 2 / kSize - 1) * half_, ((y + 0.5) * 2 / kSize - 1) * half_, at(x, y));
    return axes_.transpose() * v + centre_;
  }
  static bool inside(int x, int y) { return x >= 0 && y >= 0 && x < kSize && y < kSize; }
  float at(int x, int y) const { return depth_[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)]; }
  double pixel() const { return 2 * half_ / kSize; }

 private:
  static void draw(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, double area,
                   std::vector<float>& depth) {
    const auto range = [](double low, double high) {
      return std::pair{static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, double{kSize})),
                       static_cast<int>(std::clamp(std::ceil(high - 0.5), 0.0, double{kSize}))};
    };
    const auto [x0, x1] = range(std::min({a.x(), b.x(), c.x()}), std::max({a.x(), b.x(), c.x()}));
    const auto [y0, y1] = range(std::min({a.y(), b.y(), c.y()}), std::max({a.y(), b.y(), c.y()}));
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double v = ((px - a.x()) * (c.y() - a.y()) - (py - a.y()) * (c.x() - a.x())) / area;
        const double w = ((b.x() - a.x()) * (py - a.y()) - (b.y() - a.y()) * (px - a.x())) / area;
        if (v < 0 || w < 0 || v + w > 1) continue;
        float& d = depth[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
        d = std::max(d, static_cast<float>((1 - v - w) * a.z() + v * b.z() + w * c.z()));
      }
  }

  Eigen::Vector3d centre_;
  double half_;
  Eigen::Matrix3d axes_;
  std::vector<float> depth_;
};

struct EyeIds {
  SeenMargin::Of eye;
  std::string_view inner, outer;
  std::array<std::string_view, 3> upper, lower;
};
constexpr EyeIds kEyes[] = {
    {SeenMargin::Of::left_eye, "3.11", "3.7", {"3.1", "12.5", "12.6"}, {"3.3", "12.7", "12.8"}},
    {SeenMargin::Of::right_eye, "3.8", "3.12", {"3.2", "12.9", "12.10"}, {"3.4", "12.11", "12.12"}}};

// The hole between the lids, a column at a time: lowest and highest open row; low > high where there is none.
struct Hole {
  std::array<int, kSize> low{}, high{};
  int first = kSize, last = -1;  // columns
};

std::optional<Hole> holeAround(const SkinPicture& picture, double seed_x, double seed_y, float open_below,
                               double width_px) {
  const auto open = [&](int x, int y) { return picture.at(x, y) < open_below; };
  // The nearest open pixel to the middle of the lids, as far as they may be off.
  std::optional<std::pair<int, int>> seed;
  double nearest = 0.3 * width_px;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      if (const double d = std::hypot(x + 0.5 - seed_x, y + 0.5 - seed_y); d < nearest && open(x, y)) {
        nearest = d;
        seed = {x, y};
      }
  if (!seed) return std::nullopt;
  Hole hole;
  hole.low.fill(kSize);
  hole.high.fill(-1);
  std::vector<bool> done(std::size_t{kSize} * kSize, false);
  std::vector<std::pair<int, int>> left{*seed};
  std::size_t area = 0;
  while (!left.empty()) {
    const auto [x, y] = left.back();
    left.pop_back();
    if (!SkinPicture::inside(x, y)) return std::nullopt;  // runs out of the picture: no eye
    const std::size_t i = static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x);
    if (done[i] || !open(x, y)) continue;
    done[i] = true;
    ++area;
    const auto column = static_cast<std::size_t>(x);
    hole.low[column] = std::min(hole.low[column], y);
    hole.high[column] = std::max(hole.high[column], y);
    hole.first = std::min(hole.first, x);
    hole.last = std::max(hole.last, x);
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) left.emplace_back(x + dx, y + dy);
  }
  const double wide = hole.last - hole.first + 1;
  if (wide < 0.5 * width_px || wide > 1.8 * width_px || static_cast<double>(area) < 0.05 * wide * wide)
    return std::nullopt;
  return hole;
}

void lookAtEye(const VertexPositions& positions, const std::vector<std::array<std::uint32_t, 3>>& triangles,
               const FeaturePointPositions& points, const std::array<bool, kFeaturePointCount>& known,
               const EyeIds& ids, std::vector<SeenMargin>& out) {
  const auto point = [&](std::string_view id) -> Eigen::Vector3d {
    return points.row(static_cast<Eigen::Index>(indexOf(id)));
  };
  // Looked at in level direction against the plane that the lids lie in.
  Eigen::Matrix<double, 8, 3> loop;
  loop.row(0) = point(ids.inner);
  loop.row(1) = point(ids.outer);
  for (std::size_t i = 0; i < 3; ++i) {
    loop.row(static_cast<Eigen::Index>(2 + i)) = point(ids.upper[i]);
    loop.row(static_cast<Eigen::Index>(5 + i)) = point(ids.lower[i]);
  }
  const Eigen::Vector3d centre = loop.colwise().mean();
  const Eigen::MatrixXd around = loop.rowwise() - centre.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(around.transpose() * around);
  Eigen::Vector3d towards = axes.eigenvectors().col(0);
  towards.y() = 0;  // level: from below one would look under the lid
  if (towards.z() < 0) towards = -towards;
  towards = towards.z() > 0.7 ? towards.normalized() : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  const double width = (point(ids.inner) - point(ids.outer)).norm();
  const SkinPicture picture(positions, triangles, centre, towards, 1.1 * width);
  const double width_px = width / picture.pixel();
  const auto open_below = static_cast<float>(-0.25 * width);
  const std::optional<Hole> hole = holeAround(picture, kSize / 2.0, kSize / 2.0, open_below, width_px);
  if (!hole) return;

  // Corners: those that are known, else the ends of the hole.
  const Eigen::Vector3d inner = picture.project(point(ids.inner)), outer = picture.project(point(ids.outer));
  const bool inner_first = inner.x() < outer.x();
  const auto end = [&](bool first) {
    const int x = first ? hole->first : hole->last;
    return x + (first ? 0.0 : 1.0);
  };
  const double inner_x = known[indexOf(ids.inner)] ? inner.x() : end(inner_first);
  const double outer_x = known[indexOf(ids.outer)] ? outer.x() : end(!inner_first);
  // From the hole outwards, over the lid's rim, which is steep, to where its front begins.
  const auto see = [&](std::string_view id, int x, int y, int step) {
    const auto last = static_cast<int>(0.4 * width_px);
    for (int tries = 0; tries < last; ++tries, y += step) {
      if (!SkinPicture::inside(x, y + 3 * step) || picture.at(x, y) < open_below) continue;
      if (picture.at(x, y + 3 * step) - picture.at(x, y) > kRimSlope * 3 * picture.pixel()) continue;
      out.push_back({ids.eye, indexOf(id), picture.place(x, y)});
      return;
    }
  };
  for (const bool upper : {true, false})
    for (const std::string_view id : upper ? ids.upper : ids.lower) {
      if (known[indexOf(id)]) continue;
      const double share = (picture.project(point(id)).x() - inner.x()) / (outer.x() - inner.x());
      const int x = static_cast<int>(std::floor(inner_x + share * (outer_x - inner_x)));
      if (x < hole->first || x > hole->last) continue;
      const auto column = static_cast<std::size_t>(x);
      see(id, x, upper ? hole->high[column] + 1 : hole->low[column] - 1, upper ? 1 : -1);
    }
}

void lookAtMouth(const VertexPositions& positions, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                 const FeaturePointPositions& points, const std::array<bool, kFeaturePointCount>& known,
                 std::vector<SeenMargin>& out) {
  const auto point = [&](std::string_view id) -> Eigen::Vector3d {
    return points.row(static_cast<Eigen::Index>(indexOf(id)));
  };
  constexpr double kBend = 0.03, kLeastBend = 0.006, kOpen = 0.06;  // eye separations
  const double width = (point("8.3") - point("8.4")).norm();
  const Eigen::Vector3d centre = 0.5 * (point("2.2") + point("2.3"));
  const SkinPicture picture(positions, triangles, centre, Eigen::Vector3d::UnitZ(), 0.75 * width);
  const int h = std::max(1, static_cast<int>(std::lround(kBend / picture.pixel())));
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kColumns = {
      {{"2.2", "2.3"}, {"2.6", "2.8"}, {"2.7", "2.9"}}};
  // The red of the lips, as fitted: the grooves over and under it are none of theirs.
  const double top = picture.project(point("8.1")).y(), bottom = picture.project(point("8.2")).y();
  for (const auto& [upper_id, lower_id] : kColumns) {
    if (known[indexOf(upper_id)] && known[indexOf(lower_id)]) continue;
    const Eigen::Vector3d fitted = picture.project(0.5 * (point(upper_id) + point(lower_id)));
    const int x = static_cast<int>(std::floor(fitted.x()));
    const auto depth = [&](int y) {
      return SkinPicture::inside(x, y) ? std::max(picture.at(x, y), static_cast<float>(-1.0)) : -1.0F;
    };
    const int low = static_cast<int>(std::ceil(fitted.y() - 0.8 * (picture.project(centre).y() - bottom)));
    const int high = static_cast<int>(std::floor(fitted.y() + 0.8 * (top - picture.project(centre).y())));
    int valley = -1;
    double sharpest = kLeastBend;
    for (int y = low; y <= high; ++y) {
      const double d = depth(y), bend = std::min(depth(y - h) - d, depth(y + h) - d);
      if (bend > sharpest) {
        sharpest = bend;
        valley = y;
      }
    }
    if (valley < 0) continue;
    // Where teeth or the dark show between the lips, the margins are the edges of that.
    int upper = valley + 1, lower = valley - 1;
    const auto shut = [&](int y, int from) { return depth(y) > depth(from) - kOpen; };
    if (sharpest > kOpen) {
      while (upper <= high + h && !shut(upper, std::min(upper + h, high + h))) ++upper;
      while (lower >= low - h && !shut(lower, std::max(lower - h, low - h))) --lower;
    }
    for (const auto& [id, y] : {std::pair{upper_id, upper}, std::pair{lower_id, lower}})
      if (!known[indexOf(id)] && SkinPicture::inside(x, y) && picture.at(x, y) > kNothing / 2)
        out.push_back({SeenMargin::Of::mouth, indexOf(id), picture.place(x, y)});
  }
}

}  // namespace

std::vector<SeenMargin> seenMargins(const VertexPositions& positions,
                                    const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                    const FeaturePointPositions& points,
                                    const std::array<bool, kFeaturePointCount>& known) {
  std::vector<SeenMargin> out;
  for (const EyeIds& eye : kEyes) lookAtEye(positions, triangles, points, known, eye, out);
  lookAtMouth(positions, triangles, points, known, out);
  return out;
}

}  // namespace volto::rig
