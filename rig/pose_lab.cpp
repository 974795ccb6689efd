#include "rig/pose_lab.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace volto::rig {
namespace {

constexpr int kMostRounds = 60;
constexpr float kFoldCosine = 0.12F;  // a little before a triangle stands at right angles to where it was
constexpr float kLeastArea = 0.01F;   // of what it was

}  // namespace

PoseLab::PoseLab(const Rig& rig, const Skin& skin)
    : rig_(rig),
      skin_(skin),
      es_(static_cast<float>(rig.fapu.fapu.eye_separation)),
      neutral_(neutralPositions(rig)),
      base_(neutral_),
      positions_(neutral_),
      free_(neutral_.size(), false) {
  for (std::uint32_t v = 0; v < free_.size(); ++v)
    free_[v] = rig.association.kind[v] == AssociationKind::ray || rig.association.kind[v] == AssociationKind::geodesic;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Eigen::Vector3f normal = (rest(b) - rest(a)).cross(rest(c) - rest(a));
    if (a == b || b == c || c == a || !(normal.norm() > 1e-9F * es_ * es_)) return;
    triangles_.push_back({a, b, c});
    rest_normal_.push_back(normal);
  };
  const Mesh& mesh = rig.neutral;
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = mesh.polygon_start[p], corners = mesh.polygon_start[p + 1] - first;
    const auto corner = [&](std::uint32_t c) { return mesh.corner_vertices[first + c % corners]; };
    if (!free_[corner(0)]) continue;
    if (corners == 4) {
      for (std::uint32_t c = 0; c < 4; ++c) add(corner(c), corner(c + 1), corner(c + 2));
    } else {
      for (std::uint32_t c = 2; c < corners; ++c) add(corner(0), corner(c - 1), corner(c));
    }
  }
}

void PoseLab::setWeights(std::span<const float> weights) {
  poseByOperator(rig_, weights, neutral_, base_);
  addToPose(rig_, weights, true, neutral_, base_);
}

const std::vector<Position>& PoseLab::evaluate(const DenseDisplacement& extra) {
  for (std::size_t v = 0; v < positions_.size(); ++v)
    for (std::size_t axis = 0; axis < 3; ++axis)
      positions_[v][axis] = base_[v][axis] + extra[v][static_cast<Eigen::Index>(axis)];
  resolveContacts(rig_.contacts, neutral_, positions_);
  return positions_;
}

std::vector<std::uint32_t> PoseLab::foldedVertices() const {
  std::vector<std::uint32_t> out;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    if (positions_[a] == neutral_[a] && positions_[b] == neutral_[b] && positions_[c] == neutral_[c]) continue;
    const Eigen::Vector3f now = (at(b) - at(a)).cross(at(c) - at(a));
    const float rest = rest_normal_[t].norm(), area = now.norm();
    if (now.dot(rest_normal_[t]) > kFoldCosine * area * rest && area > kLeastArea * rest) continue;
    for (const std::uint32_t v : triangles_[t]) out.push_back(skin_.same_as[v]);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

bool PoseLab::unfold(DenseDisplacement& extra) {
  std::vector<std::uint32_t> region;
  std::vector<std::uint8_t> in_region(neutral_.size(), 0);
  std::vector<std::uint32_t> sharing;  // vertices that a standing one stands for
  DenseDisplacement relaxed(neutral_.size());
  for (int round = 0; round < kMostRounds; ++round) {
    evaluate(extra);
    std::vector<std::uint32_t> seeds = foldedVertices();
    if (seeds.empty()) break;
    if (round + 1 == kMostRounds) return false;
    // The region only grows, so that a fold is not chased to and fro; wider when a narrow one does not do.
    const int rings = round % 8 == 0 ? 2 : 1;
    for (int ring = 0; ring < rings; ++ring) {
      const std::vector<std::uint32_t> front = seeds;
      for (const std::uint32_t v : front)
        for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e)
          seeds.push_back(skin_.graph.neighbour[e]);
      std::sort(seeds.begin(), seeds.end());
      seeds.erase(std::unique(seeds.begin(), seeds.end()), seeds.end());
    }
    for (const std::uint32_t v : seeds)
      if (in_region[v] == 0 && free_[v]) {
        in_region[v] = 1;
        region.push_back(v);
      }
    std::sort(region.begin(), region.end());
    // Two Jacobi steps: every displacement half way to the mean of its neighbours'.
    std::vector<Eigen::Vector3f> change(region.size(), Eigen::Vector3f::Zero());
    for (std::uint32_t v = 0; v < neutral_.size(); ++v) relaxed[v] = at(v) - rest(v);
    for (int step = 0; step < 2; ++step) {
      std::vector<Eigen::Vector3f> next(region.size());
      for (std::size_t i = 0; i < region.size(); ++i) {
        const std::uint32_t v = region[i];
        Eigen::Vector3f mean = Eigen::Vector3f::Zero();
        const auto count = static_cast<float>(skin_.graph.start[v + 1] - skin_.graph.start[v]);
        for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e)
          mean += relaxed[skin_.graph.neighbour[e]];
        next[i] = count > 0 ? Eigen::Vector3f(0.5F * relaxed[v] + 0.5F / count * mean) : relaxed[v];
      }
      for (std::size_t i = 0; i < region.size(); ++i) {
        change[i] += next[i] - relaxed[region[i]];
        relaxed[region[i]] = next[i];
      }
    }
    for (std::size_t i = 0; i < region.size(); ++i) extra[region[i]] += change[i];
    for (std::uint32_t v = 0; v < neutral_.size(); ++v)
      if (skin_.same_as[v] != v && in_region[skin_.same_as[v]] != 0) extra[v] = extra[skin_.same_as[v]];
  }
  return true;
}

SparseDisplacement PoseLab::sparse(const DenseDisplacement& dense) const {
  SparseDisplacement out;
  for (std::uint32_t v = 0; v < dense.size(); ++v) {
    if (!(dense[v].squaredNorm() > 1e-10F * es_ * es_)) continue;
    out.vertex.push_back(v);
    out.displacement.push_back({dense[v][0], dense[v][1], dense[v][2]});
  }
  return out;
}

}  // namespace volto::rig
