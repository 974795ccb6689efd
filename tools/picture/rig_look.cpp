#include "tools/picture/rig_look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace volto::picture {
namespace {

// In the head frame, in eye separations.
struct Place {
  float x, y, z;
};

float smooth(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

// Distance in the x-y plane to a segment, and how far along it (0..1) the nearest point lies.
std::array<float, 2> toSegment(Place p, Place a, Place b) {
  const float dx = b.x - a.x, dy = b.y - a.y, square = dx * dx + dy * dy;
  const float t = square > 0.0F ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / square, 0.0F, 1.0F) : 0.0F;
  return {std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy), t};
}

// Negative inside the polygon.
float signedDistance(Place p, const std::vector<Place>& polygon) {
  float nearest = 1e30F;
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    nearest = std::min(nearest, toSegment(p, polygon[i], polygon[j])[0]);
    const Place a = polygon[i], b = polygon[j];
    if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x) inside = !inside;
  }
  return inside ? -nearest : nearest;
}

Vec3 ratio(Vec3 a, Vec3 b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }

class Painter {
 public:
  explicit Painter(const rig::Rig& rig) : rig_(rig), size_(rig.fapu.fapu.eye_separation) {
    outer_lips_ = points({"8.3", "8.5", "8.10", "8.1", "8.9", "8.6", "8.4", "8.8", "12.16", "8.2", "12.15", "8.7"});
    brows_[0] = points({"4.1", "12.1", "4.3", "12.2", "4.5"});
    brows_[1] = points({"4.2", "12.3", "4.4", "12.4", "4.6"});
  }

  // What the skin's albedo is multiplied with at a vertex.
  Vec3 tint(Eigen::Index vertex) const {
    static const Vec3 skin = surfaceByName("skin").albedo;
    static const Vec3 lips = ratio(surfaceByName("lips").albedo, skin),
                      brow = ratio(surfaceByName("brow").albedo, skin),
                      mouth = ratio(surfaceByName("mouth").albedo, skin);
    const Place p = place(rig_.neutral.positions.row(vertex).transpose());
    Vec3 out{1.0F, 1.0F, 1.0F};
    // Lips: inside the outer contour; deeper in, the mouth.
    const float front = std::min({outer_lips_[0].z, outer_lips_[6].z, outer_lips_[3].z, outer_lips_[9].z});
    const float edge = signedDistance(p, outer_lips_);
    if (p.z > front - 0.10F) out = mix(out, lips, 0.95F * smooth(0.02F, -0.02F, edge));
    // The inside reaches farther sideways and down than the lips do.
    if (p.z < front && edge < 0.35F && inner(vertex)) out = mix(out, mouth, smooth(front - 0.02F, front - 0.16F, p.z));
    // Brows: along the line of their points, thinner towards the outside.
    for (const auto& line : brows_) {
      float cover = 0.0F;
      for (std::size_t i = 0; i + 1 < line.size(); ++i) {
        const auto [distance, along] = toSegment(p, line[i], line[i + 1]);
        const float t = (static_cast<float>(i) + along) / static_cast<float>(line.size() - 1);
        const float half = 0.062F - 0.030F * t;
        const float depth = std::abs(p.z - (line[i].z + along * (line[i + 1].z - line[i].z)));
        if (depth < 0.25F)
          cover = std::max(cover, smooth(half + 0.035F, half - 0.035F, distance) * (0.88F - 0.18F * t));
      }
      out = mix(out, brow, cover);
    }
    return out;
  }

 private:
  Place place(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d h = rig_.mesh_from_head.transpose() * p / size_;
    return {static_cast<float>(h.x()), static_cast<float>(h.y()), static_cast<float>(h.z())};
  }
  std::vector<Place> points(std::initializer_list<const char*> ids) const {
    std::vector<Place> out;
    for (const char* id : ids) {
      out.push_back(
          place(rig_.feature_positions.row(static_cast<Eigen::Index>(*rig::featurePointIndex(id))).transpose()));
    }
    return out;
  }
  // Not on the outer skin: reached from the mask only around corners, or not at all.
  bool inner(Eigen::Index vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return v >= rig_.association.kind.size() || rig_.association.kind[v] != rig::AssociationKind::ray;
  }

  const rig::Rig& rig_;
  double size_;
  std::vector<Place> outer_lips_;
  std::array<std::vector<Place>, 2> brows_;
};

Vec3 toVec3(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

// The surface of every rigid part: number of the part -> index into the look's surfaces, by vertex.
void nameParts(const rig::Rig& rig, Look& look) {
  std::vector<int> surface_of(rig.neutral.vertexCount(), -1);
  const float eye_separation = static_cast<float>(rig.fapu.fapu.eye_separation);
  for (const rig::RigidPart& part : rig.rigid_parts) {
    Surface surface = surfaceByName(part.name);
    if (part.name.find("gums") != std::string::npos) surface = surfaceByName("gums");
    const bool eyeball =
        part.follows == rig::RigidPart::Follows::left_eye || part.follows == rig::RigidPart::Follows::right_eye;
    if (eyeball) continue;  // told by its shape
    if (surface.name == "skin") {
      // Without a telling name: hairs stand out from an eyeball, farther than a film over it.
      bool lash = false;
      for (const Eyeball& eye : look.eyeballs) {
        float nearest = 1e30F, farthest = 0.0F;
        for (const std::uint32_t v : part.vertices) {
          const float d = length(toVec3(rig.neutral.positions.row(v).transpose()) - eye.centre);
          nearest = std::min(nearest, d);
          farthest = std::max(farthest, d);
        }
        lash = lash || (nearest < 0.35F * eye_separation && farthest > 0.24F * eye_separation &&
                        farthest < 0.5F * eye_separation);
      }
      if (!lash) continue;
      // Lashes come with the wet rim of the lid in one piece often enough; black would be a thick line around the eye.
      surface = surfaceByName("eyelid");
      surface.albedo = {0.24F, 0.125F, 0.09F};
    }
    for (const std::uint32_t v : part.vertices) {
      if (v < surface_of.size()) surface_of[v] = static_cast<int>(look.surfaces.size());
    }
    look.surfaces.push_back(surface);
  }
  for (std::size_t p = 0; p < rig.neutral.polygonCount(); ++p) {
    const int surface = surface_of[rig.neutral.corner_vertices[rig.neutral.polygon_start[p]]];
    // What was found to be an eyeball or a film over one stays so.
    if (surface >= 0 && look.polygon_surface[p] == 0) look.polygon_surface[p] = static_cast<std::uint16_t>(surface);
  }
}

}  // namespace

Look lookOfRig(const rig::Rig& rig) {
  Look look = lookOf(rig.neutral);
  if (!(rig.fapu.fapu.eye_separation > 0.0)) return look;
  const Vec3 forward = toVec3(rig.mesh_from_head.col(2));
  for (Eyeball& eye : look.eyeballs) eye.axis = forward;
  if (hasOwnLook(rig.neutral)) return look;
  nameParts(rig, look);
  const Painter painter(rig);
  look.vertex_tint.assign(rig.neutral.vertexCount(), Vec3{1.0F, 1.0F, 1.0F});
  std::vector<bool> skin(rig.neutral.vertexCount(), false);
  for (std::size_t p = 0; p < rig.neutral.polygonCount(); ++p) {
    if (look.polygon_surface[p] != 0) continue;
    for (std::uint32_t c = rig.neutral.polygon_start[p]; c < rig.neutral.polygon_start[p + 1]; ++c)
      skin[rig.neutral.corner_vertices[c]] = true;
  }
  for (std::size_t v = 0; v < skin.size(); ++v) {
    if (skin[v]) look.vertex_tint[v] = painter.tint(static_cast<Eigen::Index>(v));
  }
  return look;
}

std::vector<Vec3> facePoints(const rig::Rig& rig) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    points.push_back(toVec3(rig.feature_positions.row(static_cast<Eigen::Index>(i)).transpose()));
  return points;
}

}  // namespace volto::picture
