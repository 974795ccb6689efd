// A mesh of any size as some thousand points with normals, and which of them are seen from outside.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "rig/mesh.h"

namespace volto::rig {

using Triangle = std::array<std::uint32_t, 3>;

// The part of the mesh that its triangles cover, moved and scaled: centroid at the origin, root mean square distance
// from it 1 (both by area).
struct NormalisedSurface {
  VertexPositions positions;  // #V by 3
  std::vector<Triangle> triangles;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // p_mesh = centre + size * p
  double size = 1;
};

// Throws InputError for a mesh without area.
NormalisedSurface normaliseSurface(const Mesh& mesh);

struct SurfaceSample {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;  // unit; out of the solid where only one side is seen, else as the polygon is wound
  std::uint32_t triangle = 0;
  bool two_sided = false;   // an open sheet, seen from both sides: the normal's sign means nothing
  float seen_as_wound = 0;  // how much of the triangle's front (by its winding) is seen from outside, 0..1
  float seen_reversed = 0;  // and of its back
};

// About `count` samples, half of them spread by area, half by triangle (artists make triangles where detail is);
// those that can be seen from outside, at least at a slant, are returned; the triangles of the others are appended to
// `hidden` where asked for. The surface's own frame. Deterministic.
std::vector<SurfaceSample> sampleVisibleSurface(const NormalisedSurface& surface, std::size_t count,
                                                std::vector<std::uint32_t>* hidden = nullptr);

}  // namespace volto::rig
