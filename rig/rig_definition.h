// A rig definition, R.json: what a person decided about a head's rig, kept beside the mesh so that it outlives the rig
// file. All of it is optional:
//
// {
//   "feature_points": {"2.1": 4711, "3.7": [x, y, z]},        as in P.json; may be partial
//   "fade_out": 1.2,                                           eye separations, 0.1 to 5
//   "blend_width": 0.5,                                        triangle sizes, 0 to 5
//   "labels": {"5.1": "left cheek"},                           region of a point: which lip or lid it counts with
//   "regions": [
//     {"triangle": ["2.4", "8.3", "8.5"],                      or a number 0 to 135, or "region": "chin" for all of it
//      "add": [["8.7", "8.3", "2.4"]], "remove": [17],         triangles of its neighbourhood
//      "stiffness": 1.5}                                       factor, 0.1 to 10
//   ],
//   "parts": [{"vertex": 8123, "follows": "jaw", "name": "lower denture"}],   head, jaw, left eye, right eye, skin
//   "subdivision": {"levels": 2, "triangles": [["2.4", "8.3", "8.5"]]}        or {"budget": 200}, or {"vertices": [...]}
// }
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rig/build_rig.h"

namespace volto::rig {

struct RigDefinition {
  FeaturePointChoices points;
  std::optional<double> fade_out_es, blend_width;
  RegionEdits edits;
  std::vector<PartEdit> parts;
  Subdivision subdivision;

  // What is said here goes into `options`; what is not stays.
  void applyTo(RigOptions& options) const;
  // Indices against a mesh. Throws InputError.
  void check(const Mesh& mesh) const;
};

// Throws InputError "NAME: KEY: what": unknown keys with the nearest known one, values of a wrong kind or out of range.
RigDefinition parseRigDefinition(std::string_view json, const std::string& name_for_errors);

// Readable JSON that parses to the same definition.
std::string formatRigDefinition(const RigDefinition& definition);

// What rebuilds this rig from its mesh: its points, the options it was made with, and the vertices that subdivision
// chose.
RigDefinition definitionOf(const Rig& rig, const RigOptions& options);

}  // namespace volto::rig
