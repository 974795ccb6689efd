// What makes one character of the generator another: named proportions and a palette. The skin, its loops, its parts
// and its 84 points are made once, as the adult's; a character's proportions then move every vertex by one smooth map
// of space (reshape). The map is one to one, so a reshaped head has the same topology, closes where the adult closes
// and has its points at the same vertices.
#pragma once

#include <array>
#include <string>

#include "rig/assets/head/half_mesh.h"
#include "rig/assets/head/tint.h"

namespace volto::head {

// Factors are of the adult's measure, shifts and lengths in centimetres. The defaults change nothing, to the bit.
struct Proportions {
  // Skull: above the cheeks, about its middle.
  double skull_width = 1, skull_height = 1, skull_length = 1;
  double neck_thickness = 1;
  // Eyes: the ball and its lids are scaled and moved as one rigid piece, so that the lids keep lying on the ball;
  // what is around follows with the distance.
  double eye_size = 1;
  Vec3 eye_shift{};          // of the left eye
  double lid_opening = 0;    // 0 the adult's; 1 about twice as far open. The lids turn about the ball's centre.
  double lid_thickness = 0;  // added to the lids' front (before eye_size): a lid that travels far must clear the ball
  double iris_size = 1, pupil_size = 1;  // relative to the ball
  // Nose, about its root on the face.
  double nose_width = 1, nose_height = 1, nose_depth = 1;
  // Mouth and what is level with it; chin below it.
  double mouth_width = 1;
  double mouth_smile = 0;  // how far the corners stand higher
  double chin_width = 1, chin_rise = 0, chin_retreat = 0;
  // Ears: all of the ear off the head, in its own plane; then a tip of this length; and turned away from the head.
  double ear_size = 1, ear_tip = 0, ear_flare = 0;  // flare in radians
  double hair_thickness = 0.75;                     // 0: bald
  int smoothness = 0;  // rounds of evening out what lies between eyes, nose, lips and ears: fewer folds, rounder forms
};

using Palette = std::array<std::array<double, 3>, static_cast<std::size_t>(Material::count)>;  // linear RGB

struct Character {
  std::string file;  // name of its files, without ending
  std::string name;  // for the files' first lines
  Proportions proportions;
  Palette palette;
  Tints tints;
};

Character adult();     // volto_head: human proportions
Character creature();  // volto_creature: a cartoon being with a round skull, big eyes, a wide mouth and pointed ears

Vec3 eyeCentre(const Proportions& proportions);  // left
double eyeRadius(const Proportions& proportions);

// Moves the vertices to the character's proportions. Only |x| decides, and the midline stays where it is.
void reshape(const Proportions& proportions, HalfMesh& mesh);
// What lies on the skin and is no part of it (brows): goes where the skin under it went, evening out included.
void reshapeOnSkin(const Proportions& proportions, const HalfMesh& adult_skin, const HalfMesh& skin, HalfMesh& part);
// The eyeball: scaled and moved only.
void reshapeEyeball(const Proportions& proportions, HalfMesh& mesh);

}  // namespace volto::head
