#include "transfer/mask_places.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <Eigen/LU>

namespace volto::transfer {
namespace {

using Triangle = std::array<std::uint16_t, 3>;
using Barycentric = std::array<double, 3>;

struct Split {
  std::array<std::uint16_t, 3> between{};
  std::uint8_t triangle = 0;  // of the control mask
};

// The point that came last is in three triangles and nothing more: they are taken back to the one that was split, then
// the point before it.
std::vector<Split> splitsOf(const rig::RefinedMask& mask) {
  std::vector<Triangle> triangles(mask.triangles.begin(), mask.triangles.end());
  std::vector<std::uint8_t> base = mask.base_triangle;
  std::vector<std::vector<std::size_t>> around(mask.pointCount());  // triangles at each point, those taken back too
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint16_t p : triangles[t]) around.at(p).push_back(t);
  std::vector<bool> gone(triangles.size(), false);
  std::vector<Split> splits(mask.pointCount());
  for (std::size_t p = mask.pointCount(); p-- > kFeaturePointCount;) {
    std::vector<std::size_t> fan;
    for (const std::size_t t : around[p])
      if (!gone[t]) fan.push_back(t);
    if (fan.size() != 3)
      throw std::invalid_argument("the refined mask's triangles are no subdivision of the control mask");
    // The corners of the first triangle, with the new point replaced by the corner that is in both others.
    Triangle whole = triangles[fan[0]];
    std::uint16_t opposite = whole[0];
    for (const std::uint16_t q : triangles[fan[1]])
      if (std::find(whole.begin(), whole.end(), q) == whole.end()) opposite = q;
    std::replace(whole.begin(), whole.end(), static_cast<std::uint16_t>(p), opposite);
    splits[p] = {whole, base[fan[0]]};
    for (const std::size_t t : fan) gone[t] = true;
    for (const std::uint16_t q : whole) around[q].push_back(triangles.size());
    triangles.push_back(whole);
    base.push_back(splits[p].triangle);
    gone.push_back(false);
  }
  return splits;
}

Barycentric cornerOf(std::uint8_t triangle, std::size_t feature_point) {
  Barycentric out{};
  const rig::MaskTriangle& corners = rig::maskTriangles()[triangle];
  for (std::size_t i = 0; i < 3; ++i) out[i] = corners[i] == feature_point ? 1.0 : 0.0;
  return out;
}

}  // namespace

rig::RefinedMask drivingMask(const rig::Rig& rig) {
  if (!rig.refined.empty()) return rig.refined;
  rig::RefinedMask mask;
  mask.positions = rig.feature_positions;
  mask.vertex.assign(rig.feature_vertex.begin(), rig.feature_vertex.end());
  for (std::size_t t = 0; t < rig::kMaskTriangleCount; ++t) {
    const rig::MaskTriangle& corners = rig::maskTriangles()[t];
    mask.triangles.push_back({corners[0], corners[1], corners[2]});
    mask.base_triangle.push_back(static_cast<std::uint8_t>(t));
  }
  mask.to_vertices.start.assign(rig.deformation.row_start.begin(), rig.deformation.row_start.end());
  mask.to_vertices.point.assign(rig.deformation.point.begin(), rig.deformation.point.end());
  mask.to_vertices.weight = rig.deformation.weight;
  for (std::uint16_t p = 0; p < kFeaturePointCount; ++p) {
    mask.from_feature_points.point.push_back(p);
    mask.from_feature_points.weight.push_back(1.0F);
    mask.from_feature_points.start.push_back(p + 1U);
  }
  return mask;
}

std::vector<MaskPlace> placesOf(const rig::RefinedMask& mask) {
  const std::vector<Split> splits = splitsOf(mask);
  std::vector<MaskPlace> places(mask.pointCount());
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    for (std::size_t t = 0; t < rig::kMaskTriangleCount; ++t) {
      const rig::MaskTriangle& corners = rig::maskTriangles()[t];
      if (std::find(corners.begin(), corners.end(), p) == corners.end()) continue;
      places[p] = {static_cast<std::uint8_t>(t), cornerOf(static_cast<std::uint8_t>(t), p)};
      break;
    }
  }
  for (std::size_t p = kFeaturePointCount; p < places.size(); ++p) {
    places[p].triangle = splits[p].triangle;
    for (const std::uint16_t q : splits[p].between) {
      const Barycentric at = q < kFeaturePointCount ? cornerOf(splits[p].triangle, q) : places[q].barycentric;
      for (std::size_t i = 0; i < 3; ++i) places[p].barycentric[i] += at[i] / 3;
    }
  }
  return places;
}

MaskInterpolation::MaskInterpolation(const rig::RefinedMask& mask) {
  const std::vector<MaskPlace> places = placesOf(mask);
  for (std::size_t t = 0; t < mask.triangles.size(); ++t) {
    const std::uint8_t base = mask.base_triangle[t];
    Piece piece{mask.triangles[t], {}};
    for (std::size_t i = 0; i < 3; ++i)
      piece.corner[i] =
          piece.point[i] < kFeaturePointCount ? cornerOf(base, piece.point[i]) : places[piece.point[i]].barycentric;
    pieces_[base].push_back(piece);
  }
}

MaskInterpolation::Row MaskInterpolation::at(const MaskPlace& place) const {
  const Eigen::Vector3d b = Eigen::Map<const Eigen::Vector3d>(place.barycentric.data());
  Row best;
  double least = -std::numeric_limits<double>::infinity();
  for (const Piece& piece : pieces_[place.triangle]) {
    Eigen::Matrix3d corners;
    for (int i = 0; i < 3; ++i)
      corners.col(i) = Eigen::Map<const Eigen::Vector3d>(piece.corner[static_cast<std::size_t>(i)].data());
    const Eigen::Vector3d w = corners.inverse() * b;
    if (!w.allFinite() || w.minCoeff() <= least) continue;
    least = w.minCoeff();  // the piece that holds it, or the nearest to that by rounding
    best = {piece.point, {w[0], w[1], w[2]}};
  }
  return best;
}

}  // namespace volto::transfer
