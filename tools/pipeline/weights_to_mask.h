// Weights that were recorded as such (Live Link Face) to the mask: straight through the expression table, no tracking.
#pragma once

#include "frames/mask_frame.h"
#include "frames/weight_frame.h"
#include "rig/expression_table.h"

namespace volto::pipeline {

// Allocates nothing. Every point of a face that is there counts as measured; the weights stay beside the mask as they
// were.
void maskFromWeights(const WeightFrame& in, const rig::ExpressionTable& table, MaskFrame& out);

}  // namespace volto::pipeline
