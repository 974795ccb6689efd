// Expressions that are given as motions of the control mask rather than as meshes: what volto transfer --examples takes
// besides a folder.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "frames/mask_frame.h"

namespace volto::cli {

struct MaskExamples {
  std::vector<std::string> names;  // of the files to be written, without ending
  std::vector<MaskFrame> frames;   // FAPU units: the same for every face
};

// `table`: the 52 ARKit shapes of the expression table at full weight, under their names. A take (its masks, or its
// landmarks tracked), an OpenFace CSV file with landmarks or a Live Link Face CSV file: every Nth frame, as
// frame_000000 and so on. Throws as readPerformanceFor, and CommandError for more than 100 000 frames.
MaskExamples readMaskExamples(const std::string& examples, std::size_t every);

}  // namespace volto::cli
