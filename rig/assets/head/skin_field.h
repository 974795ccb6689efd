// The skin of the head as a signed distance field: negative inside, positive outside, zero on the skin. Ellipsoids and
// tapered capsules melted together, with soft hollows and ridges on top; centimetres, origin between the eyeball
// centres, +x the subject's left, +y up, +z out of the face. Exactly symmetric: only |x| is used.
#pragma once

#include "rig/assets/head/vec3.h"

namespace volto::head {

// Distances after anthropometric averages (adult head: length 19 cm, breadth 15.2 cm, pupils 6.2 cm apart).
inline constexpr Vec3 kEyeCentre{3.12, 0.0, 6.95};  // left eyeball
inline constexpr double kEyeRadius = 1.365;
inline constexpr double kLidThickness = 0.15;
inline constexpr double kLidGap = 0.02;  // between eyeball and the back of the lid margin

double skinDistance(const Vec3& p);
Vec3 skinGradient(const Vec3& p);  // not normalised

// Nearest point along the field's gradient; on the midline (x = 0) it stays there.
Vec3 projectToSkin(Vec3 p);
// First hit of a ray that starts outside; the last point tried when there is none.
Vec3 castToSkin(const Vec3& origin, const Vec3& direction);

}  // namespace volto::head
