#include "transfer/matched_shapes.h"

#include <cmath>
#include <numeric>
#include <optional>

#include "rig/closest_point.h"
#include "rig/rigid_motion.h"

namespace volto::transfer {
namespace {

constexpr double kRounding = 1e-3;  // of the mesh's size

double sizeOf(const rig::VertexPositions& p) { return (p.colwise().maxCoeff() - p.colwise().minCoeff()).norm(); }

// Turn and unit that put the vertices read onto the neutral's, vertex by vertex; nothing when they do not fit.
std::optional<Eigen::Matrix3d> neutralFromRead(const rig::VertexPositions& neutral, const rig::VertexPositions& read) {
  std::vector<std::uint32_t> all(static_cast<std::size_t>(neutral.rows()));
  std::iota(all.begin(), all.end(), 0U);
  const rig::RigidMotion motion = rig::bestRigidMotion(all, read, neutral);
  const auto spread = [](const rig::VertexPositions& p) {
    return std::sqrt((p.rowwise() - p.colwise().mean()).squaredNorm());
  };
  const double unit = spread(neutral) / spread(read);
  if (!std::isfinite(unit)) return {};
  const Eigen::Matrix3d turn = unit * motion.rotation;
  const rig::VertexPositions reached =
      ((read.rowwise() - read.colwise().mean()) * turn.transpose()).rowwise() + neutral.colwise().mean();
  if ((reached - neutral).rowwise().norm().maxCoeff() > kRounding * sizeOf(neutral)) return {};
  return turn;
}

// For each vertex of the neutral one that was read at its place; empty when one has none.
std::vector<std::uint32_t> byPlace(const rig::Mesh& neutral, const rig::Mesh& read) {
  // Each triangle of one vertex: the tree of boxes finds the nearest.
  std::vector<std::array<std::uint32_t, 3>> points;
  for (std::uint32_t v = 0; v < read.vertexCount(); ++v) points.push_back({v, v, v});
  const rig::ClosestPoint nearest(read.positions, std::move(points));
  std::vector<std::uint32_t> from;
  const double limit = kRounding * sizeOf(neutral.positions);
  for (Eigen::Index v = 0; v < neutral.positions.rows(); ++v) {
    const rig::SurfacePoint hit = nearest.find(neutral.positions.row(v), limit);
    if (hit.triangle < 0) return {};
    from.push_back(nearest.triangle(hit.triangle)[0]);
  }
  return from;
}

}  // namespace

std::vector<rig::VertexPositions> matchedShapes(const rig::Mesh& neutral, const rig::ShapedMesh& read,
                                                const std::string& name_for_errors) {
  std::vector<rig::VertexPositions> out;
  if (neutral.vertexCount() == read.mesh.vertexCount()) {
    if (const auto turn = neutralFromRead(neutral.positions, read.mesh.positions)) {
      for (const rig::VertexPositions& shape : read.positions)
        out.push_back(neutral.positions + (shape - read.mesh.positions) * turn->transpose());
      return out;
    }
  }
  const std::vector<std::uint32_t> from = byPlace(neutral, read.mesh);
  if (from.empty())
    throw rig::InputError(name_for_errors + ": its mesh has " + std::to_string(read.mesh.vertexCount()) +
                          " vertices, the character " + std::to_string(neutral.vertexCount()) +
                          ", and they are not at the same places; give shapes of the character's own mesh");
  for (const rig::VertexPositions& shape : read.positions) {
    rig::VertexPositions moved = neutral.positions;
    for (std::size_t v = 0; v < from.size(); ++v)
      moved.row(static_cast<Eigen::Index>(v)) += shape.row(from[v]) - read.mesh.positions.row(from[v]);
    out.push_back(std::move(moved));
  }
  return out;
}

}  // namespace volto::transfer
