// A small head made from the reference mask, with everything about it known by construction: skin that is cut where the
// mask is (eyes, mouth), a skirt around the outline, and parts.
#pragma once

#include <map>

#include "rig/build_rig.h"

namespace volto::test {

struct TestHead {
  rig::Mesh mesh;
  rig::FeaturePointChoices points;                // vertex of each feature point
  std::vector<std::vector<std::uint32_t>> skirt;  // strips from the outline outward: skirt[i][0] lies on the outline
  double skirt_step = 0;                          // distance from ring to ring, mm
  std::vector<std::uint32_t> upper_mouth, lower_mouth;      // inner lip contour, halves without the corners
  std::map<std::string, std::vector<std::uint32_t>> parts;  // "left eye", "upper teeth", ...
};

struct TestHeadOptions {
  int subdivisions = 2;        // of every mask triangle
  bool parts = false;          // eyeballs, teeth, lashes, hair
  bool closed_lips = false;    // inner lower lip contour moved onto the upper one
  bool split_midline = false;  // vertices on x = 0 doubled, as a texture seam does
};
TestHead makeTestHead(const TestHeadOptions& options = {});

// Operator row of a vertex, all 84 weights.
std::array<double, kFeaturePointCount> rowOf(const rig::Rig& rig, std::uint32_t vertex);
// Displacement of every vertex for a displacement of the points.
rig::VertexPositions deform(const rig::Rig& rig, const rig::FeaturePointPositions& displacement);

}  // namespace volto::test
