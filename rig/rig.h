// A rigged character: all that is needed to deform its mesh, computed once by buildRig (rig/build_rig.h).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rig/contacts.h"
#include "rig/control_mask.h"
#include "rig/expression_table.h"
#include "rig/fapu.h"
#include "rig/mesh.h"
#include "rig/refined_mask.h"
#include "rig/rig_options.h"

namespace volto::rig {

// Vertex displacement = operator x mask displacement. #V by 84, compressed rows, the same weight for x, y and z.
// Both displacements are in the mesh's own unit and frame. A row may be empty: that vertex never moves.
struct DeformationOperator {
  std::vector<std::uint32_t> row_start;  // #V + 1
  std::vector<std::uint8_t> point;       // feature point index, ascending within a row
  std::vector<float> weight;

  std::size_t vertexCount() const { return row_start.empty() ? 0 : row_start.size() - 1; }
};

// How a vertex came to its triangle (Queiroz, section IV-B.2).
enum class AssociationKind : std::uint8_t { ray = 0, geodesic = 1, rigid_part = 2, outside = 3 };

struct Association {
  std::vector<std::int16_t> triangle;     // #V: mask triangle, -1 for a vertex that does not move
  std::vector<AssociationKind> kind;      // #V
};

// A separate component that moves as one piece, or not at all.
struct RigidPart {
  using Follows = RigidPartFollows;
  std::string name;                        // "left eyeball", "upper teeth", ... or the material's name
  Follows follows = Follows::head;
  std::vector<std::uint32_t> vertices;
  std::array<double, 3> centre{0, 0, 0};   // mesh frame; an eyeball turns about it
};

// Displacement of some vertices, mesh frame and unit.
struct SparseDisplacement {
  std::vector<std::uint32_t> vertex;       // ascending
  std::vector<std::array<float, 3>> displacement;

  bool empty() const { return vertex.empty(); }
};

// A blendshape of the character. The displacement of the mask in mesh units and MESH frame; the mesh follows by the operator.
struct Blendshape {
  std::string name;
  std::array<std::array<float, 3>, kFeaturePointCount> mask_displacement{};
  bool moves_mask = true;                  // false: not observable from the mask (tongueOut)
  SparseDisplacement correction;           // what 84 points cannot say; added at the shape's weight
};

// A correction for shapes that act together, or for the way of one shape between its ends.
struct Combination {
  enum class Rule : std::uint8_t {
    product = 0,  // its weight is the product over its drivers of the shape's weight w, or of 4 w (1 - w) for one that is `halfway`
    excess = 1,   // two drivers: by how much the first one's weight exceeds the second's, never below 0
  };
  struct Driver {
    std::uint16_t shape = 0;               // index into Rig::blendshapes
    bool halfway = false;
  };
  std::string name;
  Rule rule = Rule::product;
  std::vector<Driver> drivers;             // at least one
  SparseDisplacement correction;
};

// Parts that turn as bones do: lower teeth and tongue about the hinge of the jaw, an eyeball about its centre. The motion is
// the sum over the blendshapes of weight x turn; what the operator does to these vertices is replaced by it.
struct PartMotion {
  struct Turn {
    std::uint16_t shape = 0;               // index into Rig::blendshapes
    std::array<float, 3> rotation{};       // axis times angle in radians at weight 1, mesh frame
    std::array<float, 3> translation{};    // at weight 1, mesh frame and unit
  };
  RigidPart::Follows follows = RigidPart::Follows::jaw;
  std::array<float, 3> pivot{};            // mesh frame
  std::vector<std::uint32_t> vertices;     // ascending
  std::vector<float> share;                // one per vertex, 0..1: of the motion
  std::vector<Turn> turns;                 // ascending by shape
};

struct Rig {
  std::string name;                        // of the character: mesh file's stem by default
  std::string mesh_file;                   // file name only, for people
  Mesh neutral;

  std::array<std::int32_t, kFeaturePointCount> feature_vertex{};  // vertex index in file order, -1 for a free position
  FeaturePointPositions feature_positions;                        // mesh frame
  Eigen::Matrix3d mesh_from_head = Eigen::Matrix3d::Identity();   // rotation: head frame -> mesh frame
  FapuMeasurement fapu;                                           // measured in the head frame, mesh unit

  Association association;
  std::array<std::vector<std::uint8_t>, kMaskTriangleCount> region_of_influence;  // control points of each triangle's RBF
  DeformationOperator deformation;
  std::vector<RigidPart> rigid_parts;
  std::vector<Blendshape> blendshapes;                            // the 52 ARKit names by default
  std::vector<Combination> combinations;
  std::vector<PartMotion> part_motions;
  Contacts contacts;
  RefinedMask refined;                                            // empty unless subdivision was asked for
};

}  // namespace volto::rig
