#include "tools/picture/shading.h"

#include <algorithm>
#include <cmath>

namespace volto::picture {
namespace {

Vec3 unit(float x, float y, float z) { return normalised({x, y, z}); }

// x^n by squaring and multiplying; n is rounded to a whole number.
float power(float x, float n) {
  auto left = static_cast<unsigned>(n + 0.5F);
  float result = 1.0F;
  for (; left > 0; left >>= 1) {
    if ((left & 1U) != 0) result *= x;
    x *= x;
  }
  return result;
}

constexpr std::size_t kSrgbSteps = 4096;
const std::array<std::uint8_t, kSrgbSteps + 1> kSrgb = [] {
  std::array<std::uint8_t, kSrgbSteps + 1> out{};
  for (std::size_t i = 0; i <= kSrgbSteps; ++i) {
    const double x = static_cast<double>(i) / kSrgbSteps;
    const double y = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
    out[i] = static_cast<std::uint8_t>(std::lround(255.0 * y));
  }
  return out;
}();

// 0 and 1 stay; what lies between is raised towards the root.
float lifted(float x, float amount) { return x + (std::sqrt(x) - x) * amount; }

float smooth(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

}  // namespace

LightSet lightSet(Lighting lighting) {
  // A warm key from above the viewer's left shoulder, a cool fill a third as strong, and two lights from behind that
  // draw the outline.
  static const std::array<Light, 4> studio{{
      {unit(-0.52F, 0.58F, 0.80F), Vec3{1.0F, 0.95F, 0.89F} * 1.30F},
      {unit(0.85F, 0.05F, 0.70F), Vec3{0.93F, 0.95F, 1.0F} * 0.34F},
      {unit(0.80F, 0.40F, -0.62F), Vec3{0.84F, 0.91F, 1.0F} * 1.00F},
      {unit(-0.90F, 0.30F, -0.50F), Vec3{1.0F, 0.95F, 0.94F} * 0.50F},
  }};
  static const std::array<Light, 3> frontal{{
      {unit(0.0F, 0.55F, 0.85F), Vec3{1.0F, 0.97F, 0.93F} * 1.55F},
      {unit(0.85F, 0.1F, 0.4F), Vec3{0.9F, 0.95F, 1.0F} * 0.3F},
      {unit(-0.85F, 0.1F, 0.4F), Vec3{0.9F, 0.95F, 1.0F} * 0.3F},
  }};
  const Vec3 sky{0.255F, 0.255F, 0.265F}, ground{0.155F, 0.118F, 0.10F};
  if (lighting == Lighting::frontal) return {frontal, sky, ground};
  return {studio, sky, ground};
}

Vec3 shade(const Surface& surface, Vec3 albedo, Vec3 normal, Vec3 to_viewer, const LightSet& lights, float open,
           float lit) {
  // In skin, light wanders, and the colour that it keeps wanders farthest: red in a person's skin, green in a green
  // one's. It reaches around the edge of the shadow, and it is what lights the folds from within.
  const float brightest = std::max({albedo.x, albedo.y, albedo.z, 1e-4F});
  const Vec3 kept = albedo * (1.0F / brightest), wander = kept * kept * surface.softness;
  const Vec3 wrap = Vec3{0.09F, 0.09F, 0.09F} * surface.softness + wander * 0.24F;
  const float facing = std::clamp(dot(normal, to_viewer), 0.0F, 1.0F);
  const float away = 1.0F - facing;
  const float fresnel = surface.specular + (1.0F - surface.specular) * 0.30F * power(away, 5.0F);
  Vec3 diffuse = mix(lights.ground, lights.sky, 0.5F + 0.5F * normal.y);
  const Vec3 opened{lifted(open, 0.55F * wander.x), lifted(open, 0.55F * wander.y), lifted(open, 0.55F * wander.z)};
  diffuse = diffuse * opened;
  Vec3 mirror{};
  bool key = true;
  for (const Light& light : lights.lights) {
    const float cosine = dot(normal, light.towards);
    const float reach = key ? lit : 0.30F + 0.70F * open;
    const auto lambert = [&](float w) { return std::max(0.0F, cosine + w) / ((1.0F + w) * (1.0F + 0.5F * w)); };
    const Vec3 soft_reach =
        key ? Vec3{lifted(reach, 0.40F * wander.x), lifted(reach, 0.40F * wander.y), lifted(reach, 0.40F * wander.z)}
            : Vec3{reach, reach, reach};
    diffuse = diffuse + light.colour * Vec3{lambert(wrap.x), lambert(wrap.y), lambert(wrap.z)} * soft_reach;
    if (cosine > 0.0F) {
      const Vec3 half = normalised(light.towards + to_viewer);
      const float cosine_half = std::max(0.0F, dot(normal, half));
      // Skin shines in two ways: broadly by its down, narrowly by its oil. Wet and smooth things have the narrow one
      // alone.
      const auto lobe = [&](float gloss) { return power(cosine_half, gloss) * (gloss + 8.0F) * 0.125F; };
      const float broad = 0.55F * surface.softness;
      const float highlight = (1.0F - broad) * lobe(surface.gloss) + broad * lobe(0.4F * surface.gloss);
      mirror = mirror + light.colour * (highlight * fresnel * std::min(1.0F, 4.0F * cosine) * reach);
    }
    key = false;
  }
  // The surroundings, mirrored: brighter above.
  const float upward = 2.0F * facing * normal.y - to_viewer.y;
  const Vec3 around = mix(lights.ground, lights.sky, 0.5F + 0.5F * upward) * (fresnel * open);
  return albedo * diffuse + mirror + around;
}

Vec3 eyeballAlbedo(const Eyeball& eyeball, Vec3 white, Vec3 from_centre) {
  const Vec3 direction = normalised(from_centre);
  const float angle = std::acos(std::clamp(dot(direction, eyeball.axis), -1.0F, 1.0F));
  const float soft = 0.03F;
  // The white reddens toward the corners; the iris has a dark rim, fine rays and a lighter ring around the pupil.
  const Vec3 ball = mix(white, white * Vec3{0.93F, 0.72F, 0.68F}, smooth(0.8F, 1.5F, angle));
  if (angle > eyeball.iris_rad + soft) return ball;
  const float ring = angle / eyeball.iris_rad;
  const Vec3 sideways = normalised(cross(Vec3{0, 1, 0}, eyeball.axis)), upward = cross(eyeball.axis, sideways);
  const float turn = std::atan2(dot(direction, upward), dot(direction, sideways));
  const float rays = 1.0F + 0.16F * std::sin(23.0F * turn) * std::sin(9.0F * turn + 1.7F);
  Vec3 iris = eyeball.iris * (rays * (1.35F - 0.75F * smooth(0.55F, 1.0F, ring)));
  iris = mix(iris * Vec3{1.7F, 1.4F, 1.1F}, iris, smooth(0.35F, 0.75F, ring));
  iris = mix(Vec3{0.004F, 0.004F, 0.004F}, iris, smooth(eyeball.pupil_rad - soft, eyeball.pupil_rad + soft, angle));
  return mix(iris, ball, smooth(eyeball.iris_rad - soft, eyeball.iris_rad + soft, angle));
}

Vec3 toneMapped(Vec3 light) {
  const auto curve = [](float x) { return x * (1.0F + x * 0.10F) / (1.0F + 0.45F * x); };
  return {std::min(1.0F, curve(light.x)), std::min(1.0F, curve(light.y)), std::min(1.0F, curve(light.z))};
}

std::uint8_t srgb(float linear) {
  return kSrgb[static_cast<std::size_t>(std::clamp(linear, 0.0F, 1.0F) * kSrgbSteps + 0.5F)];
}

float linearFromSrgb(std::uint8_t value) {
  const float x = static_cast<float>(value) / 255.0F;
  return x <= 0.04045F ? x / 12.92F : std::pow((x + 0.055F) / 1.055F, 2.4F);
}

}  // namespace volto::picture
