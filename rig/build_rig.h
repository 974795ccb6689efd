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
#include "rig/rig_options.h"

namespace volto::rig {

// What P.json says: a vertex index (0-based, file order) or a position in the mesh's frame, for each feature point.
using FeaturePointChoice = std::variant<std::uint32_t, Eigen::Vector3d>;
using FeaturePointChoices = std::map<std::size_t, FeaturePointChoice>;  // key: feature point index

// {"feature_points": {"2.1": 4711, "3.7": [x, y, z], ...}}. Throws InputError with file, line or key.
FeaturePointChoices parseFeaturePoints(std::string_view json, const std::string& name_for_errors);

// Throws InputError when points are missing (names them), repeated, out of range, all in one place or not finite, or
// when the mesh is (no polygons, an index out of range, a position that is not finite). Deterministic. A head of 26 719
// vertices takes about a second.
Rig buildRig(const Mesh& neutral, const FeaturePointChoices& points, const RigOptions& options = {});

}  // namespace volto::rig
