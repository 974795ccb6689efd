#include "rig/assets/head/tint.h"

#include <algorithm>

#include "rig/assets/head/skin_field.h"

namespace volto::head {
namespace {

Vec3 times(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
void paint(Vec3& tint, const Vec3& colour, double amount) {
  tint = times(tint, lerp(Vec3{1, 1, 1}, colour, clamp01(amount)));
}

// 1 in the middle, 0 outside of about twice the widths.
double spot(const Vec3& p, const Vec3& centre, const Vec3& widths) {
  const Vec3 q = p - centre;
  const double s =
      q.x * q.x / (widths.x * widths.x) + q.y * q.y / (widths.y * widths.y) + q.z * q.z / (widths.z * widths.z);
  return std::exp(-s);
}

double nearLine(const Vec3& p, const Vec3& a, const Vec3& b, double width) {
  const Vec3 ab = b - a, q = p - (a + ab * clamp01(dot(p - a, ab) / dot(ab, ab)));
  return std::exp(-dot(q, q) / (width * width));
}

// How many edges each vertex is from the nearest polygon of the material, at most `limit`.
std::vector<int> distanceFrom(const HalfMesh& mesh, Material material, int limit) {
  std::vector<int> distance(mesh.vertices.size(), limit);
  for (const Polygon& polygon : mesh.polygons)
    if (polygon.material == material)
      for (const int c : polygon.corners) distance[static_cast<std::size_t>(c)] = 0;
  for (int level = 0; level + 1 < limit; ++level)
    for (const Polygon& polygon : mesh.polygons)
      for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
        const auto a = static_cast<std::size_t>(polygon.corners[i]);
        const auto b = static_cast<std::size_t>(polygon.corners[(i + 1) % polygon.corners.size()]);
        if (distance[a] == level) distance[b] = std::min(distance[b], level + 1);
        if (distance[b] == level) distance[a] = std::min(distance[a], level + 1);
      }
  return distance;
}

}  // namespace

void tintSkin(const Tints& tints, HalfMesh& skin) {
  const std::vector<int> from_hair = distanceFrom(skin, Material::hair, 5);
  std::vector<bool> hair(skin.vertices.size(), true);  // hair all around
  for (const Polygon& polygon : skin.polygons)
    if (polygon.material != Material::hair)
      for (const int c : polygon.corners) hair[static_cast<std::size_t>(c)] = false;
  for (std::size_t i = 0; i < skin.vertices.size(); ++i) {
    HalfVertex& v = skin.vertices[i];
    const Vec3 p = v.position, eye = p - kEyeCentre;
    if (v.strip == Strip::mouth && v.hold == Hold::strip) {
      // Lips: darker where they meet; the mouth: darker inward.
      paint(v.tint, tints.shade, 0.75 * smoothstep(kLipRim - 0.9, kLipRim, v.ring));
      paint(v.tint, {0.30, 0.25, 0.25}, 0.9 * smoothstep(kMouthVestibule, kMouthBack, v.ring));
      continue;
    }
    if (hair[i]) {
      const double angle = std::atan2(p.x, p.y + 1.0);
      const double lock = std::fabs(std::cos(angle * 9.5 - 0.35 * smoothstep(-6, 6, p.z)));
      const double dark = tints.hair * (1 - lock) * smoothstep(-1, 3, p.y) + 0.25 * smoothstep(3, -4, p.y);
      paint(v.tint, {0.25, 0.25, 0.25}, dark);
      continue;
    }
    double blush = 0.75 * spot(p, {4.3, -2.9, 6.6}, {1.9, 1.5, 2.2});
    blush = std::max(blush, 0.38 * spot(p, {0, -3.4, 11.0}, {1.3, 0.9, 1.6}));
    blush = std::max(blush, 0.25 * spot(p, {0, -9.7, 9.2}, {1.4, 1.0, 1.5}));
    blush = std::max(blush, 0.30 * spot(p, {3.1, -0.9, 8.0}, {1.4, 0.5, 1.2}));
    if (v.strip == Strip::ear || (v.hold == Hold::linear && p.x > 5))
      blush = std::max(blush, 0.52 * smoothstep(1.0, 3.0, v.hold == Hold::linear ? 3.0 : v.ring));
    paint(v.tint, tints.blush, blush);

    double shade = 0;
    if (v.strip == Strip::eye && v.ring <= kLidMarginFront) {
      const double crease = v.ring - kLidCrease;
      shade = 0.55 * std::exp(-crease * crease / 0.03) * smoothstep(0.0, 0.5, eye.y);
      shade = std::max(shade, 0.45 * smoothstep(kLidMarginFront - 0.35, kLidMarginFront, v.ring));
    }
    shade = std::max(shade, 0.22 * spot(eye, {0, 0.75, 1.2}, {1.7, 0.7, 1.0}));
    shade = std::max(shade, 0.20 * spot(eye, {-1.5, -0.2, 1.0}, {0.5, 0.8, 0.8}));
    shade = std::max(shade, 0.35 * nearLine(p, {1.72, -3.5, 9.2}, {1.62, -4.3, 9.2}, 0.22));
    shade = std::max(shade, 0.25 * spot(p, {0, -8.35, 9.2}, {1.2, 0.3, 1.0}));
    if (v.strip == Strip::nostril) shade = std::max(shade, 0.8 * smoothstep(1.0, kNostrilRim + 0.5, v.ring));
    shade = std::max(shade, 0.5 * (1 - from_hair[i] / 5.0) * (1 - from_hair[i] / 5.0));
    paint(v.tint, tints.shade, shade);
    paint(v.tint, tints.crown, smoothstep(3.0, 9.5, p.y - 0.35 * p.z + 1.5));
  }
}

void tintEyeball(HalfMesh& eyeball) {
  for (HalfVertex& v : eyeball.vertices) {
    const Vec3 q = v.position - kEyeCentre;
    const double flat = std::sqrt(q.x * q.x + q.y * q.y) / kEyeRadius, angle = std::atan2(q.y, q.x);
    if (q.z > 0) {
      // The upper lid's shadow, and rays in the iris: lighter below, as light that falls in makes it.
      paint(v.tint, {0.55, 0.55, 0.58}, 0.8 * smoothstep(0.05, 0.45, q.y / kEyeRadius));
      const double rays = 0.5 + 0.5 * std::cos(14 * angle);
      if (flat > 0.20 && flat < 0.46) paint(v.tint, {0.62, 0.62, 0.62}, 0.5 * rays);
    }
    paint(v.tint, {0.95, 0.70, 0.66}, 0.8 * smoothstep(0.72, 1.0, std::fabs(q.x) / kEyeRadius));
  }
}

void tintMouthPart(HalfMesh& part) {
  for (HalfVertex& v : part.vertices) paint(v.tint, {0.30, 0.24, 0.24}, smoothstep(8.4, 5.4, v.position.z));
}

}  // namespace volto::head
