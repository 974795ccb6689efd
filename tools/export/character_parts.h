// A character taken apart as renderers want it: vertices with one texture coordinate each, triangles by material, the
// eyes for themselves.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rig/rig.h"

namespace volto::exporter {

struct ExportMaterial {
  std::string name;
  std::array<float, 3> colour{0.8F, 0.8F, 0.8F};  // linear RGB
  float opacity = 1.0F;
  float roughness = 0.6F;
  bool double_sided = false;

  friend bool operator==(const ExportMaterial&, const ExportMaterial&) = default;
};

struct ExportPart {
  std::string name;
  std::array<double, 3> origin{0, 0,
                               0};  // mesh frame: what its vertices are given relative to, and what it turns about
  bool eye = false;
  std::vector<std::uint32_t> vertex;            // of each of its vertices: index into the artist's mesh
  std::vector<std::array<float, 2>> texcoords;  // empty, or one per vertex; v counted from the bottom
  std::vector<std::array<float, 3>> colours;    // empty, or one per vertex: linear, multiplies the material's colour
  struct Group {
    std::uint32_t material;
    std::vector<std::uint32_t> corners;  // three per triangle, indices into `vertex`
  };
  std::vector<Group> groups;
};

struct CharacterParts {
  std::vector<ExportMaterial> materials;
  std::vector<ExportPart> parts;  // the face (all that is not an eye), then left and right eye where there are any
};

// Materials are the mesh's own; a mesh without any gets those of its pictures (tools/picture/rig_look.h): skin, eyes
// with iris and pupil, teeth, painted lips and brows. In the face every vertex of the artist's that is in no eye is
// there, in the artist's order; those that a seam of texture coordinates needs twice come after them again.
CharacterParts takeApart(const rig::Rig& rig);

}  // namespace volto::exporter
