// Texture coordinates: one atlas of the unit square, mirrored about its middle as the head is. The skin is one chart,
// cut from the nape over the crown to the hair line; ears, the inner sides of the lids and the mouth bag are charts of
// their own, and so is each part.
#pragma once

#include <array>

#include "rig/assets/head/half_mesh.h"

namespace volto::head {

// What a chart shows; each has its own rectangle of the atlas.
enum class Chart : unsigned char { face, ear, lids, mouth, eyeball, upper_teeth, lower_teeth, tongue, lashes, brow };

// Fills in the polygons' texture coordinates (left half: u from 0.5 to 1). The face is unwrapped by Floater's mean
// value coordinates ("Mean value coordinates", CAGD 2003) inside a fixed convex outline, so that no two triangles
// overlap.
void unwrapSkin(HalfMesh& skin);

// Moves the local coordinates that the part was made with into its rectangle.
void placeChart(HalfMesh& part, Chart chart);

}  // namespace volto::head
