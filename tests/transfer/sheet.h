// A sheet of skin with a slit in it: the least that has what a face has, a surface that bends and two margins that
// meet.
#pragma once

#include <vector>

#include "rig/mesh.h"
#include "transfer/deformation_transfer.h"

namespace volto::transfer {

struct Sheet {
  rig::Mesh mesh;
  std::vector<std::uint32_t> upper, lower;  // the slit's margins, left to right, corners left out
};

// `columns` by `rows` squares of side 1 (rows even), gently curved; the slit is the middle third of the middle row
// line, `gap` wide in the middle and tapering to its corners.
Sheet makeSheet(int columns, int rows, double gap);

// The upper margin and what is above it comes down by `amount` of the gap, less with distance.
rig::VertexPositions closed(const Sheet& sheet, double amount);
// Curls the sheet up along x.
rig::VertexPositions curled(const Sheet& sheet, double angle_rad);

// Pairs of the same columns of two sheets of the same make.
std::vector<SlitPair> pairsOf(const Sheet& source, const Sheet& target);

}  // namespace volto::transfer
