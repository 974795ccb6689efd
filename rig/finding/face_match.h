// One candidate looked at closely: the generic face's relief against the relief seen from there.
#pragma once

#include "rig/finding/face_template.h"
#include "rig/finding/relief_flow.h"

namespace volto::rig {

struct FaceMatch {
  FaceFrame frame;  // bettered
  Relief relief;    // seen in that frame
  ReliefFlow flow;  // template to that relief
  ReliefLikeness likeness;

  double mean() const { return (likeness.normals + likeness.curvature) / 2; }
};

// Coarsely, to compare many candidates.
FaceMatch glanceAtFace(const NormalisedSurface& surface, const FaceFrame& frame);

// Finely: the frame is bettered within the plane of symmetry until relief and frame agree.
FaceMatch studyFace(const NormalisedSurface& surface, const FaceFrame& frame);

// How alike the two are around a point of the template, 0..1; 0 where the surface is not seen.
double likenessAround(const FaceMatch& match, const Eigen::Vector2d& p, double radius);

}  // namespace volto::rig
