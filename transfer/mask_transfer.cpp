#include "transfer/mask_transfer.h"

#include <cmath>

#include "rig/closest_point.h"
#include "rig/fapu.h"

namespace volto::transfer {
namespace {

// How well a ratio of two faces' units can be known. A unit is one distance between two or three points, each of which is
// placed to some hundredths of the eye separation (rig/fitting/README.md).
constexpr double kUnitNoise = 0.05;

double spreadOf(const rig::FeaturePointPositions& points) {
  return std::sqrt((points.rowwise() - points.colwise().mean()).squaredNorm());
}

// The target's units by the source's. What is between a unit's ratio and the ratio of the whole faces counts the less the
// more it is what the points' places alone would make (the estimate of least expected error, as James and Stein have
// it): a mouth that is two hundredths wider than the face would have it is none, one that is twice as wide is.
rig::Fapu steadied(const rig::Rig& source, const rig::Rig& target) {
  const double whole = std::log(spreadOf(target.feature_positions) / spreadOf(source.feature_positions));
  const auto unit = [&](double of_source, double of_target) {
    const double off = std::log(of_target / of_source) - whole;
    return of_source * std::exp(whole + off * off * off / (off * off + kUnitNoise * kUnitNoise));
  };
  const rig::Fapu &s = source.fapu.fapu, &t = target.fapu.fapu;
  return {.iris_diameter = unit(s.iris_diameter, t.iris_diameter),
          .eye_separation = unit(s.eye_separation, t.eye_separation),
          .eye_nose = unit(s.eye_nose, t.eye_nose),
          .mouth_nose = unit(s.mouth_nose, t.mouth_nose),
          .mouth_width = unit(s.mouth_width, t.mouth_width)};
}

Eigen::Vector3d scaleAt(const rig::Fapu& fapu, const MaskPlace& place) {
  const rig::FeaturePointPositions scale = rig::fapuScale(fapu);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    sum += place.barycentric[i] * scale.row(rig::maskTriangles()[place.triangle][i]).transpose();
  return sum;
}

// The vertex that stands for a point of the mask: its own, or the nearest to a free position.
std::uint32_t vertexOf(const rig::RefinedMask& mask, std::size_t point, const rig::VertexPositions& neutral) {
  Eigen::Index v = mask.vertex[point];
  if (v < 0) v = rig::nearestVertex(neutral, mask.positions.row(static_cast<Eigen::Index>(point)));
  return static_cast<std::uint32_t>(v);
}

}  // namespace

Eigen::Vector3d fapuRatio(const rig::Rig& source, const rig::Rig& target, const MaskPlace& place) {
  return scaleAt(steadied(source, target), place).cwiseQuotient(scaleAt(source.fapu.fapu, place));
}

MaskTransfer::MaskTransfer(const rig::Rig& source, const rig::Rig& target)
    : source_(source), target_(target), mask_(drivingMask(target)) {
  const rig::RefinedMask on_source = drivingMask(source);
  const bool same = rig::sameTopology(source.neutral, target.neutral);
  const MaskInterpolation reading(on_source);
  const std::vector<MaskPlace> places = placesOf(mask_);
  readings_.resize(mask_.pointCount());
  for (std::size_t p = 0; p < readings_.size(); ++p) {
    Reading& r = readings_[p];
    if (same) {
      const std::uint32_t v = vertexOf(mask_, p, target.neutral.positions);
      r.vertex = {v, v, v};
      r.weight = {1, 0, 0};
    } else {
      const MaskInterpolation::Row row = reading.at(places[p]);
      for (std::size_t i = 0; i < 3; ++i) r.vertex[i] = vertexOf(on_source, row.point[i], source.neutral.positions);
      r.weight = row.weight;
    }
    r.ratio = fapuRatio(source, target, places[p]);
    r.target_from_source = target.mesh_from_head * r.ratio.asDiagonal() * source.mesh_from_head.transpose();
  }
}

rig::VertexPositions MaskTransfer::pointDisplacements(const rig::VertexPositions& example) const {
  rig::VertexPositions points(static_cast<Eigen::Index>(readings_.size()), 3);
  for (std::size_t p = 0; p < readings_.size(); ++p) {
    const Reading& r = readings_[p];
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      moved += r.weight[i] * (example.row(r.vertex[i]) - source_.neutral.positions.row(r.vertex[i])).transpose();
    points.row(static_cast<Eigen::Index>(p)) = (r.target_from_source * moved).transpose();
  }
  return points;
}

std::vector<Eigen::Vector3d> MaskTransfer::vertexRatios() const {
  const double size = target_.fapu.fapu.eye_separation / source_.fapu.fapu.eye_separation;
  std::vector<Eigen::Vector3d> out(target_.neutral.vertexCount(), Eigen::Vector3d::Constant(size));
  for (std::size_t v = 0; v < out.size(); ++v) {
    const auto points = mask_.to_vertices.points(v);
    const auto weights = mask_.to_vertices.weights(v);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double total = 0;
    for (std::size_t e = 0; e < points.size(); ++e) {
      const double w = std::abs(static_cast<double>(weights[e]));
      sum += w * readings_[points[e]].ratio;
      total += w;
    }
    if (total > 0) out[v] = sum / total;
  }
  return out;
}

rig::VertexPositions MaskTransfer::transfer(const rig::VertexPositions& example) const {
  return target_.neutral.positions + rig::displaceVertices(mask_, pointDisplacements(example));
}

}  // namespace volto::transfer
