// From a neutral mesh and its feature points to a Rig: the semiautomatic rigging of Queiroz, Braun, Musse, section
// IV-B.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "rig/errors.h"
#include "rig/rig.h"

namespace volto::rig {

// What P.json says: a vertex index (0-based, file order) or a position in the mesh's frame, for each feature point.
using FeaturePointChoice = std::variant<std::uint32_t, Eigen::Vector3d>;
using FeaturePointChoices = std::map<std::size_t, FeaturePointChoice>;  // key: feature point index

// {"feature_points": {"2.1": 4711, "3.7": [x, y, z], ...}}. Throws InputError with file, line or key.
FeaturePointChoices parseFeaturePoints(std::string_view json, const std::string& name_for_errors);

struct RigOptions {
  std::string name;       // character name; empty: mesh_file without its extension
  std::string mesh_file;  // file name of the mesh, for people
  // How far beyond the mask's outline the skin still follows it, as a fraction of the eye separation (geodesic). 0.1
  // to 5.
  double fade_out_es = 1.2;
  // Over how wide a band neighbouring regions of influence are blended, as a fraction of the local triangle size. 0
  // to 5.
  double blend_width = 0.5;
};

// Throws InputError when points are missing (names them), repeated, out of range, all in one place or not finite, or
// when the mesh is (no polygons, an index out of range, a position that is not finite). Deterministic. A head of 26 719
// vertices takes about a second.
Rig buildRig(const Mesh& neutral, const FeaturePointChoices& points, const RigOptions& options = {});

}  // namespace volto::rig
