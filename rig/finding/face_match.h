// One candidate looked at closely: the generic face's relief against the relief seen from there.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "rig/finding/face_template.h"
#include "rig/finding/relief_flow.h"

namespace volto::rig {

struct FaceMatch {
  FaceFrame frame;                // bettered
  Relief relief;                  // seen in that frame
  ReliefFlow flow;                // template to that relief
  std::array<double, 4> parts{};  // likeness of left eye, right eye, nose, mouth: -1..1
  double likeness = 0;  // of the whole: half their mean, half the least (the better eye counts): a face has all
};

// Coarsely, to compare many candidates.
FaceMatch glanceAtFace(const NormalisedSurface& surface, const FaceFrame& frame);

// Finely: the frame is bettered within the plane of symmetry until relief and frame agree.
FaceMatch studyFace(const NormalisedSurface& surface, const FaceFrame& frame);

// How alike the two are around points of the template, 0..1 each; 0 where the surface is not seen.
std::vector<double> likenessAround(const FaceMatch& match, std::span<const Eigen::Vector2d> points, double radius);

}  // namespace volto::rig
