#include "tools/cli/tracking_flags.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <CLI/CLI.hpp>

#include "tools/cli/exit_status.h"
#include "tools/cli/read_input.h"

namespace volto::cli {

namespace {
constexpr double kMostSmoothing = 100.0;
}

void addTrackingFlags(CLI::App& app, TrackingFlags& flags) {
  app.add_flag("--2d", flags.two_d, "use the 2D points only, even where the input has 3D");
  app.add_option("--neutral", flags.neutral,
                 "a second or more of the same face at rest, in any of the formats (default: found in the performance)")
      ->type_name("N");
  app.add_flag(
      "--causal", flags.causal,
      "look at no frame before its time, as live; without this the neutral face is found in the whole performance");
  app.add_option("--smoothing", flags.smoothing, "0: no filter; 1: as live; more: smoother and later (default 1)")
      ->type_name("X");
}

pipeline::Performance readPerformanceFor(const char* verb, const std::string& path) {
  requireReadable(path, true);
  pipeline::Performance performance = pipeline::readPerformance(path);
  constexpr std::size_t kMostWarnings = 20;
  for (std::size_t i = 0; i < std::min(performance.warnings.size(), kMostWarnings); ++i) {
    std::fprintf(stderr, "volto %s: warning: %s\n", verb, performance.warnings[i].c_str());
  }
  return performance;
}

pipeline::TrackingOptions trackingOptions(const TrackingFlags& flags, const pipeline::Performance& performance) {
  if (!(flags.smoothing >= 0 && flags.smoothing <= kMostSmoothing)) {
    throw CommandError(kWrongUsage, "--smoothing is not a number from 0 to 100; 1 is as live");
  }
  pipeline::TrackingOptions options;
  options.tracker.use_3d = !flags.two_d;
  options.tracker.smoothing = flags.smoothing;
  if (!flags.neutral.empty()) {
    requireReadable(flags.neutral);
    const pipeline::Performance rest = pipeline::readPerformance(flags.neutral);
    const bool has_face =
        std::any_of(rest.landmarks.begin(), rest.landmarks.end(), [](const auto& frame) { return frame.face_present; });
    if (!has_face) {
      throw CommandError(kBadData,
                         flags.neutral + ": holds no landmarks of a face; record a second of the face at rest");
    }
    options.neutral = tracker::neutralFromRest(rest.landmarks, options.tracker);
  } else if (!flags.causal) {
    options.neutral = pipeline::neutralOf(performance, options.tracker);
  }
  return options;
}

}  // namespace volto::cli
