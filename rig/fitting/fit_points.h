// The 84 feature points of a head from a few of them: the generic head is bent onto it by thin-plate splines, stuck to
// its surface, and the points are read off. Orvalho, Zacur, Susin, sections 4.1 to 4.3.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rig/build_rig.h"
#include "rig/fitting/generic_head.h"

namespace volto::rig {

// A landmark that is only about right (rig/finding).
struct RoughPoint {
  std::size_t feature_point = 0;
  Eigen::Vector3d position;  // mesh frame
  double sigma_es = 0.05;    // standard deviation in eye separations
};

struct FitOptions {
  const GenericHead* head = nullptr;  // what is bent; nothing: genericHead()
};

// Where a vertex of the generic head comes to lie on the target: for transfer of anything defined on the generic head.
struct CorrespondingPlace {
  SurfacePlace place;      // vertices of the target mesh
  double distance_es = 0;  // between the bent generic head and this place
  double trust = 0;        // 0: not on the skin or nothing corresponds; 1: the normals agree and the surfaces touch
};

struct FittedPoints {
  FeaturePointChoices points;                           // all 84; given ones exactly as given
  FeaturePointPositions positions;                      // the same, mesh frame
  std::array<double, kFeaturePointCount> confidence{};  // 0..1; given points: 1
  std::vector<std::size_t> to_check;                    // feature points that a person should look at, worst first
  std::vector<std::string> notes;                       // what a person should know, one sentence each
  std::size_t folded_triangles = 0;                     // of the generic face, that had to be unfolded on the way
  std::vector<CorrespondingPlace> dense;                // per vertex of the generic head's mesh
};

// Given points stay exactly where they are; at least kFewestPoints of given and rough ones together are needed.
// Ten that pin a face down well: kTenPoints. The mesh may lie anyhow, in any unit, inside out, mirrored. Throws
// InputError, one line: too few points, all in one place or on one line, one far off the surface (named, with its
// distance), left and right exchanged (named). Deterministic, single-threaded.
inline constexpr std::size_t kFewestPoints = 4;
extern const std::array<std::string_view, 10> kTenPoints;
FittedPoints fitPoints(const Mesh& mesh, const FeaturePointChoices& given, std::span<const RoughPoint> rough = {},
                       const FitOptions& options = {});

// All 84 given: nothing is fitted, but the same is refused (far off the surface, left and right exchanged), points of a
// mirror image are renamed, and a point that is far from where the others of a human face would have it is named in a
// note.
struct CheckedPoints {
  FeaturePointChoices points;
  std::vector<std::string> notes;
};
CheckedPoints checkPoints(const Mesh& mesh, const FeaturePointChoices& given);

}  // namespace volto::rig
