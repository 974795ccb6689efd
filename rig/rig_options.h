// What a person may choose or change when a head is rigged. All of it can be kept in a file: rig/rig_definition.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "rig/feature_points.h"
#include "rig/mesh.h"

namespace volto::rig {

enum class RigidPartFollows : std::uint8_t { head = 0, jaw = 1, left_eye = 2, right_eye = 3, skin = 4 };

// What a person changed about the regions (rig/rig_definition.h).
struct RegionEdits {
  struct Neighbourhood {
    std::vector<std::uint8_t> add, remove;  // triangles of the control mask whose points count too, or no longer
    bool operator==(const Neighbourhood&) const = default;
  };
  std::map<std::uint8_t, Neighbourhood> neighbourhoods;  // key: triangle of the control mask
  std::map<std::uint8_t, double> stiffness;              // key: triangle; factor on Eck's stiffness, 0.1 to 10
  std::map<std::uint8_t, FaceRegion> labels;             // key: feature point; which lip or lid it counts with
  bool operator==(const RegionEdits&) const = default;
};

// A separate piece of the mesh that a person told what to follow.
struct PartEdit {
  std::uint32_t vertex = 0;  // any vertex of the piece
  RigidPartFollows follows = RigidPartFollows::head;
  std::string name;          // empty: as found
  bool operator==(const PartEdit&) const = default;
};

// Of the control mask (rig/subdivision.h).
struct Subdivision {
  int levels = 0;                       // 0 to 6
  std::vector<std::uint8_t> triangles;  // of the control mask, to be subdivided `levels` times; empty: all
  std::size_t budget = 0;               // > 0: automatic, at most so many points more; `levels` is not used
  // These vertices become points, in this order, each splitting the triangle it lies in; what an automatic choice came
  // to, kept. Then neither levels nor budget are used.
  std::vector<std::uint32_t> vertices;

  bool any() const { return levels > 0 || budget > 0 || !vertices.empty(); }
  bool operator==(const Subdivision&) const = default;
};

struct RigOptions {
  std::string name;       // character name; empty: mesh_file without its extension
  std::string mesh_file;  // file name of the mesh, for people
  // How far beyond the mask's outline the skin still follows it, as a fraction of the eye separation (geodesic). 0.1
  // to 5.
  double fade_out_es = 1.2;
  // Over how wide a band neighbouring regions of influence are blended, as a fraction of the local triangle size. 0
  // to 5.
  double blend_width = 0.5;
  RegionEdits edits;
  std::vector<PartEdit> parts;
  Subdivision subdivision;                // of the control mask: fills Rig::refined
  std::vector<VertexPositions> examples;  // displacements of all vertices, for the automatic choice alone
};

}  // namespace volto::rig
