// How open each pixel's surface lies to its surroundings, from depth and normals alone.
// M. McGuire, B. Osman, M. Bukowski, P. Hennessy: The Alchemy Screen-Space Ambient Obscurance Algorithm, HPG 2011.
#pragma once

#include <vector>

#include "tools/picture/vec3.h"

namespace volto::picture {

struct OcclusionInput {
  int width = 0, height = 0;  // pixels
  float focal_px = 1.0F;
  float middle_x = 0.0F, middle_y = 0.0F;
  float radius = 1.0F;       // how far surroundings reach, unit of depth
  std::vector<float> depth;  // per pixel, from the viewer; 0: nothing there
  std::vector<Vec3> normal;  // per pixel, view space
};

// Per pixel 1 (open) .. 0 (tucked away). The pattern of samples repeats every 4 by 4 pixels and is smoothed out within
// surfaces.
void ambientOcclusion(const OcclusionInput& in, std::vector<float>& out_open);

}  // namespace volto::picture
