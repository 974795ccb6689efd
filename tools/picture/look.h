// What the surfaces of a head are made of: colour, gloss, softness, and eyes that look somewhere.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rig/mesh.h"
#include "tools/picture/vec3.h"

namespace volto::picture {

struct Surface {
  std::string name;
  Vec3 albedo{0.5F, 0.5F, 0.5F};  // linear RGB 0..1
  float specular = 0.03F;         // mirror reflection looking straight at the surface
  float gloss = 24.0F;            // exponent of the highlight: 8 matt .. 300 wet
  float softness = 0.0F;          // 1: light wanders inside, as in skin
  bool drawn = true;
  int eyeball = -1;  // index into Look::eyeballs: iris and pupil are painted on by direction from the centre
};

// A ball on which iris and pupil are painted where it faces `axis`. In the mesh's frame and unit, at neutral: the paint
// turns with the vertices.
struct Eyeball {
  Vec3 centre, axis;
  float iris_rad = 0.50F;  // half the angle that the iris takes, seen from the centre
  float pupil_rad = 0.20F;
  Vec3 iris{0.10F, 0.17F, 0.22F};
};

struct Look {
  std::vector<Surface> surfaces;
  std::vector<std::uint16_t> polygon_surface;  // #P, index into surfaces
  std::vector<Vec3> vertex_tint;               // empty, or #V: multiplies the albedo
  std::vector<Eyeball> eyeballs;
};

// Throws std::invalid_argument for a mesh without polygons, with a vertex index out of range or without any finite
// position.
void checkDrawable(const rig::Mesh& mesh);

// A surface as the well-known names of parts say ("skin", "lips", "iris", "pupil", "eye_white", "teeth", "eyelashes",
// ...; matched inside the name, upper and lower case alike). Skin for a name that says nothing.
Surface surfaceByName(std::string_view name);

// Whether the mesh says itself what it looks like: materials with a colour or a telling name, or vertex colours.
bool hasOwnLook(const rig::Mesh& mesh);

// The mesh's materials: their own colour where the file gives one, else by name; vertex colours multiply them, or stand
// for them where there are none. A mesh that says nothing (hasOwnLook): skin, with separate components told by their
// shape (thin films over eyeballs are left out). Eyeballs on which no material or vertex colour shows an iris get one
// painted, that looks along +z. Throws as checkDrawable does.
Look lookOf(const rig::Mesh& mesh);

}  // namespace volto::picture
