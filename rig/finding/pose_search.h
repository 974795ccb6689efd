// Where a head could lie: the generic head's points laid onto the surface from thousands of starts.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "rig/finding/face_frame.h"
#include "rig/finding/symmetry.h"

namespace volto::rig {

struct PoseCandidate {
  FaceFrame frame;       // the samples' frame
  double closeness = 0;  // 0..1: how much of the generic head finds the surface, closely and facing the same way
  std::size_t plane = 0;
};

// On each plane of symmetry four unknowns are left (turn and place in the plane, size) and which way the face looks:
// all of them are tried on a raster as coarse as closest-point iterations can mend, the better ones are followed.
// At most `count` candidates that differ, best first. Eye separations from `smallest` up are tried; the samples' root
// mean square distance from the origin is 1.
std::vector<PoseCandidate> searchPoses(std::span<const SurfaceSample> samples, std::span<const SymmetryPlane> planes,
                                       std::size_t count, double smallest);

}  // namespace volto::rig
