// What is done to a deformed mesh after the operator: parts that turn as bones, corrections, contacts. The same
// functions when a character is rigged, when it is baked and when it is live. All of them are reentrant and allocate
// nothing.
#pragma once

#include <array>
#include <span>

#include "rig/rig.h"

namespace volto::rig {

using Position = std::array<float, 3>;

// A weight below this moves nothing that could be seen.
inline constexpr float kNoWeight = 1e-6F;

std::vector<Position> inSinglePrecision(const VertexPositions& positions);
std::vector<Position> neutralPositions(const Rig& rig);

// positions = neutral + operator x (sum of weight x mask displacement), in plain single precision: the reference for
// retarget::Deformer, and what rigging itself uses.
void poseByOperator(const Rig& rig, std::span<const float> weights, std::span<const Position> neutral,
                    std::span<Position> positions);

// Turns parts, adds corrections and combinations. `weights`: one per blendshape. Without `turn_eyes` eyeballs stay as
// they are, for a gaze that is known otherwise. Reads blendshapes' corrections, combinations and part_motions of the
// rig alone.
void addToPose(const Rig& rig, std::span<const float> weights, bool turn_eyes, std::span<const Position> neutral,
               std::span<Position> positions);

// The parts of addToPose(), for those who add corrections in another way between them: parts at rest; the weight of a
// combination; parts turned.
void putPartsBack(const Rig& rig, std::span<const Position> neutral, std::span<Position> positions);
float weightOf(const Combination& combination, std::span<const float> weights);
void turnParts(const Rig& rig, std::span<const float> weights, bool turn_eyes, std::span<Position> positions);

// All of it: operator, parts, corrections, contacts.
void pose(const Rig& rig, std::span<const float> weights, std::span<const Position> neutral,
          std::span<Position> positions);

// Throws std::invalid_argument when a correction, a motion or a contact does not fit the rig's mesh or its blendshapes,
// or holds a number that is not finite; says which.
void checkPoseData(const Rig& rig);

}  // namespace volto::rig
