#include "tools/cli/mask_examples.h"

#include "rig/expression_table.h"
#include "tools/cli/bake_picture.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/tracking_flags.h"
#include "tools/pipeline/frame_path.h"
#include "tools/pipeline/weights_to_mask.h"

namespace volto::cli {
namespace {

constexpr std::size_t kMostMeshes = 100'000;

MaskExamples fromTable() {
  MaskExamples out;
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    WeightFrame weights;
    weights.face_present = true;
    weights.weights[k] = 1.0F;
    weights.observed.set();
    out.names.emplace_back(kArkitBlendshapeNames[k]);
    pipeline::maskFromWeights(weights, rig::ExpressionTable::standard(), out.frames.emplace_back());
  }
  return out;
}

}  // namespace

MaskExamples readMaskExamples(const std::string& examples, std::size_t every) {
  if (examples == "table") return fromTable();
  const pipeline::Performance performance = readPerformanceFor("transfer", examples);
  if (performance.frameCount() / every > kMostMeshes)
    throw CommandError(kBadData, examples + ": " + std::to_string(performance.frameCount()) +
                                     " frames would be as many meshes; take fewer by --every N");
  pipeline::Tracking tracking(trackingOptions({}, performance));
  MaskExamples out;
  MaskFrame mask;
  for (std::size_t frame = 0; frame < performance.frameCount(); ++frame) {
    tracking.push(performance, frame, mask);  // also those that are not used: its filters depend on them
    if (frame % every != 0) continue;
    out.names.push_back(frameFileName(frame, ""));
    out.frames.push_back(mask);
  }
  if (out.frames.empty()) throw CommandError(kBadData, examples + ": holds no frames");
  return out;
}

}  // namespace volto::cli
