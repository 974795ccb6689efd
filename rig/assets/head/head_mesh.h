// The whole head: skin and parts, both sides, and its 84 feature points. Deterministic: the same build and the same
// source give the same bytes, and rounding to five decimals on writing takes away what mathematical libraries differ
// in.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "rig/assets/head/character.h"
#include "rig/assets/head/half_mesh.h"

namespace volto::head {

struct Component {
  std::string name;  // OBJ group
  int first_vertex = 0, vertex_count = 0;
};

struct Head {
  Character character;
  std::vector<Vec3> vertices;     // centimetres, +x subject's left, +y up, +z out of the face
  std::vector<Vec3> tints;        // linear factors of the materials' colours, 0..1
  std::vector<int> mirror;        // vertex of the other side; itself on the midline
  std::vector<Polygon> polygons;  // grouped by component, counter-clockwise from outside
  std::vector<int> polygon_component;
  std::vector<Component> components;
  std::vector<std::pair<std::string, int>> feature_points;  // id, vertex: all 84, in the mask's order
};

Head makeHead(const Character& character = adult());

std::string materialName(Material material);

// The files: numbers with five decimals, no negative zero.
std::string objText(const Head& head, const std::string& mtl_file);
std::string mtlText(const Character& character);
std::string pointsText(const Head& head);

}  // namespace volto::head
