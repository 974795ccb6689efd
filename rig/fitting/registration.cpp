#include "rig/fitting/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "rig/skin.h"

namespace volto::rig {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

struct Stage {
  double stiffness;   // length over which the displacement bends, eye separations
  double reach;       // distance of half belief
  double min_cosine;  // of the normals
};
constexpr std::array<Stage, 8> kStages = {{{0.50, 0.20, 0.50},
                                           {0.36, 0.15, 0.50},
                                           {0.26, 0.11, 0.55},
                                           {0.20, 0.08, 0.60},
                                           {0.15, 0.06, 0.60},
                                           {0.12, 0.05, 0.60},
                                           {0.10, 0.05, 0.60},
                                           {0.08, 0.05, 0.60}}};
// How much of the way along the surface to the nearest point is asked for: little, since in smooth skin it says
// nothing.
constexpr double kTangential = 0.15;

std::vector<bool> boundaryVertices(const Triangles& triangles, std::size_t vertices) {
  std::vector<std::uint64_t> edges;
  for (const auto& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = t[i], b = t[(i + 1) % 3];
      edges.push_back(std::min(a, b) << 32 | std::max(a, b));
    }
  std::sort(edges.begin(), edges.end());
  std::vector<bool> out(vertices, false);
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t j = i + 1;
    while (j < edges.size() && edges[j] == edges[i]) ++j;
    if (j == i + 1) out[edges[i] >> 32] = out[edges[i] & 0xFFFFFFFFU] = true;
    i = j;
  }
  return out;
}

class Sticker {
 public:
  Sticker(const GenericHead& head, const VertexPositions& start, const TargetSurface& target,
          const std::vector<FacePin>& pins)
      : start_(start), target_(target), triangles_(triangulate(head.face)) {
    std::vector<std::uint32_t> same_as(head.face.vertexCount());
    for (std::uint32_t v = 0; v < same_as.size(); ++v) same_as[v] = v;
    const Skin skin = prepareSkin(head.face, std::move(same_as));
    area_ = Eigen::Map<const Eigen::VectorXd>(skin.area.data(), static_cast<Eigen::Index>(skin.area.size()));
    boundary_ = boundaryVertices(triangles_, head.face.vertexCount());
    assembleSmoothness(skin);
    assemblePins(pins);
    displacement_ = VertexPositions::Zero(start.rows(), 3);
    trusted_.assign(head.face.vertexCount(), 1.0);
  }

  RegisteredFace run() {
    for (const Stage& stage : kStages) step(stage);
    RegisteredFace out;
    for (int round = 0; round < 3; ++round) {
      const std::size_t folded = distrustFolds();
      out.folded = std::max(out.folded, folded);
      if (folded == 0) break;
      step(kStages.back());
    }
    out.positions = start_ + displacement_;
    const VertexPositions normals = faceNormals(triangles_, out.positions);
    out.hits.resize(trusted_.size());
    for (std::size_t v = 0; v < trusted_.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      out.hits[v] = target_.find(out.positions.row(row), normals.row(row), 0.3, 0.3);
    }
    return out;
  }

 private:
  void assembleSmoothness(const Skin& skin) {
    const Eigen::Index n = start_.rows();
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd inverse_area(n);
    for (std::uint32_t v = 0; v < skin.same_as.size(); ++v) {
      double sum = 0;
      for (std::uint32_t e = skin.graph.start[v]; e < skin.graph.start[v + 1]; ++e) {
        // Between bounds, so that no vertex is pushed beyond its neighbours: it is the generic head that bends here,
        // always the same mesh.
        const double weight = std::clamp(skin.laplacian[e], 0.02, 20.0);
        entries.emplace_back(v, skin.graph.neighbour[e], weight);
        sum += weight;
      }
      entries.emplace_back(v, v, -sum);
      // On the boundary the Laplacian looks to one side only.
      inverse_area[v] = skin.area[v] > 0 ? (boundary_[v] ? 0.1 : 1.0) / skin.area[v] : 0.0;
    }
    Sparse laplacian(n, n);
    laplacian.setFromTriplets(entries.begin(), entries.end());
    bending_ = laplacian.transpose() * inverse_area.asDiagonal() * laplacian;
    membrane_ = -laplacian;
  }

  void assemblePins(const std::vector<FacePin>& pins) {
    const Eigen::Index n = start_.rows();
    std::vector<Eigen::Triplet<double>> entries;
    pin_right_ = VertexPositions::Zero(n, 3);
    for (const FacePin& pin : pins) {
      Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
      for (std::size_t i = 0; i < 3; ++i) at += pin.place.weights[i] * start_.row(pin.place.vertices[i]);
      const Eigen::RowVector3d wanted = pin.to.transpose() - at;
      for (std::size_t i = 0; i < 3; ++i) {
        pin_right_.row(pin.place.vertices[i]) += pin.weight * pin.place.weights[i] * wanted;
        for (std::size_t j = 0; j < 3; ++j)
          entries.emplace_back(pin.place.vertices[i], pin.place.vertices[j],
                               pin.weight * pin.place.weights[i] * pin.place.weights[j]);
      }
    }
    pin_matrix_.resize(n, n);
    pin_matrix_.setFromTriplets(entries.begin(), entries.end());
  }

  void step(const Stage& stage) {
    const Eigen::Index n = start_.rows();
    const VertexPositions positions = start_ + displacement_;
    const VertexPositions normals = faceNormals(triangles_, positions);
    Eigen::VectorXd weight = Eigen::VectorXd::Zero(n);
    VertexPositions right = pin_right_;
    for (Eigen::Index v = 0; v < n; ++v) {
      const Eigen::Vector3d at = positions.row(v), normal = normals.row(v);
      const SurfaceHit hit = target_.find(at, normal, stage.min_cosine, 3 * stage.reach);
      if (hit.triangle < 0) continue;
      const double ratio = hit.distance / stage.reach;
      double w = trusted_[static_cast<std::size_t>(v)] / ((1 + ratio * ratio) * (1 + ratio * ratio));
      if (target_.onBoundary(hit)) w *= boundary_[static_cast<std::size_t>(v)] ? 0.5 : 0.05;
      w *= area_[v];
      const Eigen::Vector3d& out = target_.normal(hit.triangle);
      const Eigen::Vector3d way = hit.position - at;
      const Eigen::Vector3d along_normal = out * out.dot(way);
      const Eigen::Vector3d wanted = along_normal + kTangential * (way - along_normal);
      weight[v] = w;
      right.row(v) += w * (displacement_.row(v) + wanted.transpose());
    }
    const double s2 = stage.stiffness * stage.stiffness;
    Sparse matrix = s2 * s2 * bending_ + 0.02 * s2 * membrane_ + pin_matrix_;
    Eigen::VectorXd diagonal = weight.array() + 1e-9;
    matrix += Sparse(diagonal.asDiagonal());
    if (!analysed_) solver_.analyzePattern(matrix);
    analysed_ = true;
    solver_.factorize(matrix);
    if (solver_.info() != Eigen::Success) throw std::runtime_error("the face could not be bent onto the mesh");
    displacement_ = solver_.solve(Eigen::MatrixXd(right));
  }

  // Vertices of triangles that turned over against the landmarks' warp stop following the surface. How many triangles.
  std::size_t distrustFolds() {
    const VertexPositions positions = start_ + displacement_;
    std::size_t folded = 0;
    for (const auto& t : triangles_) {
      const auto normal = [&](const VertexPositions& x) {
        const Eigen::Vector3d a = x.row(t[0]), b = x.row(t[1]), c = x.row(t[2]);
        return Eigen::Vector3d((b - a).cross(c - a));
      };
      if (normal(positions).dot(normal(start_)) > 0) continue;
      ++folded;
      for (const std::uint32_t v : t) trusted_[v] *= 0.05;
    }
    return folded;
  }

  const VertexPositions& start_;
  const TargetSurface& target_;
  Triangles triangles_;
  Eigen::VectorXd area_;
  std::vector<bool> boundary_;
  Sparse bending_, membrane_, pin_matrix_;
  VertexPositions pin_right_, displacement_;
  std::vector<double> trusted_;
  Eigen::SimplicialLDLT<Sparse> solver_;
  bool analysed_ = false;
};

}  // namespace

VertexPositions faceNormals(const Triangles& triangles, const VertexPositions& positions) {
  VertexPositions normals = VertexPositions::Zero(positions.rows(), 3);
  for (const auto& t : triangles) {
    const Eigen::Vector3d a = positions.row(t[0]), b = positions.row(t[1]), c = positions.row(t[2]);
    const Eigen::RowVector3d cross = (b - a).cross(c - a).transpose();
    for (const std::uint32_t v : t) normals.row(v) += cross;
  }
  for (Eigen::Index v = 0; v < normals.rows(); ++v) {
    const double length = normals.row(v).norm();
    if (length > 0) normals.row(v) /= length;
  }
  return normals;
}

RegisteredFace registerFace(const GenericHead& head, const VertexPositions& start, const TargetSurface& target,
                            const std::vector<FacePin>& pins) {
  return Sticker(head, start, target, pins).run();
}

}  // namespace volto::rig
