#include "retarget/expression_health.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "rig/control_mask.h"
#include "rig/parallel.h"

namespace volto::retarget {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Nothing is deeper than this without its neighbours being less deep; a nearest point farther away is another part of
// the skin.
constexpr double kDeepest = 0.03;

Eigen::Vector3d at(std::span<const Vertex> positions, std::uint32_t v) {
  const Vertex& p = positions[v];
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Eigen::Vector3d normalOf(std::span<const Vertex> positions, const Triangle& t) {
  const Eigen::Vector3d a = at(positions, t[0]);
  return (at(positions, t[1]) - a).cross(at(positions, t[2]) - a);
}

// One side of a slit: the skin that gives way there.
struct Side {
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> probes;  // near the margin
  std::map<std::uint32_t, bool> border;
  std::map<std::uint32_t, std::vector<std::uint32_t>> around;  // triangles of a vertex
};

// The two sides of a slit and how deep each is in the other at rest.
struct SlitSides {
  rig::SlitContact::Place place;
  Side upper, lower;
  std::vector<double> upper_rest, lower_rest;
};

}  // namespace

struct HealthMeasure::State {
  const FaceDeformer deformer;
  std::vector<rig::Blendshape> shapes;
  std::vector<std::string> names;
  rig::Contacts contacts;
  rig::DeformationOperator op;
  std::vector<Triangle> triangles;
  std::vector<Vertex> neutral, positions;
  std::vector<Eigen::Vector3d> rest_normal;
  std::vector<bool> of_skin;  // per triangle
  std::vector<SlitSides> slits;
  std::vector<std::uint8_t> unmoved;
  double es, outward = 1;  // -1: polygons run clockwise, normals point inwards
  std::array<std::int32_t, kFeaturePointCount> feature_vertex{};
  Eigen::Matrix3d mesh_from_head;

  explicit State(const rig::Rig& rig)
      : deformer(rig),
        contacts(rig.contacts),
        triangles(rig::triangulate(rig.neutral)),
        neutral(rig.neutral.vertexCount()),
        positions(neutral.size()),
        unmoved(neutral.size(), 0),
        es(rig.fapu.fapu.eye_separation),
        feature_vertex(rig.feature_vertex),
        mesh_from_head(rig.mesh_from_head) {
    for (const rig::Blendshape& shape : rig.blendshapes) names.push_back(shape.name);
    for (std::size_t v = 0; v < neutral.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        neutral[v][axis] =
            static_cast<float>(rig.neutral.positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)));
      }
      unmoved[v] = rig.deformation.row_start[v] == rig.deformation.row_start[v + 1] ? 1 : 0;
    }
    for (const rig::RigidPart& part : rig.rigid_parts) {
      for (const std::uint32_t v : part.vertices) unmoved[v] = 0;
    }
    for (const Triangle& t : triangles) {
      rest_normal.push_back(normalOf(neutral, t));
      of_skin.push_back(std::none_of(t.begin(), t.end(), [&](std::uint32_t v) {
        return rig.association.kind[v] == rig::AssociationKind::rigid_part;
      }));
    }
    outward = sideOfNormals(rig);
    for (const rig::SlitContact& slit : contacts.slits) addSlit(slit);
  }

  // Which way the face's triangles look, beside those of the mask over them.
  double sideOfNormals(const rig::Rig& rig) const {
    double agreement = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const std::uint32_t v = triangles[t][0];
      if (rig.association.kind[v] != rig::AssociationKind::ray) continue;
      const auto& mask = rig::maskTriangles()[static_cast<std::size_t>(rig.association.triangle[v])];
      const auto corner = [&](std::size_t k) -> Eigen::Vector3d { return rig.feature_positions.row(mask[k]); };
      agreement +=
          rest_normal[t].dot((corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized());
    }
    return agreement < 0 ? -1 : 1;
  }

  void addSlit(const rig::SlitContact& slit) {
    std::vector<float> share(neutral.size(), 0.0F);
    for (std::size_t i = 0; i < slit.vertex.size(); ++i) share[slit.vertex[i]] = slit.share[i];
    // Corners give way to neither side and belong to both.
    SlitSides sides{slit.place, {}, {}, {}, {}};
    for (Side* side : {&sides.upper, &sides.lower}) {
      const float sign = side == &sides.upper ? 1.0F : -1.0F;
      std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
      for (const Triangle& t : triangles) {
        if (!std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return sign * share[v] > 0; })) continue;
        side->triangles.push_back(t);
        for (std::size_t i = 0; i < 3; ++i) {
          ++edges[std::minmax(t[i], t[(i + 1) % 3])];
        }
      }
      for (const auto& [edge, count] : edges) {
        if (count == 1) side->border[edge.first] = side->border[edge.second] = true;
      }
      for (std::uint32_t t = 0; t < side->triangles.size(); ++t) {
        for (const std::uint32_t v : side->triangles[t]) side->around[v].push_back(t);
      }
      for (const std::uint32_t v : slit.vertex) {
        if (sign * share[v] > 0.5F && side->around.contains(v)) side->probes.push_back(v);
      }
    }
    sides.upper_rest = depths(sides.upper, sides.lower, neutral);
    sides.lower_rest = depths(sides.lower, sides.upper, neutral);
    slits.push_back(std::move(sides));
  }

  // How deep each probe of one side is below the other side's surface; 0 outside, and where only the surface's border
  // is near.
  std::vector<double> depths(const Side& side, const Side& other, std::span<const Vertex> pose) const {
    std::vector<double> out(side.probes.size(), 0.0);
    if (other.triangles.empty()) return out;
    rig::VertexPositions scratch(static_cast<Eigen::Index>(pose.size()), 3);  // filled where it is looked at
    for (const Triangle& t : other.triangles) {
      for (const std::uint32_t v : t) scratch.row(v) = at(pose, v).transpose();
    }
    const rig::ClosestPoint surface(scratch, other.triangles);
    for (std::size_t i = 0; i < side.probes.size(); ++i) {
      const Eigen::Vector3d p = at(pose, side.probes[i]);
      const rig::SurfacePoint nearest = surface.find(p, kDeepest * es);
      if (nearest.triangle < 0) continue;
      const Triangle& t = surface.triangle(nearest.triangle);
      Eigen::Vector3d q = Eigen::Vector3d::Zero();
      bool at_border = false;
      for (std::size_t k = 0; k < 3; ++k) {
        q += nearest.barycentric[k] * at(pose, t[k]);
        at_border |= nearest.barycentric[k] > 1e-6 && other.border.contains(t[k]);
      }
      if (at_border) continue;
      // Two surfaces that meet face each other; the inside of a lid near the other lid's inside does not count. On an
      // edge or a vertex all around it say what is inside (Baerentzen, Aanaes, "Signed distance computation using the
      // angle weighted pseudonormal", 2005).
      const Eigen::Vector3d normal = pseudonormal(other, t, nearest.barycentric, pose);
      if (outward * normal.dot(p - q) < 0 && normal.dot(vertexNormal(side, side.probes[i], pose)) < 0) out[i] = nearest.distance;
    }
    return out;
  }

  static Eigen::Vector3d pseudonormal(const Side& side, const Triangle& t, const auto& barycentric,
                                      std::span<const Vertex> pose) {
    Triangle on{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (barycentric[k] > 1e-6) on[count++] = t[k];
    }
    if (count == 3) return normalOf(pose, t);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : side.around.at(on[0])) {
      const Triangle& u = side.triangles[i];
      const auto corner = std::find(u.begin(), u.end(), on[0]);
      if (count == 2 && std::find(u.begin(), u.end(), on[1]) == u.end()) continue;
      const Eigen::Vector3d unit = normalOf(pose, u).normalized();
      const auto k = static_cast<std::size_t>(corner - u.begin());
      const Eigen::Vector3d a = at(pose, u[k]);
      const Eigen::Vector3d b = at(pose, u[(k + 1) % 3]) - a, c = at(pose, u[(k + 2) % 3]) - a;
      sum += (count == 2 ? 1.0 : std::atan2(b.cross(c).norm(), b.dot(c))) * unit;
    }
    return sum;
  }

  static Eigen::Vector3d vertexNormal(const Side& side, std::uint32_t v, std::span<const Vertex> pose) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const std::uint32_t t : side.around.at(v)) sum += normalOf(pose, side.triangles[t]);
    return sum;
  }

  double deepest(const Side& side, const Side& other, const std::vector<double>& rest,
                 std::span<const Vertex> pose) const {
    const std::vector<double> now = depths(side, other, pose);
    double out = 0;
    for (std::size_t i = 0; i < now.size(); ++i) out = std::max(out, now[i] - rest[i]);
    return out;
  }

  // What the blink leaves open.
  double blinkGap() {
    double widest = 0;
    for (std::size_t k = 0; k < names.size(); ++k) {
      const bool left = names[k] == "eyeBlinkLeft";
      if (!left && names[k] != "eyeBlinkRight") continue;
      std::vector<float> weights(names.size(), 0.0F);
      weights[k] = 1;
      deformer.deformAtWeights(weights, positions);
      for (const rig::SlitContact& slit : contacts.slits) {
        if (slit.place != (left ? rig::SlitContact::Place::left_eye : rig::SlitContact::Place::right_eye)) continue;
        const std::array<float, rig::kMaxSlitColumns> gaps = rig::slitGaps(slit, positions);
        for (std::size_t j = 0; j < slit.upper.size(); ++j)
          widest = std::max(widest, static_cast<double>(gaps[j]) / es);
      }
    }
    return widest;
  }

  // Left shape against the mirror image of the right one, at the 84 vertices, relative to how unequal they are at rest.
  double asymmetry() {
    double worst = 0;
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (!names[k].ends_with("Left")) continue;
      const std::string other = names[k].substr(0, names[k].size() - 4) + "Right";
      const auto found = std::find(names.begin(), names.end(), other);
      if (found == names.end()) continue;
      std::vector<float> weights(names.size(), 0.0F);
      weights[k] = 1;
      deformer.deformAtWeights(weights, positions);
      const std::vector<Vertex> left = positions;
      weights[k] = 0;
      weights[static_cast<std::size_t>(found - names.begin())] = 1;
      deformer.deformAtWeights(weights, positions);
      for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
        const std::int32_t a = feature_vertex[p], b = feature_vertex[rig::featurePoints()[p].mirror];
        if (a < 0 || b < 0) continue;
        const auto moved = [&](std::span<const Vertex> pose, std::int32_t v) -> Eigen::Vector3d {
          const auto u = static_cast<std::uint32_t>(v);
          return mesh_from_head.transpose() * (at(pose, u) - at(neutral, u));
        };
        const Eigen::Vector3d one = moved(left, a), two = moved(positions, b);
        worst = std::max(worst, Eigen::Vector3d(one[0] + two[0], one[1] - two[1], one[2] - two[2]).norm() / es);
      }
    }
    return worst;
  }
};

HealthMeasure::HealthMeasure(const rig::Rig& rig) : state_(std::make_unique<State>(rig)) {}
HealthMeasure::~HealthMeasure() = default;

PoseHealth HealthMeasure::measure(const std::string& name, std::span<const Vertex> pose) const {
  const State& s = *state_;
  PoseHealth out;
  out.name = name;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const Eigen::Vector3d now = normalOf(pose, s.triangles[t]);
    const double rest = s.rest_normal[t].norm();
    if (!(rest > 1e-9 * s.es * s.es)) continue;  // was nothing at rest
    if (now.dot(s.rest_normal[t]) < 0) {
      ++out.flipped;
      out.flipped_skin += s.of_skin[t] ? 1 : 0;
    }
    if (now.norm() < 1e-3 * rest) ++out.degenerate;
  }
  out.eyeball_depth_es = static_cast<double>(rig::measurePenetration(s.contacts, pose).ball) / s.es;
  for (const SlitSides& slit : s.slits) {
    const double depth = std::max(s.deepest(slit.upper, slit.lower, slit.upper_rest, pose),
                                  s.deepest(slit.lower, slit.upper, slit.lower_rest, pose)) /
                         s.es;
    double& worst = slit.place == rig::SlitContact::Place::mouth ? out.lips_depth_es : out.lids_depth_es;
    worst = std::max(worst, depth);
  }
  return out;
}

PoseHealth HealthMeasure::measureWeights(const std::string& name, std::span<const float> weights) const {
  std::vector<Vertex> positions(state_->neutral.size());
  state_->deformer.deformAtWeights(weights, positions);
  return measure(name, positions);
}

ExpressionHealth HealthMeasure::measureAll() {
  State& s = *state_;
  ExpressionHealth out;
  out.triangles = s.triangles.size();
  out.shapes.resize(s.names.size());
  std::vector<double> border(s.names.size(), 0.0);
  rig::parallelFor(s.names.size(), [&](std::size_t k) {
    std::vector<float> weights(s.names.size(), 0.0F);
    weights[k] = 1;
    std::vector<Vertex> positions(s.neutral.size());
    s.deformer.deformAtWeights(weights, positions);
    out.shapes[k] = measure(s.names[k], positions);
    for (std::uint32_t v = 0; v < s.neutral.size(); ++v)
      if (s.unmoved[v] != 0) border[k] = std::max(border[k], (at(positions, v) - at(s.neutral, v)).norm() / s.es);
  });
  out.border_es = border.empty() ? 0 : *std::max_element(border.begin(), border.end());
  std::vector<std::pair<std::string, std::vector<float>>> combined;
  std::vector<float> weights(s.names.size(), 0.0F);
  for (const rig::NamedPose& pose : rig::combinedExpressions()) {
    std::fill(weights.begin(), weights.end(), 0.0F);
    bool known = true;
    for (const auto& [name, weight] : pose.weights) {
      const auto found = std::find(s.names.begin(), s.names.end(), name);
      known &= found != s.names.end();
      if (known) weights[static_cast<std::size_t>(found - s.names.begin())] = weight;
    }
    if (known) combined.emplace_back(pose.name, weights);
  }
  out.combinations.resize(combined.size());
  rig::parallelFor(combined.size(), [&](std::size_t i) {
    out.combinations[i] = measureWeights(combined[i].first, combined[i].second);
  });
  out.blink_gap_es = s.blinkGap();
  out.symmetry_es = s.asymmetry();
  return out;
}

std::size_t ExpressionHealth::flipped() const {
  std::size_t sum = 0;
  for (const auto* list : {&shapes, &combinations}) {
    for (const PoseHealth& p : *list) sum += p.flipped;
  }
  return sum;
}

std::size_t ExpressionHealth::flippedSkin() const {
  std::size_t sum = 0;
  for (const auto* list : {&shapes, &combinations}) {
    for (const PoseHealth& p : *list) sum += p.flipped_skin;
  }
  return sum;
}

std::size_t ExpressionHealth::degenerate() const {
  std::size_t sum = 0;
  for (const auto* list : {&shapes, &combinations}) {
    for (const PoseHealth& p : *list) sum += p.degenerate;
  }
  return sum;
}

PoseHealth ExpressionHealth::worst() const {
  PoseHealth out;
  for (const auto* list : {&shapes, &combinations}) {
    for (const PoseHealth& p : *list) {
      if (p.flipped > out.flipped) out.name = p.name;
      out.flipped = std::max(out.flipped, p.flipped);
      out.flipped_skin = std::max(out.flipped_skin, p.flipped_skin);
      out.degenerate = std::max(out.degenerate, p.degenerate);
      out.eyeball_depth_es = std::max(out.eyeball_depth_es, p.eyeball_depth_es);
      out.lids_depth_es = std::max(out.lids_depth_es, p.lids_depth_es);
      out.lips_depth_es = std::max(out.lips_depth_es, p.lips_depth_es);
    }
  }
  return out;
}

ExpressionHealth measureExpressions(const rig::Rig& rig) { return HealthMeasure(rig).measureAll(); }

}  // namespace volto::retarget
