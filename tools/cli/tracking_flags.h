// The options that say how landmarks are tracked: the same words in every verb that does.
#pragma once

#include <string>

#include "tools/pipeline/frame_path.h"

namespace CLI {
class App;
}

namespace volto::cli {

struct TrackingFlags {
  bool two_d = false;
  bool causal = false;
  std::string neutral;
  double smoothing = 1.0;
};

void addTrackingFlags(CLI::App& app, TrackingFlags& flags);

// Reads the performance and prints its warnings, one line each, on standard error. Throws as pipeline::readPerformance,
// and CommandError.
pipeline::Performance readPerformanceFor(const char* verb, const std::string& path);

// The neutral is taken from --neutral, else from the whole performance, else (--causal) from what has gone by.
pipeline::TrackingOptions trackingOptions(const TrackingFlags& flags, const pipeline::Performance& performance);

}  // namespace volto::cli
