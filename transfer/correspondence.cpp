#include "transfer/correspondence.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "rig/fitting/fit_points.h"
#include "rig/fitting/target_surface.h"
#include "rig/parallel.h"
#include "transfer/mask_transfer.h"

namespace volto::transfer {
namespace {

constexpr double kLeastTrust = 0.05;
constexpr double kFurthestEs = 0.04;      // between a head and the generic head that was stuck to it
constexpr double kLeastCosine = 0.3;      // of the normals of the two
constexpr std::size_t kPairColumns = 15;  // across the mouth and across an eye

// The generic face as it lies on one head.
struct FaceOnHead {
  rig::VertexPositions positions;  // of GenericHead::face, the head's own frame
  std::vector<bool> known;
};

FaceOnHead fitTo(const rig::Rig& rig) {
  rig::FeaturePointChoices points;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (rig.feature_vertex[p] >= 0)
      points[p] = static_cast<std::uint32_t>(rig.feature_vertex[p]);
    else
      points[p] = Eigen::Vector3d(rig.feature_positions.row(static_cast<Eigen::Index>(p)));
  }
  const rig::FittedPoints fitted = rig::fitPoints(rig.neutral, points);
  const rig::GenericHead& head = rig::genericHead();
  FaceOnHead out;
  out.positions.resize(head.face.positions.rows(), 3);
  out.known.resize(head.vertex_of_face.size());
  for (std::size_t f = 0; f < head.vertex_of_face.size(); ++f) {
    const rig::CorrespondingPlace& place = fitted.dense[head.vertex_of_face[f]];
    out.known[f] = place.trust > kLeastTrust;
    Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      at += place.place.weights[i] * rig.neutral.positions.row(place.place.vertices[i]);
    out.positions.row(static_cast<Eigen::Index>(f)) = at;
  }
  return out;
}

std::vector<std::array<std::uint32_t, 3>> trusted(const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                                  const FaceOnHead& a, const FaceOnHead& b) {
  std::vector<std::array<std::uint32_t, 3>> out;
  for (const auto& t : triangles)
    if (std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return a.known[v] && b.known[v]; })) out.push_back(t);
  return out;
}

// Whether the mesh's triangles face outwards as the generic face's do: an inside-out mesh is turned for the search.
bool facesInwards(const rig::VertexPositions& positions, const SkinTriangles& skin, const FaceOnHead& face,
                  const std::vector<std::array<std::uint32_t, 3>>& face_triangles) {
  const rig::TargetSurface surface(positions, skin.triangles);
  double agreement = 0;
  for (std::size_t t = 0; t < face_triangles.size(); t += 7) {
    const Eigen::Vector3d middle =
        (face.positions.row(face_triangles[t][0]) + face.positions.row(face_triangles[t][1]) +
         face.positions.row(face_triangles[t][2])) /
        3;
    const rig::SurfaceHit hit = surface.find(middle, Eigen::Vector3d::Zero(), -1, 1e300);
    if (hit.triangle >= 0) agreement += surface.normal(hit.triangle).dot(normalOf(face.positions, face_triangles[t]));
  }
  return agreement < 0;
}

void turnOver(SkinTriangles& skin) {
  for (auto& t : skin.triangles) std::swap(t[1], t[2]);
}

SurfacePoint pointOf(const rig::SlitContact::Sample& s) {
  return {{s.first, s.second, s.first}, {1.0 - s.share_of_second, s.share_of_second, 0}};
}

}  // namespace

Correspondence correspondThroughGenericHead(const rig::Rig& source, const rig::Rig& target) {
  std::array<FaceOnHead, 2> faces;
  rig::genericHead();  // made once, before two threads want it
  rig::parallelFor(2, [&](std::size_t i) { faces[i] = fitTo(i == 0 ? source : target); });
  const auto generic_triangles = rig::triangulate(rig::genericHead().face);
  const auto both = trusted(generic_triangles, faces[0], faces[1]);
  if (both.empty())
    throw rig::InputError(
        "no place of the face was found on both heads; check their feature points with volto inspect --picture");

  SkinTriangles source_skin = skinTriangles(source), target_skin = skinTriangles(target);
  if (facesInwards(source.neutral.positions, source_skin, faces[0], both)) turnOver(source_skin);
  const bool target_inwards = facesInwards(target.neutral.positions, target_skin, faces[1], both);
  if (target_inwards) turnOver(target_skin);
  const rig::TargetSurface on_source(source.neutral.positions, source_skin.triangles);
  const rig::TargetSurface on_generic(faces[1].positions, both);
  const double target_reach = kFurthestEs * target.fapu.fapu.eye_separation;
  const double source_reach = kFurthestEs * source.fapu.fapu.eye_separation;

  // From a place near the target's skin to the source's skin.
  const auto follow = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& normal) -> std::optional<rig::SurfaceHit> {
    const rig::SurfaceHit generic = on_generic.find(p, normal, kLeastCosine, target_reach);
    if (generic.triangle < 0 || on_generic.onBoundary(generic)) return std::nullopt;
    const auto& t = on_generic.triangle(generic.triangle);
    const rig::SurfaceHit hit =
        on_source.find(at(faces[0].positions, {t, generic.barycentric}), normalOf(faces[0].positions, t), kLeastCosine, source_reach);
    if (hit.triangle < 0) return std::nullopt;
    return hit;
  };

  Correspondence c;
  const std::size_t triangle_count = rig::triangulate(target.neutral).size();
  c.source_triangle.assign(triangle_count, Correspondence::kNone);
  c.source_place.resize(triangle_count);
  c.source_point.resize(target.neutral.vertexCount());
  // Outwards, as the skin's triangles have it.
  rig::VertexPositions normal = rig::VertexPositions::Zero(target.neutral.positions.rows(), 3);
  for (const auto& t : target_skin.triangles) {
    const Eigen::Vector3d a = target.neutral.positions.row(t[0]), b = target.neutral.positions.row(t[1]),
                          d = target.neutral.positions.row(t[2]);
    for (const std::uint32_t v : t) normal.row(v) += (b - a).cross(d - a).transpose();
  }
  rig::parallelFor((target.neutral.vertexCount() + 255) / 256, [&](std::size_t block) {
    for (std::size_t v = 256 * block; v < std::min(256 * (block + 1), target.neutral.vertexCount()); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      if (!(normal.row(row).norm() > 0)) continue;
      const auto hit = follow(target.neutral.positions.row(row), normal.row(row).normalized());
      if (hit) c.source_point[v] = {on_source.triangle(hit->triangle), hit->barycentric};
    }
  });
  rig::parallelFor((target_skin.triangles.size() + 255) / 256, [&](std::size_t block) {
    for (std::size_t s = 256 * block; s < std::min(256 * (block + 1), target_skin.triangles.size()); ++s) {
      const auto& t = target_skin.triangles[s];
      const Eigen::Vector3d middle = (target.neutral.positions.row(t[0]) + target.neutral.positions.row(t[1]) +
                                      target.neutral.positions.row(t[2])) /
                                     3;
      const auto hit = follow(middle, normalOf(target.neutral.positions, t));
      if (!hit) continue;
      const auto index = static_cast<std::size_t>(target_skin.index[s]);
      c.source_triangle[index] = source_skin.index[static_cast<std::size_t>(hit->triangle)];
      c.source_place[index] = {on_source.triangle(hit->triangle), hit->barycentric};
    }
  });
  return c;
}

std::vector<bool> enclosedByCorrespondence(const rig::Mesh& mesh, const Correspondence& correspondence,
                                           std::span<const std::uint32_t> same_as) {
  const std::size_t vertices = mesh.vertexCount();
  std::vector<bool> corresponds(vertices, false);
  for (std::size_t v = 0; v < vertices; ++v) {
    corresponds[same_as[v]] = corresponds[same_as[v]] || !isNone(correspondence.source_point[v]);
  }
  // Connected patches of what does not correspond, over edges of the welded mesh.
  std::vector<std::uint32_t> patch(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) patch[v] = v;
  const auto root = [&](std::uint32_t v) {
    while (patch[v] != v) v = patch[v] = patch[patch[v]];
    return v;
  };
  std::vector<bool> meets(vertices, false);  // by root, afterwards: a corresponding neighbour
  const auto triangles = rig::triangulate(mesh);
  for (const auto& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = same_as[t[i]], b = same_as[t[(i + 1) % 3]];
      if (!corresponds[a] && !corresponds[b]) patch[root(a)] = root(b);
    }
  for (const auto& t : triangles)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        if (const std::uint32_t a = same_as[t[i]]; !corresponds[a] && corresponds[same_as[t[j]]]) meets[root(a)] = true;
  // The largest in space of those on the face's skin is the rest of the head.
  std::vector<Eigen::AlignedBox3d> box(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v)
    if (!corresponds[same_as[v]]) box[root(same_as[v])].extend(mesh.positions.row(v).transpose());
  double largest = -1;
  std::uint32_t rest = 0;
  for (std::uint32_t v = 0; v < vertices; ++v)
    if (meets[v] && box[v].diagonal().norm() > largest) {
      largest = box[v].diagonal().norm();
      rest = v;
    }
  std::vector<bool> out(vertices, false);
  for (std::uint32_t v = 0; v < vertices; ++v)
    if (!corresponds[same_as[v]]) out[v] = meets[root(same_as[v])] && root(same_as[v]) != rest;
  return out;
}

std::vector<SlitPair> slitPairs(const rig::Rig& source, const rig::Rig& target) {
  std::vector<SlitPair> pairs;
  const double size = target.fapu.fapu.eye_separation / source.fapu.fapu.eye_separation;
  for (const rig::SlitContact& t : target.contacts.slits) {
    for (const rig::SlitContact& s : source.contacts.slits) {
      if (s.place != t.place) continue;
      for (std::size_t k = 1; k + 1 < kPairColumns; ++k) {
        const double along = static_cast<double>(k) / (kPairColumns - 1);
        const auto of = [&](const rig::SlitContact& slit) {
          return static_cast<std::size_t>(std::lround(along * static_cast<double>(slit.upper.size() - 1)));
        };
        SlitPair pair;
        const std::size_t tk = of(t), sk = of(s);
        pair.target_upper = pointOf(t.upper[tk]);
        pair.target_lower = pointOf(t.lower[tk]);
        pair.source_upper = pointOf(s.upper[sk]);
        pair.source_lower = pointOf(s.lower[sk]);
        // An open slit closes when the source's does. Where one of the two is closed at rest there is no such ratio.
        const double target_gap =
            (at(target.neutral.positions, t.upper[tk]) - at(target.neutral.positions, t.lower[tk])).norm() / target.fapu.fapu.eye_separation;
        const double source_gap =
            (at(source.neutral.positions, s.upper[sk]) - at(source.neutral.positions, s.lower[sk])).norm() / source.fapu.fapu.eye_separation;
        const bool open = target_gap > 0.02 && source_gap > 0.02;
        pair.gap_scale = size * (open ? target_gap / source_gap : 1.0);
        pairs.push_back(pair);
      }
    }
  }
  return pairs;
}

}  // namespace volto::transfer
