#include "rig/assets/head/character.h"

#include <utility>
#include <vector>

#include "rig/assets/head/skin_field.h"

namespace volto::head {
namespace {

struct Colour {
  Material material;
  std::array<double, 3> linear_rgb;
};

Palette paletteOf(const Colour (&colours)[static_cast<std::size_t>(Material::count)]) {
  Palette out{};
  for (const Colour& c : colours) out[static_cast<std::size_t>(c.material)] = c.linear_rgb;
  return out;
}

constexpr Colour kAdultColours[] = {
    {Material::skin, {0.72, 0.47, 0.36}},    {Material::hair, {0.085, 0.05, 0.036}},
    {Material::lips, {0.60, 0.29, 0.26}},    {Material::mouth, {0.22, 0.06, 0.06}},
    {Material::nostril, {0.20, 0.08, 0.06}}, {Material::eye_white, {0.86, 0.85, 0.83}},
    {Material::iris, {0.16, 0.30, 0.30}},    {Material::iris_rim, {0.03, 0.07, 0.08}},
    {Material::pupil, {0.01, 0.01, 0.012}},  {Material::caruncle, {0.62, 0.33, 0.28}},
    {Material::teeth, {0.85, 0.82, 0.74}},   {Material::gums, {0.52, 0.20, 0.20}},
    {Material::tongue, {0.55, 0.20, 0.20}},  {Material::lashes, {0.035, 0.024, 0.022}},
    {Material::brows, {0.12, 0.072, 0.052}},
};

constexpr Colour kCreatureColours[] = {
    {Material::skin, {0.24, 0.55, 0.42}},    {Material::hair, {0.07, 0.24, 0.27}},
    {Material::lips, {0.22, 0.40, 0.35}},    {Material::mouth, {0.16, 0.04, 0.08}},
    {Material::nostril, {0.06, 0.16, 0.14}}, {Material::eye_white, {0.90, 0.90, 0.80}},
    {Material::iris, {0.78, 0.40, 0.04}},    {Material::iris_rim, {0.26, 0.10, 0.01}},
    {Material::pupil, {0.01, 0.01, 0.012}},  {Material::caruncle, {0.14, 0.32, 0.28}},
    {Material::teeth, {0.88, 0.86, 0.74}},   {Material::gums, {0.36, 0.16, 0.26}},
    {Material::tongue, {0.52, 0.20, 0.32}},  {Material::lashes, {0.02, 0.06, 0.06}},
    {Material::brows, {0.05, 0.18, 0.20}},
};

// 1 within `full` of the middle, 0 beyond `none`.
double plateau(double distance, double full, double none) { return 1 - smoothstep(full, none, distance); }

// The lids' skin turned up or down about the ball's centre: distances from the centre stay, so the lids stay on the
// ball. Most at the margins, fading into brow and cheek; the corners of the eye keep their place.
Vec3 openedLids(double opening, const Vec3& q) {
  constexpr double kReach = 0.70;  // radians
  const double elevation = std::atan2(q.y, q.z), s = elevation / kReach;
  const double corner = clamp01(1 - q.x * q.x / (1.62 * 1.62));
  const double turn = opening * elevation * std::exp(-s * s) * plateau(length(q), 1.75, 3.2) * std::sqrt(corner) *
                      smoothstep(-0.5, 0.3, q.z);
  const double c = std::cos(turn), n = std::sin(turn);
  return {q.x, q.y * c + q.z * n, q.z * c - q.y * n};
}

Vec3 thickenedLids(double thickness, const Vec3& q) {
  const double r = length(q);
  return q +
         normalized(q) * (thickness * smoothstep(1.41, 1.60, r) * plateau(r, 1.8, 3.0) * smoothstep(-0.2, 0.6, q.z));
}

// The face without its eyes: sums of smooth stretches, each fading to nothing.
Vec3 stretched(const Proportions& k, const Vec3& p) {
  Vec3 u;
  const double skull = smoothstep(-5.0, 2.5, p.y);
  u.x += (k.skull_width - 1) * skull * p.x;
  u.y += (k.skull_height - 1) * smoothstep(0.0, 5.0, p.y) * p.y;
  u.z += (k.skull_length - 1) * skull * (p.z + 0.6) * (1 - 0.7 * smoothstep(4.0, 8.0, p.z));

  const double neck = smoothstep(-8.0, -14.0, p.y);
  u.x += (k.neck_thickness - 1) * neck * p.x;
  u.z += (k.neck_thickness - 1) * neck * (p.z + 3.2);

  const double front = smoothstep(-2.0, 5.0, p.z);
  u.x += (k.mouth_width - 1) * plateau(std::fabs(p.y + 6.7), 1.0, 6.5) * front * p.x;

  u.y += k.mouth_smile * smoothstep(0.2, 3.9, std::fabs(p.x)) *
         plateau(length({0.6 * p.x, p.y + 6.6, p.z - 8.5}), 1.2, 4.2);

  const double chin = smoothstep(-8.0, -11.0, p.y) * front;
  u.x += (k.chin_width - 1) * smoothstep(-7.5, -10.0, p.y) * front * p.x;
  u.y += k.chin_rise * chin;
  u.z += -k.chin_retreat * chin;

  const Vec3 nose_root{0, -2.6, 8.0};
  const Vec3 from_nose = p - Vec3{0, -3.0, 9.9};  // the philtrum stays before the teeth
  const double nose = plateau(length({from_nose.x, 1.4 * from_nose.y, from_nose.z}), 1.5, 3.2);
  u.x += (k.nose_width - 1) * nose * p.x;
  u.y += (k.nose_height - 1) * nose * (p.y - nose_root.y);
  u.z += (k.nose_depth - 1) * nose * (p.z - nose_root.z);
  return p + u;
}

Vec3 moved(const Proportions& k, const Vec3& p) {
  const Vec3 face = stretched(k, p);
  const Vec3 q = p - kEyeCentre;
  const double eye = plateau(length(q), 1.9, 5.6) * smoothstep(0.0, 1.4, p.x);
  if (eye == 0) return face;
  const Vec3 opened = openedLids(k.lid_opening, thickenedLids(k.lid_thickness, q));
  const Vec3 change = (opened - q) * k.eye_size + q * (k.eye_size - 1) + k.eye_shift;
  return face + (change - (face - p)) * eye;
}

// In the ear's own frame: `weight` is 0 where it grows out of the head and 1 on its free part.
Vec3 movedEar(const Proportions& k, const Vec3& p, double weight) {
  const EarFrame frame = earFrame();
  const Vec3 q = p - frame.origin;
  double a = dot(q, frame.back), b = dot(q, frame.up), h = dot(q, frame.out);
  constexpr double kHinge = -0.8;  // where the ear's front grows out of the cheek
  a += (k.ear_size - 1) * weight * std::fmax(0, a - kHinge);
  b *= 1 + (k.ear_size - 1) * weight;
  // The tip: the upper part grows in length and narrows as it does.
  const double up = clamp01((dot(q, frame.up) + 0.6) / 3.6), tip = up * up * weight;
  const double narrow = k.ear_tip > 0 ? 0.72 * tip : 0;
  a += (0.55 * k.ear_size - a) * narrow + 0.45 * k.ear_tip * tip;
  b += 0.85 * k.ear_tip * tip;
  // Turned out about the line where the ear's front grows out of the cheek.
  const double turn = k.ear_flare * weight, c = std::cos(turn), s = std::sin(turn);
  const double from_hinge = a - kHinge, height = h;
  a = kHinge + from_hinge * c - height * s;
  h = from_hinge * s + height * c;
  const Vec3 to = frame.back * a + frame.up * b + frame.out * h;
  const Vec3 from = frame.back * dot(q, frame.back) + frame.up * dot(q, frame.up) + frame.out * dot(q, frame.out);
  return p + (to - from);
}

// How far each vertex is on the free part of the ear; what caps the ear's hollow has no strip coordinates and goes
// with its neighbours.
std::vector<double> earWeights(const HalfMesh& mesh) {
  std::vector<double> weights(mesh.vertices.size(), 0);
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (mesh.vertices[i].strip == Strip::ear) weights[i] = smoothstep(kEarRoot, 3, mesh.vertices[i].ring);
  for (int round = 0; round < 4; ++round)
    for (const Polygon& polygon : mesh.polygons) {
      double most = 0;
      for (const int c : polygon.corners) most = std::fmax(most, weights[static_cast<std::size_t>(c)]);
      for (const int c : polygon.corners)
        if (mesh.vertices[static_cast<std::size_t>(c)].hold == Hold::linear)
          weights[static_cast<std::size_t>(c)] = most;
    }
  return weights;
}

// How freely each vertex is evened out: not where strips hold it, nor on the lids, hardly on the nose and before the
// teeth.
std::vector<double> freedom(const HalfMesh& mesh) {
  std::vector<double> out;
  for (const HalfVertex& v : mesh.vertices) {
    const double lids = smoothstep(1.75, 2.4, length(v.position - kEyeCentre));
    const double nose = 1 - 0.85 * plateau(length(v.position - Vec3{0, -3.2, 9.6}), 1.6, 2.8);
    const double muzzle = 1 - plateau(length(v.position - Vec3{0, -6.4, 9.0}), 2.4, 4.0);
    const bool free = v.hold == Hold::skin && v.strip != Strip::nostril && !v.border;
    const double lips = v.strip == Strip::mouth ? clamp01(kLipBorder - v.ring) : 1;
    if (v.strip == Strip::eye && v.ring < kLidCrease)  // the fold over the lid, where there is one
      out.push_back(0.7 * (kLidCrease - v.ring));
    else
      out.push_back(free ? lips * lids * nose * muzzle * smoothstep(-2.0, 4.0, v.position.z) *
                               (1 - smoothstep(1.5, 8.5, v.position.y - 0.2 * v.position.z))
                         : 0);
  }
  return out;
}

// Every free vertex moves toward the middle of its neighbours, round after round.
void evenOut(HalfMesh& mesh, const std::vector<double>& free, int rounds) {
  const std::size_t n = mesh.vertices.size();
  for (int round = 0; round < rounds; ++round) {
    std::vector<Vec3> sum(n);
    std::vector<double> count(n, 0);
    for (const Polygon& polygon : mesh.polygons)
      for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
        const auto a = static_cast<std::size_t>(polygon.corners[i]);
        const auto b = static_cast<std::size_t>(polygon.corners[(i + 1) % polygon.corners.size()]);
        for (const auto& [to, from] : {std::pair{a, b}, {b, a}}) {
          sum[to] = sum[to] + mesh.vertices[from].position;
          count[to] += 1;
        }
      }
    for (std::size_t i = 0; i < n; ++i) {
      HalfVertex& v = mesh.vertices[i];
      if (free[i] == 0 || count[i] == 0) continue;
      // On the midline the other side's neighbours pull the opposite way.
      if (v.midline) sum[i].x = 0;
      v.position = lerp(v.position, sum[i] * (1 / count[i]), 0.5 * free[i]);
      if (v.midline) v.position.x = 0;
    }
  }
}

}  // namespace

Character adult() { return {"volto_head", "Volto's head", {}, paletteOf(kAdultColours), {}}; }

Character creature() {
  Proportions k;
  k.skull_width = 1.28;
  k.skull_height = 1.08;
  k.skull_length = 0.96;
  k.neck_thickness = 0.66;
  k.eye_size = 1.68;
  k.eye_shift = {1.05, 0.25, -0.60};
  k.lid_opening = 0.55;
  k.lid_thickness = 0.0;
  k.iris_size = 1.18;
  k.pupil_size = 1.45;
  k.nose_width = 1.15;
  k.nose_height = 0.78;
  k.nose_depth = 0.85;
  k.mouth_width = 1.38;
  k.mouth_smile = 0.85;
  k.chin_width = 0.80;
  k.chin_rise = 0.5;
  k.chin_retreat = 0.1;
  k.ear_size = 1.35;
  k.ear_tip = 3.6;
  k.ear_flare = 0.75;
  k.hair_thickness = 0;
  k.smoothness = 60;
  Tints tints;
  tints.blush = {0.90, 0.82, 0.70};
  tints.shade = {0.45, 0.60, 0.62};
  tints.crown = {0.50, 0.62, 0.74};
  return {"volto_creature", "Volto's creature", k, paletteOf(kCreatureColours), tints};
}

Vec3 eyeCentre(const Proportions& proportions) { return kEyeCentre + proportions.eye_shift; }
double eyeRadius(const Proportions& proportions) { return kEyeRadius * proportions.eye_size; }

void reshape(const Proportions& proportions, HalfMesh& mesh) {
  const std::vector<double> ear = earWeights(mesh), free = freedom(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Vec3& p = mesh.vertices[i].position;
    if (ear[i] > 0) p = movedEar(proportions, p, ear[i]);
    p = moved(proportions, p);
    if (mesh.vertices[i].midline) p.x = 0;
  }
  evenOut(mesh, free, proportions.smoothness);
}

void reshapeOnSkin(const Proportions& proportions, const HalfMesh& adult_skin, const HalfMesh& skin, HalfMesh& part) {
  constexpr double kReach = 0.35;  // of the mean over the skin near by
  std::vector<Vec3> evened;        // what evening out did to each vertex of the skin
  for (std::size_t i = 0; i < skin.vertices.size(); ++i)
    evened.push_back(skin.vertices[i].position - moved(proportions, adult_skin.vertices[i].position));
  for (HalfVertex& v : part.vertices) {
    Vec3 sum;
    double weight = 0;
    for (std::size_t i = 0; i < evened.size(); ++i) {
      const HalfVertex& on_skin = adult_skin.vertices[i];
      const Vec3 d = on_skin.position - v.position;
      const double far = dot(d, d) / (kReach * kReach);
      if (on_skin.hold != Hold::skin || far > 16) continue;
      const double w = std::exp(-far);
      sum = sum + evened[i] * w;
      weight += w;
    }
    v.position = moved(proportions, v.position);
    if (weight > 0) v.position = v.position + sum * (1 / weight);
  }
}

void reshapeEyeball(const Proportions& proportions, HalfMesh& mesh) {
  for (HalfVertex& v : mesh.vertices)
    v.position = v.position + (v.position - kEyeCentre) * (proportions.eye_size - 1) + proportions.eye_shift;
}

}  // namespace volto::head
