// The search as a whole: planes of symmetry, poses on them, and the faces that the best of them show.
#pragma once

#include <cstddef>
#include <span>

#include "rig/finding/face_match.h"
#include "rig/finding/surface_samples.h"

namespace volto::rig {

struct SearchResult {
  FaceMatch best;             // likeness 0 where nothing was found
  double symmetry_error = 0;  // of the surface around the face, in the surface's unit
  std::size_t planes = 0;     // looked at
  double best_mirrored = 0;   // how much of the surface the best of them mirrors, 0..1
  std::size_t poses = 0;      // looked at
};

// Above this a match is a face (tests/rig/finding_test.cpp: human faces have 0.85 and more, what is no face up to 0.6).
inline constexpr double kFaceLikeness = 0.7;

// The face that the samples (a part of those of the surface) belong to. First on the best plane of symmetry, then on
// lesser ones, then on parts of the surface with planes of their own, until something is like a face.
// `thorough` false: on the best planes alone.
SearchResult searchFace(const NormalisedSurface& surface, std::span<const SurfaceSample> samples, bool thorough);

}  // namespace volto::rig
