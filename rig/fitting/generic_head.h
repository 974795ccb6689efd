// The generic head that is bent onto others: the shipped head, compiled in, with the 84 points where people have them.
// Orvalho, Zacur, Susin, section 3 and 4.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rig/feature_points.h"
#include "rig/fitting/human_face.h"
#include "rig/mesh.h"

namespace volto::rig {

// A place on a triangle mesh.
struct SurfacePlace {
  std::array<std::uint32_t, 3> vertices{};
  std::array<double, 3> weights{1, 0, 0};
};

struct GenericHead {
  Mesh mesh;               // the asset, every vertex; head frame, unit: the eye separation, bent to human proportions
  std::vector<bool> skin;  // per vertex of mesh: on the component that carries the points

  // The outside of the face: what is cut out of the skin along the lids and the inner lips, up to a third of an eye
  // separation beyond the control mask. Its vertices are vertices of `mesh`.
  Mesh face;
  std::vector<std::uint32_t> vertex_of_face;
  std::array<SurfacePlace, kFeaturePointCount> points;  // on `face`
  HumanFace human;                                      // where the points are; nearly the places above
};

// Made once, on first use (some 0.1 s); no file is read. Only the points and the topology of the asset are relied on.
const GenericHead& genericHead();

// The shipped head bent to other proportions: for measuring with people left out.
GenericHead makeGenericHead(const HumanFace& human);

}  // namespace volto::rig
