// What volto inspect tells and shows of a rig's expressions.
#pragma once

#include <string>

#include "rig/rig.h"
#include "tools/cli/file_description.h"

namespace volto::cli {

// {"triangles", "flipped", "degenerate", "blink_gap_es", ..., "worst": [poses with anything wrong]}; lengths are parts
// of the eye separation.
Json expressionReport(const rig::Rig& rig);

// PNG sheets: every blendshape; the twelve combined expressions. Written whole or not at all. Throws CommandError.
void writeShapeSheet(const std::string& path, const rig::Rig& rig, int cell_px);
void writeCombinationSheet(const std::string& path, const rig::Rig& rig, int cell_px);

}  // namespace volto::cli
