// volto bake: a performance on a character, to files. The same input gives the same bytes.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "rig/rig_file.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/frame_files.h"
#include "tools/cli/progress.h"
#include "tools/cli/read_input.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/tracking_flags.h"
#include "tools/cli/verb.h"

namespace volto::cli {

namespace {

struct Options {
  std::string take;
  std::string rig;
  FrameFileFlags files;
  std::size_t every = 1;
  double from_s = 0;
  double to_s = 0;  // 0: to the end
  TrackingFlags tracking;
};

// Every Nth frame of the stretch that was asked for, counted from the start of the performance.
std::vector<std::size_t> framesToWrite(const pipeline::Performance& performance, const Options& options) {
  std::vector<std::size_t> frames;
  for (std::size_t frame = 0; frame < performance.frameCount(); frame += options.every) {
    const double t_s = static_cast<double>(performance.time(frame) - performance.time(0)) * 1e-9;
    if (t_s >= options.from_s && (options.to_s <= 0 || t_s <= options.to_s)) frames.push_back(frame);
  }
  return frames;
}

int run(const Options& options) {
  const FrameFileFlags& files = options.files;
  files.requireConsistent();
  if (!files.any()) {
    throw CommandError(kWrongUsage,
                       "say what to make: --obj DIR, --glb F, --csv F, --livelink F or --png F; see volto help bake");
  }
  requireReadable(options.rig);
  requireDifferent({options.take, options.rig}, files.files());
  const rig::Rig rig = rig::readRig(options.rig);
  const pipeline::Performance performance = readPerformanceFor("bake", options.take);
  pipeline::FramePath path(rig, trackingOptions(options.tracking, performance),
                           {.mesh = files.wantMesh(), .weights = true});

  const std::vector<std::size_t> wanted = framesToWrite(performance, options);
  if (wanted.empty()) throw CommandError(kWrongUsage, "no frame lies between --from and --to");
  const std::vector<std::unique_ptr<FrameFile>> written = openFrameFiles(files, rig, wanted.size());

  Progress progress("baking frame", wanted.back() + 1);
  std::size_t next = 0;
  for (std::size_t frame = 0; frame <= wanted.back(); ++frame) {
    if (stopRequested()) throw CommandError(kFailed, "stopped before the end; what is not complete was not written");
    path.push(performance, frame);  // also those that are not written: filters and warm starts depend on them
    if (frame != wanted[next]) continue;
    ++next;
    for (const auto& file : written) file->frame(frame, path.avatar(), performance.time(frame));
    progress.show(frame);
  }
  for (const auto& file : written) file->finish();
  return kDone;
}

}  // namespace

RunVerb defineBake(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option(
         "take", options->take,
         "a take, an OpenFace CSV file with landmarks, or a Live Link Face CSV file; - is CSV from standard input")
      ->required()
      ->type_name("TAKE");
  app.add_option("--rig", options->rig, "the character, made by volto rig")->required()->type_name("C.rig");
  addFrameFileFlags(app, options->files);
  app.add_option("--every", options->every, "write every Nth frame (default 1)")
      ->type_name("N")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}));
  app.add_option("--from", options->from_s, "write from this second of the performance on (default 0)")
      ->type_name("S")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--to", options->to_s, "write up to this second (default: the end)")
      ->type_name("S")
      ->check(CLI::Range(0.0, 1e6));
  addTrackingFlags(app, options->tracking);
  return [options] { return run(*options); };
}

}  // namespace volto::cli
