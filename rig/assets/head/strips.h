// The parts of the skin whose form is given by curves and not by the field: lid margins, lips and mouth bag, nostrils,
// ears. Each strip has coordinates (ring, around): ring grows inward from the skin, around follows the ring clockwise
// seen from in front (for the ear: from the side).
#pragma once

#include "rig/assets/head/vec3.h"

namespace volto::head {

enum class Strip : unsigned char { none, eye, mouth, nostril, ear };

// Eye: around 0 inner corner, 4 middle of the upper lid, 8 outer corner, 12 middle of the lower lid (period 16).
inline constexpr double kOrbit = 1, kLidCrease = 2, kLidMarginFront = 3, kLidMarginBack = 4, kLidPocket = 5;
inline constexpr int kEyeAround = 16;
// Mouth: around 0 middle of the upper lip, 5 corner, 10 middle of the lower lip (left half, not closed).
inline constexpr double kLipBorder = 2, kLipRim = 4, kMouthVestibule = 5, kMouthBack = 7;
inline constexpr int kMouthAround = 10;
// Nostril: period 4, on the skin; what lies within the rim is sunk at the end. Ear: period 12, 0 in front, 3 on top.
inline constexpr double kNostrilRim = 2, kNostrilFloor = 4;
inline constexpr int kNostrilAround = 4;
inline constexpr double kEarRoot = 1, kEarFloor = 8;
inline constexpr int kEarAround = 12;

Vec3 stripPoint(Strip strip, double ring, double around);
int stripPeriod(Strip strip);  // 0: not closed

// The ear's own directions (unit length, at right angles) and the middle of its root.
struct EarFrame {
  Vec3 origin, back, up, out;
};
EarFrame earFrame();

// Where the lid margin's outer edge is, and the line where the closed lips meet (left half: corner at around 5).
Vec3 lidMargin(double around);

}  // namespace volto::head
