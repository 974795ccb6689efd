#include "rig/pose.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace volto::rig {
namespace {

// N vertices that follow each other: their coordinates lie side by side.
template <std::size_t N>
void addSideBySide(const float* __restrict displacement, float weight, float* __restrict positions) {
  for (std::size_t i = 0; i < 3 * N; ++i) positions[i] += weight * displacement[i];
}

// Nine in ten vertices of a correction follow their neighbours in the mesh, too.
void add(const SparseDisplacement& correction, float weight, std::span<Position> positions) {
  constexpr std::size_t kRun = 4;
  const std::vector<std::uint32_t>& vertex = correction.vertex;
  for (std::size_t i = 0; i < vertex.size();) {
    const float* const displacement = correction.displacement[i].data();
    float* const position = positions[vertex[i]].data();
    if (i + kRun <= vertex.size() && vertex[i + kRun - 1] == vertex[i] + kRun - 1) {  // they ascend
      addSideBySide<kRun>(displacement, weight, position);
      i += kRun;
    } else {
      addSideBySide<1>(displacement, weight, position);
      ++i;
    }
  }
}

// Rotation minus one, of axis times angle.
std::array<Position, 3> rotationChange(const std::array<double, 3>& r) {
  const double angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2], angle = std::sqrt(angle2);
  const double a = angle > 1e-8 ? std::sin(angle) / angle : 1.0;
  const double b = angle > 1e-8 ? (1 - std::cos(angle)) / angle2 : 0.5;
  const std::array<std::array<double, 3>, 3> k = {{{0, -r[2], r[1]}, {r[2], 0, -r[0]}, {-r[1], r[0], 0}}};
  std::array<Position, 3> out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double kk = 0;
      for (std::size_t m = 0; m < 3; ++m) kk += k[i][m] * k[m][j];
      out[i][j] = static_cast<float>(a * k[i][j] + b * kk);
    }
  return out;
}

bool isEye(const PartMotion& motion) {
  return motion.follows == RigidPart::Follows::left_eye || motion.follows == RigidPart::Follows::right_eye;
}

void turnPart(const PartMotion& motion, std::span<const float> weights, std::span<Position> positions) {
  std::array<double, 3> rotation{};
  Position translation{};
  for (const PartMotion::Turn& turn : motion.turns)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rotation[axis] += static_cast<double>(weights[turn.shape] * turn.rotation[axis]);
      translation[axis] += weights[turn.shape] * turn.translation[axis];
    }
  const auto zero = [](const auto& a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; };
  if (zero(rotation) && zero(translation)) return;
  const std::array<Position, 3> change = rotationChange(rotation);
  for (std::size_t i = 0; i < motion.vertices.size(); ++i) {
    Position& p = positions[motion.vertices[i]];
    const Position arm = {p[0] - motion.pivot[0], p[1] - motion.pivot[1], p[2] - motion.pivot[2]};
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[axis] += motion.share[i] *
                 (change[axis][0] * arm[0] + change[axis][1] * arm[1] + change[axis][2] * arm[2] + translation[axis]);
  }
}

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("the rig's " + what); }

template <class Numbers>
void requireFinite(const Numbers& numbers, const std::string& what) {
  for (const float x : numbers)
    if (!std::isfinite(x)) refuse(what + " holds a number that is not finite");
}

void requireVertices(const std::vector<std::uint32_t>& vertices, std::size_t count, const std::string& what) {
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (vertices[i] >= count || (i > 0 && vertices[i] <= vertices[i - 1]))
      refuse(what + " names vertices out of order or range");
}

void checkCorrection(const SparseDisplacement& correction, std::size_t vertices, const std::string& what) {
  if (correction.vertex.size() != correction.displacement.size())
    refuse(what + " has more vertices than displacements");
  requireVertices(correction.vertex, vertices, what);
  for (const auto& d : correction.displacement) requireFinite(d, what);
}

void checkSlit(const SlitContact& slit, const Contacts& contacts, std::size_t vertices) {
  const std::string what = "contact between lips or lids";
  const std::size_t columns = slit.upper.size();
  if (columns < 2 || columns > kMaxSlitColumns || slit.lower.size() != columns || slit.least_gap.size() != columns)
    refuse(what + " has columns that do not fit each other");
  if (slit.ball < -1 || slit.ball >= static_cast<std::int32_t>(contacts.balls.size()))
    refuse(what + " names a ball that is not there");
  for (const auto* side : {&slit.upper, &slit.lower})
    for (const SlitContact::Sample& s : *side)
      if (s.first >= vertices || s.second >= vertices || !(s.share_of_second >= 0 && s.share_of_second <= 1))
        refuse(what + " has a sample out of range");
  requireVertices(slit.vertex, vertices, what);
  if (slit.column.size() != slit.vertex.size() || slit.share.size() != slit.vertex.size() ||
      slit.reach.size() != slit.vertex.size())
    refuse(what + " has lists of different lengths");
  requireFinite(slit.up, what);
  requireFinite(slit.least_gap, what);
  requireFinite(slit.reach, what);
  for (std::size_t i = 0; i < slit.vertex.size(); ++i)
    if (!(slit.column[i] >= 0 && slit.column[i] <= static_cast<float>(columns - 1)) ||
        !(slit.share[i] >= -1 && slit.share[i] <= 1))
      refuse(what + " has a column or a share out of range");
  if (!(slit.upper_share >= 0 && slit.upper_share <= 1)) refuse(what + " is shared out of range");
}

void checkFolds(const FoldGuard& guard, std::size_t vertices) {
  const std::string what = "guard against folds";
  const auto inRange = [&](std::uint32_t v) { return v < vertices; };
  if (guard.normal.size() != guard.triangle.size() || guard.least.size() != guard.triangle.size() ||
      guard.watched > guard.triangle.size())
    refuse(what + " has lists of different lengths");
  for (const auto& t : guard.triangle)
    if (!std::all_of(t.begin(), t.end(), inRange)) refuse(what + " names a vertex that is not there");
  for (const auto& pair : guard.copies)
    if (!std::all_of(pair.begin(), pair.end(), inRange)) refuse(what + " names a vertex that is not there");
  for (const auto& n : guard.normal) requireFinite(n, what);
  for (const float least : guard.least)
    if (!(least > 0 && std::isfinite(least))) refuse(what + " wants an area that is not positive");
}

void checkContacts(const Contacts& contacts, std::size_t vertices) {
  for (const BallContact& ball : contacts.balls) {
    requireVertices(ball.vertex, vertices, "contact with an eyeball");
    requireFinite(ball.centre, "contact with an eyeball");
    if (ball.distance.size() != ball.vertex.size() || !(ball.radius > 0 && std::isfinite(ball.radius)))
      refuse("contact with an eyeball does not fit together");
    for (const float d : ball.distance)
      if (!(d > 0 && std::isfinite(d))) refuse("contact with an eyeball has a distance that is not positive");
    if (ball.hold.size() != ball.outer.size() || (!ball.hold.empty() && ball.hold.size() != ball.vertex.size()))
      refuse("contact with an eyeball does not fit together");
    for (const float d : ball.outer)
      if (!(d > 0 && std::isfinite(d))) refuse("contact with an eyeball has a distance that is not positive");
    for (const float h : ball.hold)
      if (!(h >= 0 && h <= 1)) refuse("contact with an eyeball holds by a share out of range");
  }
  checkFolds(contacts.folds, vertices);
  for (const SlitContact& slit : contacts.slits) checkSlit(slit, contacts, vertices);
  for (const Rider& rider : contacts.riders) {
    if (rider.vertex >= vertices || rider.ball < -1 || rider.ball >= static_cast<std::int32_t>(contacts.balls.size()))
      refuse("rider is out of range");
    for (const std::uint32_t a : rider.anchor)
      if (a >= vertices) refuse("rider is out of range");
    requireFinite(rider.weight, "rider");
  }
}

}  // namespace

std::vector<Position> inSinglePrecision(const VertexPositions& positions) {
  std::vector<Position> out(static_cast<std::size_t>(positions.rows()));
  for (std::size_t v = 0; v < out.size(); ++v)
    for (std::size_t axis = 0; axis < 3; ++axis)
      out[v][axis] = static_cast<float>(positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)));
  return out;
}

std::vector<Position> neutralPositions(const Rig& rig) { return inSinglePrecision(rig.neutral.positions); }

void poseByOperator(const Rig& rig, std::span<const float> weights, std::span<const Position> neutral,
                    std::span<Position> positions) {
  std::array<std::array<float, 4>, kFeaturePointCount> mask{};  // four lanes, the last unused
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] == 0) continue;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      for (std::size_t axis = 0; axis < 3; ++axis)
        mask[p][axis] += weights[k] * rig.blendshapes[k].mask_displacement[p][axis];
  }
  const DeformationOperator& op = rig.deformation;
  for (std::size_t v = 0; v < neutral.size(); ++v) {
    std::array<float, 4> p{};
    for (std::uint32_t e = op.row_start[v]; e < op.row_start[v + 1]; ++e) {
      const float weight = op.weight[e];
      const std::array<float, 4>& point = mask[op.point[e]];
      for (std::size_t lane = 0; lane < 4; ++lane) p[lane] += weight * point[lane];
    }
    for (std::size_t axis = 0; axis < 3; ++axis) positions[v][axis] = neutral[v][axis] + p[axis];
  }
}

float weightOf(const Combination& combination, std::span<const float> weights) {
  if (combination.rule == Combination::Rule::excess)
    return std::max(0.0F, weights[combination.drivers[0].shape] - weights[combination.drivers[1].shape]);
  float product = 1;
  for (const Combination::Driver& driver : combination.drivers) {
    const float w = weights[driver.shape];
    product *= driver.halfway ? std::max(0.0F, 4 * w * (1 - w)) : w;
  }
  return product;
}

void putPartsBack(const Rig& rig, std::span<const Position> neutral, std::span<Position> positions) {
  for (const PartMotion& motion : rig.part_motions)
    for (const std::uint32_t v : motion.vertices) positions[v] = neutral[v];
}

void turnParts(const Rig& rig, std::span<const float> weights, bool turn_eyes, std::span<Position> positions) {
  for (const PartMotion& motion : rig.part_motions)
    if (turn_eyes || !isEye(motion)) turnPart(motion, weights, positions);
}

void addToPose(const Rig& rig, std::span<const float> weights, bool turn_eyes, std::span<const Position> neutral,
               std::span<Position> positions) {
  putPartsBack(rig, neutral, positions);
  for (std::size_t k = 0; k < rig.blendshapes.size(); ++k)
    if (std::abs(weights[k]) > kNoWeight) add(rig.blendshapes[k].correction, weights[k], positions);
  for (const Combination& combination : rig.combinations)
    if (const float w = weightOf(combination, weights); std::abs(w) > kNoWeight)
      add(combination.correction, w, positions);
  turnParts(rig, weights, turn_eyes, positions);
}

void pose(const Rig& rig, std::span<const float> weights, std::span<const Position> neutral,
          std::span<Position> positions) {
  poseByOperator(rig, weights, neutral, positions);
  addToPose(rig, weights, true, neutral, positions);
  resolveContacts(rig.contacts, neutral, positions);
}

void checkPoseData(const Rig& rig) {
  const std::size_t vertices = rig.neutral.vertexCount();
  for (const Blendshape& shape : rig.blendshapes)
    checkCorrection(shape.correction, vertices, "correction of " + shape.name);
  for (const Combination& combination : rig.combinations) {
    const std::string what = "combination " + combination.name;
    checkCorrection(combination.correction, vertices, what);
    if (combination.drivers.empty()) refuse(what + " has no drivers");
    if (combination.rule == Combination::Rule::excess && combination.drivers.size() != 2)
      refuse(what + " compares other than two shapes");
    for (const Combination::Driver& driver : combination.drivers)
      if (driver.shape >= rig.blendshapes.size()) refuse(what + " is driven by a shape that is not there");
  }
  for (const PartMotion& motion : rig.part_motions) {
    requireVertices(motion.vertices, vertices, "motion of a part");
    requireFinite(motion.pivot, "motion of a part");
    requireFinite(motion.share, "motion of a part");
    if (motion.share.size() != motion.vertices.size()) refuse("motion of a part has lists of different lengths");
    for (const PartMotion::Turn& turn : motion.turns) {
      requireFinite(turn.rotation, "motion of a part");
      requireFinite(turn.translation, "motion of a part");
      if (turn.shape >= rig.blendshapes.size()) refuse("motion of a part follows a shape that is not there");
    }
  }
  checkContacts(rig.contacts, vertices);
}

}  // namespace volto::rig
