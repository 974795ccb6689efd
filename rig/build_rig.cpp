#include "rig/build_rig.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

#include "rig/association.h"
#include "rig/closest_point.h"
#include "rig/corrections.h"
#include "rig/find_contacts.h"
#include "rig/head_frame.h"
#include "rig/lining.h"
#include "rig/part_motion.h"
#include "rig/rigid_parts.h"
#include "rig/skin_rows.h"
#include "rig/subdivision.h"
#include "rig/weld.h"

namespace volto::rig {
namespace {

std::string idOf(std::size_t point) { return std::string(featurePoints()[point].id); }
std::size_t pointIndex(std::string_view id) { return featurePointIndex(id).value(); }

void checkMesh(const Mesh& mesh) {
  if (mesh.vertexCount() == 0) throw InputError("the mesh has no vertices");
  if (mesh.polygonCount() == 0) throw InputError("the mesh has no faces; nothing can be rigged");
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    if (!mesh.positions.row(v).allFinite())
      throw InputError("vertex " + std::to_string(v) + " of the mesh has a position that is not finite");
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    if (mesh.polygon_start[p + 1] < mesh.polygon_start[p] + 3 ||
        mesh.polygon_start[p + 1] > mesh.corner_vertices.size())
      throw InputError("polygon " + std::to_string(p) + " of the mesh has fewer than 3 corners");
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c)
      if (mesh.corner_vertices[c] >= mesh.vertexCount())
        throw InputError("polygon " + std::to_string(p) + " names vertex " + std::to_string(mesh.corner_vertices[c]) +
                         ", the mesh has " + std::to_string(mesh.vertexCount()));
  }
}

// Feature points as vertices and positions, checked.
void placePoints(const Mesh& mesh, const FeaturePointChoices& choices, Rig& rig) {
  std::string missing;
  std::size_t missing_count = 0;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    if (!choices.contains(p)) {
      if (!missing.empty()) missing += ' ';
      missing += idOf(p);
      ++missing_count;
    }
  if (missing_count > 0)
    throw InputError(std::to_string(missing_count) + " of 84 feature points are missing: " + missing +
                     "; give each a vertex or a position");
  for (const auto& [p, choice] : choices) {
    if (p >= kFeaturePointCount)
      throw InputError("feature point number " + std::to_string(p) + " is not one of the 84");
    const auto row = static_cast<Eigen::Index>(p);
    if (const auto* vertex = std::get_if<std::uint32_t>(&choice)) {
      if (*vertex >= mesh.vertexCount())
        throw InputError("feature point " + idOf(p) + " is vertex " + std::to_string(*vertex) + ", the mesh has " +
                         std::to_string(mesh.vertexCount()) + " (counted from 0)");
      rig.feature_vertex[p] = static_cast<std::int32_t>(*vertex);
      rig.feature_positions.row(row) = mesh.positions.row(*vertex);
    } else {
      rig.feature_vertex[p] = -1;
      rig.feature_positions.row(row) = std::get<Eigen::Vector3d>(choice).transpose();
      if (!rig.feature_positions.row(row).allFinite())
        throw InputError("feature point " + idOf(p) + " has a position that is not finite");
    }
  }
  const Eigen::Vector3d low = rig.feature_positions.colwise().minCoeff(),
                        high = rig.feature_positions.colwise().maxCoeff();
  const double mesh_size = (mesh.positions.colwise().maxCoeff() - mesh.positions.colwise().minCoeff()).norm();
  const double size = (high - low).norm();
  if (!(size > 1e-6 * mesh_size)) throw InputError("all feature points are in one place");
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    for (std::size_t q = 0; q < p; ++q) {
      // Closed lips and lids may touch, and may even be one vertex (rig/rig_health.h tells); nothing else may.
      if (opposite(slitSide(p), slitSide(q))) continue;
      if (rig.feature_vertex[p] >= 0 && rig.feature_vertex[p] == rig.feature_vertex[q])
        throw InputError("feature points " + idOf(q) + " and " + idOf(p) + " are the same vertex " +
                         std::to_string(rig.feature_vertex[p]));
      const double apart = (rig.feature_positions.row(static_cast<Eigen::Index>(p)) -
                            rig.feature_positions.row(static_cast<Eigen::Index>(q)))
                               .norm();
      if (apart <= 1e-9 * size)
        throw InputError("feature points " + idOf(q) + " and " + idOf(p) + " are in the same place");
    }
}

// One row of the operator and one row of the sparse system for each vertex around the face: a million take some four
// minutes of processor time and five gigabytes.
constexpr std::size_t kMaxMovingVertices = 1'000'000;

// Before anything is done: how many vertices could move at most.
void requireSolvable(const Mesh& mesh, const FeaturePointPositions& points, double fade_out) {
  if (mesh.vertexCount() <= kMaxMovingVertices) return;
  const Eigen::RowVector3d low = points.colwise().minCoeff().array() - fade_out;
  const Eigen::RowVector3d high = points.colwise().maxCoeff().array() + fade_out;
  std::size_t near = 0;
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    near += (mesh.positions.row(v).array() >= low.array()).all() && (mesh.positions.row(v).array() <= high.array()).all()
                ? 1U
                : 0U;
  if (near > kMaxMovingVertices)
    throw InputError(std::to_string(near) + " vertices lie around the face, more than the " +
                     std::to_string(kMaxMovingVertices) +
                     " that can be rigged; reduce the mesh (its feature points may be given as positions)");
}

double eyeSeparation(const FeaturePointPositions& points) {
  const auto at = [&](std::string_view id) -> Eigen::Vector3d {
    return points.row(static_cast<Eigen::Index>(pointIndex(id)));
  };
  return ((at("3.7") + at("3.11")) / 2 - (at("3.8") + at("3.12")) / 2).norm();
}

std::vector<Slit> slits(const FeaturePointPositions& points) {
  const auto chain = [&](std::initializer_list<std::string_view> ids) {
    std::vector<Eigen::Vector3d> out;
    for (const auto id : ids) out.emplace_back(points.row(static_cast<Eigen::Index>(pointIndex(id))));
    return out;
  };
  return {{chain({"2.5", "2.7", "2.2", "2.6", "2.4"}), chain({"2.5", "2.9", "2.3", "2.8", "2.4"})},
          {chain({"3.11", "12.5", "3.1", "12.6", "3.7"}), chain({"3.11", "12.7", "3.3", "12.8", "3.7"})},
          {chain({"3.8", "12.9", "3.2", "12.10", "3.12"}), chain({"3.8", "12.11", "3.4", "12.12", "3.12"})}};
}

// The components that carry the feature points: those of chosen vertices, and the one that most free positions are
// nearest to.
std::vector<bool> skinComponents(const Mesh& mesh, const Skin& skin, const Rig& rig) {
  std::vector<std::size_t> votes(*std::max_element(skin.component.begin(), skin.component.end()) + std::size_t{1}, 0);
  std::vector<bool> is_skin(votes.size(), false);
  std::optional<ClosestPoint> surface;  // only where a position asks for it
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (rig.feature_vertex[p] >= 0) {
      const std::uint32_t c = skin.component[static_cast<std::size_t>(rig.feature_vertex[p])];
      is_skin[c] = true;
      ++votes[c];
      continue;
    }
    if (!surface) surface.emplace(mesh.positions, skin.triangles);
    const SurfacePoint nearest = surface->find(rig.feature_positions.row(static_cast<Eigen::Index>(p)).transpose());
    if (nearest.triangle >= 0) ++votes[skin.component[surface->triangle(nearest.triangle)[0]]];
  }
  if (surface)
    is_skin[static_cast<std::size_t>(std::max_element(votes.begin(), votes.end()) - votes.begin())] = true;
  return is_skin;
}

// Farther off the skin than this, a position is a mistake; nearer, it lies on a mask a little outside the mesh.
constexpr double kFarthestOffSkinEs = 0.5;

SkinPoints pointsOnSkin(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin, const Rig& rig,
                        double eye_separation) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto& t : skin.triangles)
    if (is_skin[skin.component[t[0]]]) triangles.push_back(t);
  if (triangles.empty()) throw InputError("the feature points are on no face of the mesh");
  std::optional<ClosestPoint> surface;  // only where a position asks for it
  SkinPoints out(kFeaturePointCount);
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (rig.feature_vertex[p] >= 0) {
      out[p] = {{{skin.same_as[static_cast<std::size_t>(rig.feature_vertex[p])], 0.0F}}, {1.0}};
      continue;
    }
    const Eigen::Vector3d at = rig.feature_positions.row(static_cast<Eigen::Index>(p));
    if (!surface) surface.emplace(mesh.positions, std::move(triangles));
    const SurfacePoint nearest = surface->find(at);
    if (nearest.distance > kFarthestOffSkinEs * eye_separation)
      throw InputError("feature point " + idOf(p) + " lies more than half an eye separation off the surface (at " +
                       std::to_string(nearest.distance) + "); move it onto the skin");
    const auto& corners = surface->triangle(nearest.triangle);
    for (std::size_t i = 0; i < 3; ++i) {
      if (nearest.barycentric[i] > 1 - 1e-6) {
        out[p] = {{{corners[i], 0.0F}}, {1.0}};
        break;
      }
      out[p].around.push_back(
          {corners[i], static_cast<float>((mesh.positions.row(corners[i]).transpose() - at).norm())});
      out[p].weight.push_back(nearest.barycentric[i]);
    }
  }
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    for (std::size_t q = 0; q < p; ++q)
      if (!opposite(slitSide(p), slitSide(q)) && out[p].isVertex() && out[q].isVertex() && out[p].around.front().vertex == out[q].around.front().vertex)
        throw InputError("feature points " + idOf(q) + " and " + idOf(p) + " are in the same place on the skin");
  return out;
}

// A mesh whose polygons run clockwise has its normals inside: at the feature points they must agree with the mask's.
void turnNormalsOutward(const FeaturePointPositions& points, const SkinPoints& on_skin, Skin& skin) {
  double agreement = 0;
  for (const MaskTriangle& t : maskTriangles()) {
    const Eigen::Vector3d a = points.row(t[0]), b = points.row(t[1]), c = points.row(t[2]);
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    for (const std::uint8_t p : t)
      for (const GeodesicSource& s : on_skin[p].around)
        agreement += normal.dot(skin.normals.row(s.vertex)) > 0 ? 1 : -1;
  }
  if (agreement < 0) skin.normals = -skin.normals;
}

// One row per vertex, the same for vertices that stand for each other.
SparseRows perVertex(const SkinRows& rows) {
  SparseRows out;
  out.start.reserve(rows.row_of_vertex.size() + 1);
  for (const std::int32_t r : rows.row_of_vertex) {
    if (r >= 0) {
      const auto points = rows.rows.points(static_cast<std::size_t>(r));
      const auto weights = rows.rows.weights(static_cast<std::size_t>(r));
      out.point.insert(out.point.end(), points.begin(), points.end());
      out.weight.insert(out.weight.end(), weights.begin(), weights.end());
    }
    out.start.push_back(out.point.size());
  }
  return out;
}

DeformationOperator compressed(const SkinRows& rows) {
  const SparseRows all = perVertex(rows);
  DeformationOperator out;
  out.row_start.assign(all.start.begin(), all.start.end());
  out.point.assign(all.point.begin(), all.point.end());
  out.weight = all.weight;
  return out;
}

// `skin_rows`: the operator of the 84 points before parts were placed; `all_rows`: with them.
RefinedMask refinedMask(const SkinProblem& problem, const MaskOnSkin& mask, const SkinRows& skin_rows,
                        const SkinRows& all_rows, const PlacedParts& placed, const Rig& rig) {
  RefinedMask out;
  out.positions = mask.geometry.points;
  out.triangles = mask.geometry.triangles;
  out.base_triangle = mask.geometry.base_triangle;
  RowBuilder row(mask.geometry.pointCount());
  for (std::size_t p = 0; p < mask.points.size(); ++p) {
    if (p < kFeaturePointCount) {
      out.vertex.push_back(rig.feature_vertex[p]);
      row.add(p, 1.0);
    } else {
      const std::uint32_t v = mask.points[p].around.front().vertex;
      out.vertex.push_back(static_cast<std::int32_t>(v));
      if (skin_rows.moves(v)) row.addRow(skin_rows.rows, static_cast<std::size_t>(skin_rows.row_of_vertex[v]), 1.0);
    }
    row.finish(out.from_feature_points);
  }
  SkinRows rows = SkinInterpolation(problem, mask).rows();
  // Parts: what follows the skin follows the refined skin; jaws and what else knows only feature points stays as it is.
  for (std::uint32_t v = 0; v < rows.row_of_vertex.size(); ++v)
    if (rows.row_of_vertex[v] < 0 && all_rows.moves(v)) {
      row.addRow(all_rows.rows, static_cast<std::size_t>(all_rows.row_of_vertex[v]), 1.0);
      rows.set(v, row);
    }
  for (const PlacedParts::Binding& binding : placed.bindings) {
    for (const auto& [of, weight] : binding.of)
      if (rows.moves(of)) row.addRow(rows.rows, static_cast<std::size_t>(rows.row_of_vertex[of]), weight);
    row.dropSmall();
    rows.set(binding.vertex, row);
  }
  out.to_vertices = perVertex(rows);
  return out;
}

std::vector<Blendshape> arkitBlendshapes(const Rig& rig) {
  const ExpressionTable& table = ExpressionTable::standard();
  const FeaturePointPositions scale = fapuScale(rig.fapu.fapu);
  std::vector<Blendshape> out(kArkitBlendshapeCount);
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    out[k].name = kArkitBlendshapeNames[k];
    out[k].moves_mask = table.movesMask(k);
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      const auto row = static_cast<Eigen::Index>(p);
      const Eigen::Vector3d head =
          table.basis().block<3, 1>(3 * row, static_cast<Eigen::Index>(k)).cwiseProduct(scale.row(row).transpose());
      const Eigen::Vector3d mesh = rig.mesh_from_head * head;
      for (int axis = 0; axis < 3; ++axis)
        out[k].mask_displacement[p][static_cast<std::size_t>(axis)] = static_cast<float>(mesh[axis]);
    }
  }
  return out;
}

}  // namespace

Rig buildRig(const Mesh& neutral, const FeaturePointChoices& points, const RigOptions& options) {
  if (!(options.fade_out_es >= 0.1 && options.fade_out_es <= 5) ||
      !(options.blend_width >= 0 && options.blend_width <= 5))
    throw InputError("rig options: fade_out_es must be 0.1 to 5 and blend_width 0 to 5");
  checkMesh(neutral);
  Rig rig;
  rig.mesh_file = options.mesh_file;
  rig.name = !options.name.empty() ? options.name : std::filesystem::path(options.mesh_file).stem().string();
  rig.neutral = neutral;
  placePoints(neutral, points, rig);
  const double eye_separation = eyeSeparation(rig.feature_positions);
  const double size = (rig.feature_positions.colwise().maxCoeff() - rig.feature_positions.colwise().minCoeff()).norm();
  if (!(eye_separation > 1e-3 * size))
    throw InputError(
        "the corners of both eyes (3.7 3.11, 3.8 3.12) are in one place; the eye separation is what a face is measured "
        "by");

  requireSolvable(neutral, rig.feature_positions, options.fade_out_es * eye_separation);
  try {
    rig.mesh_from_head = meshFromHead(rig.feature_positions);
    rig.fapu = measureFapu(rig.feature_positions * rig.mesh_from_head);  // each row is turned by the inverse
  } catch (const std::invalid_argument& e) {
    throw InputError(std::string("the feature points are not those of a face: ") + e.what());
  }

  const std::vector<Slit> closed = slits(rig.feature_positions);
  std::vector<std::uint32_t> same_as = weldSeams(neutral, closed);
  const std::vector<TVertex> t_vertices = findTVertices(neutral, same_as, closed);
  const Mesh joined = t_vertices.empty() ? Mesh() : joinTVertices(neutral, same_as, t_vertices);
  Skin skin = prepareSkin(neutral, t_vertices.empty() ? neutral : joined, std::move(same_as));
  const std::vector<bool> is_skin = skinComponents(neutral, skin, rig);
  const SkinPoints on_skin = pointsOnSkin(neutral, skin, is_skin, rig, eye_separation);
  turnNormalsOutward(rig.feature_positions, on_skin, skin);

  const MaskGeometry mask = controlMaskGeometry(rig.feature_positions, options.edits);
  SkinAssociation association =
      associateSkin(neutral, skin, is_skin, mask, on_skin, eye_separation, options.fade_out_es * eye_separation);
  const std::vector<SkinTie> lining = findLining(neutral, skin, is_skin, association, eye_separation);
  const SkinProblem problem{neutral, skin, association, on_skin, eye_separation, options.blend_width, options.edits,
                            t_vertices, lining};
  const MaskOnSkin control = controlMaskOnSkin(problem, mask);
  SkinRows rows = SkinInterpolation(problem, control).rows();
  const SkinRows skin_rows = options.subdivision.any() ? rows : SkinRows{};
  std::optional<MaskOnSkin> refined;
  if (options.subdivision.any()) refined = subdivide(problem, control, options.subdivision, options.examples);

  for (std::uint32_t v = 0; v < neutral.vertexCount(); ++v) {
    association.triangle[v] = association.triangle[skin.same_as[v]];
    association.side[v] = association.side[skin.same_as[v]];
  }
  const std::vector<AssociationKind> skin_kind = association.kind;
  for (std::uint32_t v = 0; v < neutral.vertexCount(); ++v) association.kind[v] = skin_kind[skin.same_as[v]];
  const PlacedParts placed = placeParts(neutral, skin, is_skin,
                                        {rig.feature_positions, rig.mesh_from_head, eye_separation}, options.parts,
                                        association, rows);
  rig.deformation = compressed(rows);
  if (refined) {
    std::vector<AssociationKind> all_kinds = std::exchange(association.kind, skin_kind);  // its equations are the skin's
    rig.refined = refinedMask(problem, *refined, skin_rows, rows, placed, rig);
    association.kind = std::move(all_kinds);
  }
  rig.rigid_parts = placed.parts;
  rig.contacts = findContacts(rig, skin, association, on_skin);
  rig.association.triangle = std::move(association.triangle);
  rig.association.kind = std::move(association.kind);
  const RegionsOfInfluence regions = regionsOfInfluence(mask, options.edits);
  for (std::size_t t = 0; t < kMaskTriangleCount; ++t)
    rig.region_of_influence[t].assign(regions.points[t].begin(), regions.points[t].end());
  rig.blendshapes = arkitBlendshapes(rig);
  rig.part_motions = partMotions(rig);
  makeCorrections(rig, skin);
  rig.contacts.folds = guardAgainstFolds(rig, skin);
  return rig;
}

}  // namespace volto::rig
