// The left half of the skin while it is being made: polygons over vertices that know how they are held in place.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "rig/assets/head/strips.h"
#include "rig/assets/head/vec3.h"

namespace volto::head {

enum class Hold : unsigned char {
  skin,    // free to slide, drawn onto the field
  strip,   // where stripPoint(strip, ring, around) says
  linear,  // between its neighbours of the coarser mesh
};

struct HalfVertex {
  Vec3 position;
  Hold hold = Hold::skin;
  Strip strip = Strip::none;
  double ring = 0, around = 0;
  bool midline = false;
  Vec3 tint{1, 1, 1};   // linear factors of the material's colour
  bool border = false;  // lower end of the neck: keeps its height
};

enum class Material : unsigned char {
  skin,
  hair,
  lips,
  mouth,
  nostril,
  eye_white,
  iris,
  iris_rim,
  pupil,
  caruncle,
  teeth,
  gums,
  tongue,
  lashes,
  brows,
  count
};

struct Polygon {
  std::vector<int> corners;  // counter-clockwise seen from outside
  Material material = Material::skin;
  std::vector<std::array<double, 2>> uv;  // of each corner, or empty so far
};

struct HalfMesh {
  std::vector<HalfVertex> vertices;
  std::vector<Polygon> polygons;
};

// About 500 polygons: a grid around the head with blocks of rings for eye, mouth, nostril and ear, and a cap on the
// skull.
HalfMesh makeCage();

// Splits every polygon into quads, one per corner (the topology of Catmull and Clark); new strip vertices get their
// strip coordinates.
HalfMesh split(const HalfMesh& coarse);

// Raises the hair off the skull by up to `thickness`, ramping up from the hair line.
void raiseHair(HalfMesh& mesh, double thickness);

// Sinks the skin within the nostrils' rims.
void sinkNostrils(HalfMesh& mesh);

// Takes small unevenness out of the skin without shrinking it (Taubin, "A signal processing approach to fair surface
// design", 1995); lids, lips, nostrils, ears and the neck's border stay.
void polish(HalfMesh& mesh, int rounds);

// Turns the corners of quads so that the fan from the first corner, which is how programs cut a polygon, makes no sliver:
// of the two diagonals the one whose worse triangle is rounder, where that makes a difference.
void startAtBetterCorner(HalfMesh& mesh);

// Evens out the skin vertices: each moves toward the middle of its neighbours by `strength` and back onto the field.
void relax(HalfMesh& mesh, int rounds, double strength);

}  // namespace volto::head
