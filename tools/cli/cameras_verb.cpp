// volto cameras: which cameras there are and what they can do, and a try of one.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "capture/v4l2/camera_source.h"
#include "capture/v4l2/discovery.h"
#include "tools/cli/camera_flags.h"
#include "tools/cli/describe_cameras.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/verb.h"
#include "tools/picture/png.h"

namespace volto::cli {

namespace {

using Json = nlohmann::ordered_json;
using capture::ImageSource;
using capture::Next;
using capture::SourceState;

struct Options {
  std::string camera;
  bool json = false;
  double try_s = 0;
  std::string png;
  CameraFlags flags;
};

const char* stateName(SourceState state) {
  switch (state) {
    case SourceState::no_signal:
      return "no signal";
    case SourceState::streaming:
      return "streaming";
    case SourceState::stalled:
      return "stalled";
    case SourceState::ended:
      return "ended";
  }
  return "";
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

// How the stream went.
struct Trial {
  std::vector<double> age_ms;    // of each picture, from the camera's time to its pixels
  std::vector<double> states_s;  // when the state changed
  Json states = Json::array();
  double seconds = 0;
};

Trial watch(ImageSource& source, const Options& options, capture::Image& image) {
  const std::unique_ptr<capture::v4l2::System> clock = capture::v4l2::makeRealSystem();
  const std::int64_t start = clock->nowNs();
  const auto end = start + static_cast<std::int64_t>(options.try_s * 1e9);
  Trial trial;
  SourceState last = SourceState::no_signal;
  for (std::int64_t now = start; now < end && !stopRequested(); now = clock->nowNs()) {
    const Next next = source.next(image, std::chrono::nanoseconds(std::min<std::int64_t>(end - now, 100'000'000)));
    const std::int64_t after = clock->nowNs();
    if (next == Next::frame) trial.age_ms.push_back(static_cast<double>(after - image.t_capture_ns) * 1e-6);
    if (source.state() == last) continue;
    last = source.state();
    const double at_s = static_cast<double>(after - start) * 1e-9;
    trial.states.push_back({{"at_s", at_s}, {"state", stateName(last)}, {"notice", source.notice()}});
    if (!options.json) std::printf("%8.3f s  %s  %s\n", at_s, stateName(last), source.notice().c_str());
  }
  trial.seconds = static_cast<double>(clock->nowNs() - start) * 1e-9;
  return trial;
}

Json describeTrial(const ImageSource& source, const Trial& trial) {
  const capture::SourceInfo& info = source.info();
  const capture::SourceCounters& counters = source.counters();
  return {{"camera", info.name},
          {"path", info.location},
          {"format", info.format},
          {"width", info.width},
          {"height", info.height},
          {"fps_agreed", info.rate_hz},
          {"fps_delivered", info.delivered_hz},
          {"seconds", trial.seconds},
          {"age_ms", {{"p50", quantile(trial.age_ms, 0.5)}, {"p99", quantile(trial.age_ms, 0.99)}}},
          {"counters",
           {{"captured", counters.captured},
            {"dropped", counters.dropped},
            {"corrupt", counters.corrupt},
            {"sequence_gaps", counters.sequence_gaps},
            {"decode_warnings", counters.decode_warnings},
            {"bad_timestamps", counters.bad_timestamps},
            {"stalls", counters.stalls},
            {"restarts", counters.restarts},
            {"losses", counters.losses},
            {"reconnects", counters.reconnects}}},
          {"states", trial.states},
          {"notice", source.notice()}};
}

void writePicture(const std::string& path, const capture::Image& image) {
  picture::Picture out(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::size_t at = 3 * static_cast<std::size_t>(y * image.width + x);
      out.set(x, y, {image.bgr[at + 2], image.bgr[at + 1], image.bgr[at]});
    }
  }
  picture::writePng(path, out);
}

int tryCamera(const Options& options) {
  capture::Image image;
  const std::unique_ptr<ImageSource> source = capture::openCamera(cameraOptions(options.camera, options.flags));
  const Trial trial = watch(*source, options, image);
  const Json described = describeTrial(*source, trial);
  if (options.json) {
    std::puts(described.dump(2).c_str());
  } else {
    const capture::SourceInfo& info = source->info();
    const capture::SourceCounters& counters = source->counters();
    std::printf("%s: %s %dx%d at %.4g fps agreed, %.4g fps delivered\n", info.location.c_str(), info.format.c_str(),
                info.width, info.height, info.rate_hz, info.delivered_hz);
    std::printf(
        "%llu pictures in %.1f s; age p50 %.1f ms, p99 %.1f ms; lost by the camera %llu, passed over %llu, broken "
        "%llu\n",
        static_cast<unsigned long long>(counters.captured), trial.seconds, quantile(trial.age_ms, 0.5),
        quantile(trial.age_ms, 0.99), static_cast<unsigned long long>(counters.sequence_gaps),
        static_cast<unsigned long long>(counters.dropped), static_cast<unsigned long long>(counters.corrupt));
    if (!source->notice().empty()) std::printf("%s\n", source->notice().c_str());
  }
  if (source->counters().captured == 0)
    throw CommandError(kUnavailable, source->info().location + ": not one picture came");
  if (!options.png.empty()) writePicture(options.png, image);
  return kDone;
}

int run(const Options& options) {
  const bool flags = !options.flags.size.empty() || options.flags.fps != 0 || !options.flags.format.empty() ||
                     !options.flags.controls.empty();
  if (options.try_s == 0) {
    if (flags || !options.png.empty() || !options.camera.empty())
      throw CommandError(kWrongUsage, "a camera, its format and --png are for a try; add --try SECONDS");
    const std::unique_ptr<capture::v4l2::System> system = capture::v4l2::makeRealSystem();
    const std::vector<capture::v4l2::Camera> cameras = capture::v4l2::listCameras(*system);
    if (options.json)
      std::puts(describeCameras(cameras).dump(2).c_str());
    else
      std::fputs(camerasInWords(cameras).c_str(), stdout);
    return kDone;
  }
  if (!(options.try_s > 0 && options.try_s <= 86'400))
    throw CommandError(kWrongUsage, "--try takes seconds, up to a day");
  return tryCamera(options);
}

}  // namespace

RunVerb defineCameras(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("camera", options->camera,
                 "with --try: camera:/dev/video0, camera:NAME (part of its name will do); default the first one");
  app.add_flag("--json", options->json, "for programs");
  app.add_option("--try", options->try_s, "take pictures for so long and say how it went")->type_name("SECONDS");
  app.add_option("--png", options->png, "with --try: write the last picture there")->type_name("FILE");
  addCameraFlags(app, options->flags);
  return [options] { return run(*options); };
}

}  // namespace volto::cli
