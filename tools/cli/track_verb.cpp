// volto track: landmarks to weights, without a character.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/progress.h"
#include "tools/cli/read_input.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/tracking_flags.h"
#include "tools/cli/verb.h"
#include "tools/pipeline/weights_csv.h"

namespace volto::cli {

namespace {

struct Options {
  std::string landmarks;
  std::string output;
  std::string mask;
  TrackingFlags tracking;
};

int run(const Options& options) {
  requireDifferent({options.landmarks, options.tracking.neutral}, std::vector{options.output, options.mask});
  const pipeline::Performance performance = readPerformanceFor("track", options.landmarks);
  pipeline::Tracking tracking(trackingOptions(options.tracking, performance));

  OutputFile weights_file(options.output);
  std::optional<OutputFile> mask_file;
  if (!options.mask.empty()) mask_file.emplace(options.mask);

  const std::vector<std::string> names(kArkitBlendshapeNames.begin(), kArkitBlendshapeNames.end());
  std::string text;
  pipeline::appendWeightsHeader(text, names);
  weights_file.write(text);
  if (mask_file) {
    text.clear();
    pipeline::appendMaskHeader(text);
    mask_file->write(text);
  }

  Progress progress("tracking frame", performance.frameCount());
  MaskFrame mask;
  std::array<std::uint8_t, kArkitBlendshapeCount> observed{};
  for (std::size_t frame = 0; frame < performance.frameCount(); ++frame) {
    if (stopRequested()) throw CommandError(kFailed, "stopped before the end; nothing was written");
    tracking.push(performance, frame, mask);
    for (std::size_t i = 0; i < kArkitBlendshapeCount; ++i) observed[i] = mask.arkit_observed[i] ? 1 : 0;
    text.clear();
    pipeline::appendWeightsRow(text, performance.time(frame), mask.arkit_weights, observed, mask.head);
    weights_file.write(text);
    if (mask_file) {
      text.clear();
      pipeline::appendMaskRow(text, mask);
      mask_file->write(text);
    }
    progress.show(frame);
  }
  weights_file.commit();
  if (mask_file) mask_file->commit();
  return kDone;
}

}  // namespace

RunVerb defineTrack(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("landmarks", options->landmarks,
                 "a take, an OpenFace CSV file with landmarks, or a Live Link Face CSV file (passed through); - is CSV "
                 "from standard input")
      ->required()
      ->type_name("LANDMARKS");
  app.add_option("-o,--output", options->output, "weights, a row per row of the input; - is standard output")
      ->required()
      ->type_name("W.csv");
  app.add_option("--mask", options->mask, "the 84 points too: displacements in FAPU units")->type_name("M.csv");
  addTrackingFlags(app, options->tracking);
  return [options] { return run(*options); };
}

}  // namespace volto::cli
