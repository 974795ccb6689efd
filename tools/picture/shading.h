// Light on a point of a surface, in linear RGB.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tools/picture/camera.h"
#include "tools/picture/look.h"

namespace volto::picture {

// Directional lights in view space, fixed to the viewer as in a studio.
struct Light {
  Vec3 towards;  // unit
  Vec3 colour;   // linear
};
struct LightSet {
  std::span<const Light> lights;  // the first is the key light, the one that throws the shadow
  Vec3 sky, ground;               // from above and from below, everywhere
};
LightSet lightSet(Lighting lighting);

// `normal` and `to_viewer` are unit vectors on the same side; `open` 0..1 is how much of the surroundings the point
// sees; `lit` 0..1 is how much of the key light reaches it.
Vec3 shade(const Surface& surface, Vec3 albedo, Vec3 normal, Vec3 to_viewer, const LightSet& lights, float open,
           float lit);

// Albedo of an eyeball in the direction `from_centre` (mesh frame, any length).
Vec3 eyeballAlbedo(const Eyeball& eyeball, Vec3 white, Vec3 from_centre);

// Linear light of any strength to 0..1 with a soft shoulder, still linear.
Vec3 toneMapped(Vec3 light);

// Linear 0..1 to 8-bit sRGB.
std::uint8_t srgb(float linear);
// 8-bit sRGB to linear 0..1.
float linearFromSrgb(std::uint8_t value);

}  // namespace volto::picture
