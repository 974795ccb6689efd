#include "rig/fold_guard.h"

#include <algorithm>
#include <cmath>

#include "rig/combined_expressions.h"
#include "rig/contacts.h"
#include "rig/parallel.h"
#include "rig/pose.h"
#include "rig/rig.h"
#include "rig/skin.h"
#include "rig/unfold_rounds.h"
#include "rig/vec3.h"

namespace volto::rig {
namespace {

constexpr float kGiven = 3;          // of `least`, to a triangle that has less than it
constexpr float kLeast = 0.01F;      // of its area at rest
constexpr float kWatched = 0.5F;     // a triangle that some expression brings below this share of its area
constexpr float kLeastArea = 1e-9F;  // in squares of the eye separation: what is smaller at rest has no direction

// Gives a triangle what it lacks. Returns whether it lacked something; `moved`: and could be helped.
[[gnu::always_inline]] inline bool bringBack(const FoldGuard& guard, std::size_t i, std::span<Vec3> positions,
                                             bool& moved) {
  moved = false;
  const auto& [a, b, c] = guard.triangle[i];
  const Vec3 &pa = positions[a], &pb = positions[b], &pc = positions[c], &n = guard.normal[i];
  const Vec3 ab = pb - pa, ac = pc - pa;
  const float shown = dot(n, cross(ab, ac));
  if (!(shown < guard.least[i])) return false;
  // Gradients: each corner straight away from the opposite edge, as seen along n.
  const Vec3 of_a = cross(pb - pc, n), of_b = cross(ac, n), of_c = cross(n, ab);
  const float squared = dot(of_a, of_a) + dot(of_b, of_b) + dot(of_c, of_c);
  if (!(squared > 2 * guard.least[i])) return true;  // shrunk to a point: there is no way out of it
  // More than what is missing, so that rounds end.
  const float by = (kGiven * guard.least[i] - shown) / squared;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    positions[a][axis] += by * of_a[axis];
    positions[b][axis] += by * of_b[axis];
    positions[c][axis] += by * of_c[axis];
  }
  moved = true;
  return true;
}

void moveCopies(const FoldGuard& guard, std::span<Vec3> positions) {
  for (const auto& [copy, original] : guard.copies) positions[copy] = positions[original];
}

}  // namespace

std::size_t unfoldFirst(const FoldGuard& guard, std::size_t count, TouchedVertices& now, std::span<Vec3> positions) {
  std::size_t lacking = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bool moved = false;
    lacking += bringBack(guard, i, positions, moved) ? 1 : 0;
    if (!moved) continue;
    for (const std::uint32_t v : guard.triangle[i]) now.add(v);
  }
  if (lacking > 0) moveCopies(guard, positions);
  return lacking;
}

TriangleBlocks::TriangleBlocks(const FoldGuard& guard)
    : size_(std::max<std::size_t>(8, (guard.triangle.size() + kMostBlocks - 1) / kMostBlocks)) {
  for (std::size_t i = 0; i < guard.triangle.size(); ++i)
    for (const std::uint32_t v : guard.triangle[i]) groups_[i / size_] |= TouchedVertices::groupOf(v);
}

std::size_t unfoldAround(const FoldGuard& guard, const TriangleBlocks& blocks, TouchedVertices& reach,
                         TouchedVertices& now, std::span<Vec3> positions) {
  std::size_t lacking = 0;
  const std::size_t count = guard.triangle.size(), size = blocks.size();
  for (std::size_t first = 0, block = 0; first < count; first += size, ++block) {
    // Where no triangle is reached, none is moved that could reach another one of the block.
    if ((blocks.groups(block) & reach.groups()) == 0) continue;
    const std::size_t end = std::min(first + size, count);
    for (std::size_t i = first; i < end; ++i) {
      if (!reach.hasAny(guard.triangle[i])) continue;
      bool moved = false;
      lacking += bringBack(guard, i, positions, moved) ? 1 : 0;
      if (!moved) continue;
      for (const std::uint32_t v : guard.triangle[i]) {
        reach.add(v);
        now.add(v);
      }
    }
  }
  if (lacking > 0) moveCopies(guard, positions);
  return lacking;
}

FoldGuard guardAgainstFolds(const Rig& rig, const Skin& skin) {
  const std::vector<Position> neutral = neutralPositions(rig);
  const auto es = static_cast<float>(rig.fapu.fapu.eye_separation);
  const auto moves = [&](std::uint32_t v) {
    return (rig.association.kind[v] == AssociationKind::ray || rig.association.kind[v] == AssociationKind::geodesic) &&
           rig.deformation.row_start[v] < rig.deformation.row_start[v + 1];
  };
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec3> normals;
  std::vector<float> areas;
  for (std::array<std::uint32_t, 3> t : triangulate(rig.neutral)) {
    if (!std::all_of(t.begin(), t.end(), moves)) continue;
    for (std::uint32_t& v : t) v = skin.same_as[v];
    const Vec3 normal = cross(neutral[t[1]] - neutral[t[0]], neutral[t[2]] - neutral[t[0]]);
    const float area = std::sqrt(dot(normal, normal));
    if (!(area > kLeastArea * es * es)) continue;
    triangles.push_back(t);
    normals.push_back({normal[0] / area, normal[1] / area, normal[2] / area});
    areas.push_back(area);
  }

  // Every shape half way and all the way, every pair that has a correction, every combined expression.
  std::vector<std::vector<float>> poses;
  Contacts contacts = rig.contacts;
  contacts.folds = {};
  contacts.riders.clear();
  const std::vector<float> nothing(rig.blendshapes.size(), 0.0F);
  for (std::size_t k = 0; k < nothing.size(); ++k)
    for (const float w : {0.5F, 1.0F}) {
      poses.push_back(nothing);
      poses.back()[k] = w;
    }
  for (const Combination& combination : rig.combinations) {
    poses.push_back(nothing);
    for (const Combination::Driver& driver : combination.drivers)
      poses.back()[driver.shape] = driver.halfway ? 0.5F : 1.0F;
  }
  for (const NamedPose& pose : combinedExpressions()) {
    poses.push_back(nothing);
    for (const auto& [name, weight] : pose.weights)
      for (std::size_t k = 0; k < nothing.size(); ++k)
        if (rig.blendshapes[k].name == name) poses.back()[k] = weight;
  }
  // Some threads with a share of the poses each: what one of them sees is watched.
  constexpr std::size_t kShares = 4;
  std::array<std::vector<std::uint8_t>, kShares> seen;
  parallelFor(kShares, [&](std::size_t share) {
    seen[share].assign(triangles.size(), 0);
    std::vector<Position> positions(neutral.size());
    for (std::size_t i = share; i < poses.size(); i += kShares) {
      poseByOperator(rig, poses[i], neutral, positions);
      addToPose(rig, poses[i], false, neutral, positions);
      resolveContacts(contacts, neutral, positions);
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto& [a, b, c] = triangles[t];
        const Vec3 now = cross(positions[b] - positions[a], positions[c] - positions[a]);
        if (dot(normals[t], now) < kWatched * areas[t]) seen[share][t] = 1;
      }
    }
  });
  std::vector<std::uint8_t> watched(triangles.size(), 0);
  for (const std::vector<std::uint8_t>& by_one : seen)
    for (std::size_t t = 0; t < watched.size(); ++t) watched[t] |= by_one[t];

  // And the rims of lids and lips, which every mixture of expressions presses against each other.
  constexpr float kRim = 0.9F;
  std::vector<std::uint8_t> rim(neutral.size(), 0);
  for (const SlitContact& slit : contacts.slits)
    for (std::size_t i = 0; i < slit.vertex.size(); ++i)
      if (std::abs(slit.share[i]) > kRim) rim[skin.same_as[slit.vertex[i]]] = 1;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (std::any_of(triangles[t].begin(), triangles[t].end(), [&](std::uint32_t v) { return rim[v] != 0; }))
      watched[t] = 1;

  // Two rings around: what may have to give way.
  std::vector<std::uint8_t> near(neutral.size(), 0), in(triangles.size(), 0);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (watched[t] != 0)
      for (const std::uint32_t v : triangles[t]) near[v] = 1;
  for (int ring = 0; ring < 2; ++ring) {
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (const std::uint32_t v : triangles[t])
        if (near[v] != 0) in[t] = 1;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if (in[t] != 0)
        for (const std::uint32_t v : triangles[t]) near[v] = 1;
  }
  FoldGuard out;
  for (const bool first : {true, false}) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      if (in[t] == 0 || (watched[t] != 0) != first) continue;
      out.triangle.push_back(triangles[t]);
      out.normal.push_back(normals[t]);
      out.least.push_back(kLeast * areas[t]);
    }
    if (first) out.watched = out.triangle.size();
  }
  for (std::uint32_t v = 0; v < neutral.size(); ++v)
    if (skin.same_as[v] != v && near[skin.same_as[v]] != 0 && neutral[v] == neutral[skin.same_as[v]])
      out.copies.push_back({v, skin.same_as[v]});
  return out;
}

}  // namespace volto::rig
