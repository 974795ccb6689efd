// What volto inspect tells and shows of a rig's expressions.
#pragma once

#include <string>

#include "rig/rig.h"
#include "tools/cli/file_description.h"

namespace volto::cli {

// {"triangles", "flipped", "degenerate", "blink_gap_es", ..., "worst": [poses with anything wrong]}; lengths are parts
// of the eye separation.
Json expressionReport(const rig::Rig& rig);

// The same of a performance on this character, frame by frame, tracked as volto bake does: {"frames", "flipped",
// "degenerate", "frames_with_flips", "eyeball_depth_es", "lids_depth_es", "lips_depth_es", "worst_frame"}. Some
// milliseconds a frame. Throws as readPerformanceFor.
Json performanceReport(const rig::Rig& rig, const std::string& path);
std::string performanceInWords(const Json& report);

// PNG sheets: every blendshape; the twelve combined expressions. Written whole or not at all. Throws CommandError.
void writeShapeSheet(const std::string& path, const rig::Rig& rig, int cell_px);
void writeCombinationSheet(const std::string& path, const rig::Rig& rig, int cell_px);

}  // namespace volto::cli
