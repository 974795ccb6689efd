// The generic face stuck to a head: Orvalho, Zacur, Susin, section 4.3 (Stick), done step by step from coarse to fine
// so that it neither slides nor folds.
#pragma once

#include <cstddef>
#include <vector>

#include "rig/fitting/generic_head.h"
#include "rig/fitting/target_surface.h"

namespace volto::rig {

// A place of the generic face that must (large weight) or should come to lie at `to`. Generic head's frame and unit.
struct FacePin {
  SurfacePlace place;  // on GenericHead::face
  Eigen::Vector3d to;
  double weight = 1;  // against one squared eye separation of surface
};

struct RegisteredFace {
  VertexPositions positions;     // of GenericHead::face
  std::vector<SurfaceHit> hits;  // where each vertex comes to lie; triangle -1: nowhere that corresponds
  std::size_t folded = 0;        // triangles that had to be unfolded
};

// `start`: the face's vertices where the landmarks' warp puts them. The displacement from there is made smooth
// (|Laplacian|^2 over the face) and small from the nearest point of the target whose normal agrees; what is too far, or
// on an open edge, counts less or not. Deterministic; some 0.5 s for 7000 vertices.
RegisteredFace registerFace(const GenericHead& head, const VertexPositions& start, const TargetSurface& target,
                            const std::vector<FacePin>& pins);

// Unit normals of the face's vertices for other positions of them.
VertexPositions faceNormals(const std::vector<std::array<std::uint32_t, 3>>& triangles,
                            const VertexPositions& positions);

}  // namespace volto::rig
