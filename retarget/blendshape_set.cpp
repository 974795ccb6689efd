#include "retarget/blendshape_set.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Geometry>

#include "retarget/face_deformer.h"
#include "retarget/shape_relations.h"
#include "rig/closest_point.h"
#include "rig/errors.h"
#include "rig/rigid_motion.h"

namespace volto::retarget {
namespace {

constexpr std::size_t kMaxNameBytes = 200;
constexpr double kStill = 1e-6;            // of the eye separation: a shape that moves no vertex further is empty
constexpr double kNotWorthKeeping = 2e-6;  // of the eye separation: corrections below it are left out
constexpr double kLeastTurn = 1e-4;        // radians

using Follows = rig::RigidPart::Follows;

bool isEye(const rig::RigidPart& part) {
  return part.follows == Follows::left_eye || part.follows == Follows::right_eye;
}

void check(const rig::Rig& rig, std::span<const std::string> names, std::span<const rig::VertexPositions> positions) {
  if (names.empty() || names.size() != positions.size()) throw rig::InputError("no shapes; a set has at least one");
  std::set<std::string> seen;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k].empty()) throw rig::InputError("shape " + std::to_string(k) + " has no name");
    if (names[k].size() > kMaxNameBytes) throw rig::InputError("a shape's name is longer than 200 bytes");
    if (!seen.insert(names[k]).second) throw rig::InputError("two shapes are called '" + names[k] + "'; rename one");
    if (positions[k].rows() != rig.neutral.positions.rows())
      throw rig::InputError("shape '" + names[k] + "' has " + std::to_string(positions[k].rows()) +
                            " vertices, the character " + std::to_string(rig.neutral.vertexCount()));
    if (!positions[k].allFinite()) throw rig::InputError("shape '" + names[k] + "' has a position that is not finite");
  }
}

// The vertex that stands for a feature point: its own, or the nearest to a free position.
std::array<Eigen::Index, kFeaturePointCount> featureVertices(const rig::Rig& rig) {
  std::array<Eigen::Index, kFeaturePointCount> out{};
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    out[p] = rig.feature_vertex[p];
    if (out[p] < 0)
      out[p] = rig::nearestVertex(rig.neutral.positions, rig.feature_positions.row(static_cast<Eigen::Index>(p)));
  }
  return out;
}

std::array<float, 3> toFloat(const Eigen::Vector3d& x) {
  return {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])};
}

std::vector<rig::PartMotion> eyeMotions(const rig::Rig& rig, std::span<const rig::VertexPositions> positions) {
  std::vector<rig::PartMotion> motions;
  for (const rig::RigidPart& part : rig.rigid_parts) {
    if (!isEye(part)) continue;
    rig::PartMotion motion;
    motion.follows = part.follows;
    motion.vertices = part.vertices;
    std::sort(motion.vertices.begin(), motion.vertices.end());
    motion.share.assign(motion.vertices.size(), 1.0F);
    const Eigen::Vector3d pivot(part.centre[0], part.centre[1], part.centre[2]);
    motion.pivot = toFloat(pivot);
    for (std::size_t k = 0; k < positions.size(); ++k) {
      const rig::RigidMotion moved = rig::bestRigidMotion(motion.vertices, rig.neutral.positions, positions[k]);
      const Eigen::AngleAxisd turn(moved.rotation);
      const Eigen::Vector3d shift = moved.rotation * (pivot - moved.centre) + moved.centre + moved.shift - pivot;
      if (std::abs(turn.angle()) < kLeastTurn && shift.norm() < kStill * rig.fapu.fapu.eye_separation) continue;
      motion.turns.push_back({static_cast<std::uint16_t>(k), toFloat(turn.angle() * turn.axis()), toFloat(shift)});
    }
    motions.push_back(std::move(motion));
  }
  return motions;
}

}  // namespace

std::vector<std::string> replaceBlendshapes(rig::Rig& rig, std::span<const std::string> names,
                                            std::span<const rig::VertexPositions> positions) {
  check(rig, names, positions);
  const double es = rig.fapu.fapu.eye_separation;
  std::vector<std::string> still;
  rig.combinations.clear();
  rig.blendshapes.assign(names.size(), {});
  rig.part_motions = eyeMotions(rig, positions);
  for (const std::string& name : names) {
    const std::vector<std::uint16_t> parents = parentsByName(name, names);
    if (parents.empty()) continue;
    rig::Combination& combination = rig.combinations.emplace_back();
    combination.name = name;  // so the shape of this name follows its parents (shape_relations.h)
    for (const std::uint16_t parent : parents) combination.drivers.push_back({parent, false});
  }
  const auto vertex = featureVertices(rig);
  for (std::size_t k = 0; k < names.size(); ++k) {
    rig::Blendshape& shape = rig.blendshapes[k];
    shape.name = names[k];
    double furthest = 0;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      const Eigen::Vector3d by = positions[k].row(vertex[p]) - rig.neutral.positions.row(vertex[p]);
      shape.mask_displacement[p] = toFloat(by);
      furthest = std::max(furthest, by.norm());
    }
    shape.moves_mask = furthest > kStill * es;
    if ((positions[k] - rig.neutral.positions).rowwise().norm().maxCoeff() <= kStill * es) still.push_back(names[k]);
  }

  std::vector<bool> of_eye(rig.neutral.vertexCount(), false);
  for (const rig::PartMotion& motion : rig.part_motions)
    for (const std::uint32_t v : motion.vertices) of_eye[v] = true;
  // What the mask does not say, with everything but contacts in the way: those hold in every pose.
  rig::Contacts contacts;
  std::swap(contacts, rig.contacts);
  const FaceDeformer by_mask(rig);
  std::vector<float> weights(names.size(), 0.0F);
  std::vector<Vertex> reached(rig.neutral.vertexCount());
  for (std::size_t k = 0; k < names.size(); ++k) {
    weights[k] = 1.0F;
    by_mask.deformAtWeights(weights, reached);
    weights[k] = 0.0F;
    rig::SparseDisplacement& correction = rig.blendshapes[k].correction;
    for (std::size_t v = 0; v < reached.size(); ++v) {
      if (of_eye[v]) continue;
      const Eigen::Vector3d missing = positions[k].row(static_cast<Eigen::Index>(v)).transpose() -
                                      Eigen::Map<const Eigen::Vector3f>(reached[v].data()).cast<double>();
      if (missing.norm() <= kNotWorthKeeping * es) continue;
      correction.vertex.push_back(static_cast<std::uint32_t>(v));
      correction.displacement.push_back(toFloat(missing));
    }
  }
  std::swap(contacts, rig.contacts);
  return still;
}

}  // namespace volto::retarget
