// volto run: a camera, a video or landmarks from another program on a character, live.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "capture/datagrams.h"
#include "capture/detection/network.h"
#include "capture/v4l2/camera_options.h"
#include "capture/v4l2/camera_source.h"
#include "capture/video/video_source.h"
#include "protocol/endpoint.h"
#include "protocol/publisher.h"
#include "protocol/take_writer.h"
#include "protocol/topics.h"
#include "rig/rig_file.h"
#include "tools/cli/camera_flags.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/first_subscriber.h"
#include "tools/cli/model_flags.h"
#include "tools/cli/output_file.h"
#include "tools/cli/read_input.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/verb.h"
#include "tools/cli/weight_names.h"
#include "tools/pipeline/character.h"
#include "tools/pipeline/live.h"
#include "tools/pipeline/preview.h"
#include "tools/pipeline/preview_window.h"
#include "tools/pipeline/profile_file.h"
#include "tracker/landmark_layout.h"

namespace volto::cli {

namespace {

constexpr double kMostSmoothing = 100.0;
constexpr auto kStep = std::chrono::milliseconds(100);
constexpr auto kPatience = std::chrono::milliseconds(250);  // with a file whose reading stalled

struct Options {
  std::string source;
  std::string rig;
  std::string endpoint = std::string(protocol::kDefaultEndpoint);
  ModelFlags models;
  CameraFlags camera;
  bool wait_for_camera = false;
  bool realtime = false, loop = false;
  double smoothing = 1.0, focal_length_px = 0;
  tracker::RegionSmoothing regions{.head = 1.0};
  double hold_s = 0.2, ease_s = 0.5;
  bool keep_head = false;
  std::string profile;
  std::string record;
  bool force = false;
  std::string preview, sheet;
  bool window = false;
  WeightNameFlags names;
  bool no_mesh = false, stats = false;
  int threads = 0;
  double wait_s = 0, seconds = 0;

  bool wantsPreview() const { return window || !preview.empty() || !sheet.empty(); }
};

pipeline::LiveInput openInput(const Options& options) {
  pipeline::LiveInput input;
  input.name = options.source;
  if (options.source.starts_with("udp://")) {
    try {
      capture::DatagramOptions datagrams = capture::parseDatagramAddress(options.source);
      datagrams.choice = capture::parseFaceChoice(options.models.face);
      input.datagrams = std::make_unique<capture::LandmarkDatagrams>(datagrams);
    } catch (const std::invalid_argument& error) {
      throw CommandError(kWrongUsage, error.what());
    }
    return input;
  }
  if (options.source.find("://") != std::string::npos) {
    throw CommandError(
        kWrongUsage, options.source + " is no source; give camera:NAME, a video file, or udp://HOST:PORT (landmarks)");
  }
  input.finder.emplace(makeFaceFinder(options.models));
  if (capture::isCameraSpec(options.source)) {
    capture::CameraOptions camera = cameraOptions(options.source, options.camera);
    camera.wait_for_camera = options.wait_for_camera;
    input.images = capture::openCamera(camera);
    return input;
  }
  input.live = false;
  capture::VideoOptions video{.realtime = options.realtime, .patience = kPatience, .loop = options.loop};
  if (options.camera.fps > 0) video.sequence_rate_hz = options.camera.fps;
  input.images = capture::openVideo(options.source, video);
  input.name = std::filesystem::path(options.source).filename().string();
  return input;
}

double ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

void printStages(const pipeline::LiveReport& report) {
  std::printf("  %-16s %8s %8s %9s %9s %9s %8s %7s\n", "stage", "frames", "rate/s", "p50 ms", "p99 ms", "max ms",
              "dropped", "waiting");
  for (const pipeline::StageReport& stage : report.stages) {
    std::printf("  %-16s %8llu %8.1f %9.3f %9.3f %9.3f %8llu %7u\n", stage.name.c_str(),
                static_cast<unsigned long long>(stage.count), stage.rate_hz, ms(stage.latency.percentile(0.5)),
                ms(stage.latency.percentile(0.99)), ms(stage.latency.maximum()),
                static_cast<unsigned long long>(stage.dropped), stage.waiting);
  }
  const capture::FaceFinderCounters& f = report.finder;
  if (f.frames > 0) {
    const auto per_frame = [&](std::int64_t ns) { return ms(ns) / static_cast<double>(f.frames); };
    std::printf(
        "  detection: detector %.3f ms a frame (%llu searches, %llu checks), landmarks %.3f ms (%llu runs), "
        "pupils %.3f ms; of all that the networks themselves %.3f ms; %llu doubts, %llu losses\n",
        per_frame(f.detector_ns), static_cast<unsigned long long>(f.searches),
        static_cast<unsigned long long>(f.checks), per_frame(f.landmarks_ns),
        static_cast<unsigned long long>(f.networks), per_frame(f.pupils_ns), per_frame(f.networks_ns),
        static_cast<unsigned long long>(f.doubts), static_cast<unsigned long long>(f.losses));
  }
}

std::uint64_t droppedBy(const pipeline::LiveReport& report) {
  std::uint64_t dropped = 0;
  for (const pipeline::StageReport& stage : report.stages) dropped += stage.dropped;
  return dropped;
}

void printLine(const pipeline::LiveReport& report) {
  std::string line;
  char text[128];
  for (const pipeline::StageReport& stage : report.stages) {
    std::snprintf(text, sizeof text, "%s%s %.2f ms", line.empty() ? "" : ", ", stage.name.c_str(),
                  ms(stage.latency.percentile(0.5)));
    line += text;
  }
  std::fprintf(stderr, "volto run: %llu frames, %llu with a face, %llu dropped; %s\n",
               static_cast<unsigned long long>(report.frames_sent), static_cast<unsigned long long>(report.faces),
               static_cast<unsigned long long>(droppedBy(report)), line.c_str());
}

void printSummary(const Options& options, const pipeline::LiveReport& report) {
  if (options.stats) printStages(report);
  const pipeline::StageReport& whole = report.stages.back();
  std::printf(
      "%llu frames in %.2f s, %.1f a second, %llu with a face; %llu dropped, %llu broken; arrival to sent p50 "
      "%.2f ms, p99 %.2f ms\n",
      static_cast<unsigned long long>(report.frames_sent), report.seconds,
      report.seconds > 0 ? static_cast<double>(report.frames_sent) / report.seconds : 0.0,
      static_cast<unsigned long long>(report.faces), static_cast<unsigned long long>(droppedBy(report)),
      static_cast<unsigned long long>(report.source.corrupt + report.datagrams.refused + report.datagrams.wrong_size),
      ms(whole.latency.percentile(0.5)), ms(whole.latency.percentile(0.99)));
}

void saveProfile(const std::string& path, const std::optional<tracker::NeutralFace>& neutral) {
  if (path.empty() || !neutral) return;
  OutputFile file(path);
  file.write(pipeline::profileText(*neutral));
  file.commit();
}

// Says each new thing about the source once, and the figures once a second where they are wanted.
class Watcher {
 public:
  explicit Watcher(bool stats) : stats_(stats) {}

  void look(const pipeline::LiveReport& report) {
    if (report.notice != notice_) {
      notice_ = report.notice;
      if (!notice_.empty()) std::fprintf(stderr, "volto run: %s\n", notice_.c_str());
    }
    if (report.calibrations != calibrations_) {
      calibrations_ = report.calibrations;
      std::fprintf(stderr, "volto run: calibrated: the face of the last second is taken to be at rest\n");
    }
    if (stats_ && report.seconds >= next_s_) {
      next_s_ = std::floor(report.seconds) + 1;
      printLine(report);
    }
  }

 private:
  bool stats_;
  std::string notice_;
  std::uint64_t calibrations_ = 0;
  double next_s_ = 1;
};

int run(const Options& options) {
  if (!(options.smoothing >= 0 && options.smoothing <= kMostSmoothing))
    throw CommandError(kWrongUsage, "--smoothing is not a number from 0 to 100; 1 is the default");
  protocol::parseEndpoint(options.endpoint);  // wrong usage is told before anything is opened
  for (const std::string& path : {options.preview, options.sheet, options.profile})
    if (!path.empty()) requireReplaceable(path);
  if (!options.record.empty()) {
    requireReplaceable(options.record);
    std::error_code ignored;
    if (!options.force && std::filesystem::exists(options.record, ignored))
      throw CommandError(kFailed, options.record + ": exists already; give --force to replace it, or another name");
  }
  requireReadable(options.rig);
  const rig::Rig rig = rig::readRig(options.rig);

  pipeline::LiveOptions live_options;
  live_options.translation = translationFor(options.names, rig);
  live_options.tracking.tracker.smoothing = options.smoothing;
  live_options.tracking.tracker.regions = options.regions;
  live_options.tracking.tracker.focal_length_px = options.focal_length_px;
  live_options.tracking.tracker.hold_s = options.hold_s;
  live_options.tracking.tracker.ease_s = options.ease_s;
  live_options.tracking.tracker.keep_head = options.keep_head;
  std::error_code ignored;
  if (!options.profile.empty() && std::filesystem::exists(options.profile, ignored))
    live_options.tracking.neutral = pipeline::readProfile(options.profile);
  capture::setNetworkThreads(options.threads);
  pipeline::LiveInput input = openInput(options);
  live_options.every_frame = !input.live && !options.realtime;
  if (!live_options.every_frame && options.threads == 0) capture::measureNetworkThreads();
  live_options.tracking.tracker.from_pixels = true;
  live_options.mesh = !options.no_mesh || options.wantsPreview();
  live_options.mesh_on_demand = !options.wantsPreview();

  std::optional<pipeline::Preview> preview;
  if (options.wantsPreview()) {
    pipeline::PreviewOptions preview_options;
    preview_options.live = options.preview;
    preview_options.sheet = options.sheet;
    if (options.window) preview_options.window = "Volto: " + input.name;
    try {
      preview.emplace(rig, preview_options);
    } catch (const pipeline::NoDisplay& error) {
      throw CommandError(kUnavailable, std::string("--window: ") + error.what() +
                                           "; give --preview F.png, a picture that is made anew again and again");
    }
    live_options.keep_images = true;
    live_options.look = [&preview](const pipeline::LiveFrame& frame) { preview->look(frame); };
  }

  protocol::PublisherOptions publisher_options;
  publisher_options.endpoint = options.endpoint;
  publisher_options.source = protocol::topicNameFrom(input.name);
  publisher_options.when_full = live_options.every_frame ? protocol::WhenFull::wait : protocol::WhenFull::newest_wins;
  protocol::Publisher publisher(publisher_options);
  protocol::Character character = pipeline::characterOf(rig, !options.no_mesh);
  if (live_options.translation) rename(*live_options.translation, character);
  publisher.setCharacter(character);

  std::optional<protocol::TakeWriter> take;
  if (!options.record.empty()) {
    protocol::TakeHeader header;
    header.name = std::filesystem::path(options.record).stem().string();
    header.source = input.name;
    header.layout = tracker::layoutName(input.finder ? input.finder->layout() : LandmarkLayout::openseeface66);
    header.program = "volto " VOLTO_VERSION;
    protocol::TakeWriterOptions take_options;
    take_options.force = options.force;
    take_options.reproducible = live_options.every_frame;  // the same video gives the same bytes
    take.emplace(options.record, header, take_options);
  }

  waitForFirstSubscriber(publisher, options.wait_s);

  installCalibrateSignal();
  const bool input_shows_pictures = input.finder.has_value();
  pipeline::Live live(rig, std::move(input), publisher, live_options, take ? &*take : nullptr);
  Watcher watcher(options.stats);
  live.start();
  while (!stopRequested() && !live.waitForEnd(kStep)) {
    if (calibrateRequested()) live.recalibrate();
    const pipeline::LiveReport report = live.report();
    watcher.look(report);
    if (options.seconds > 0 && report.seconds >= options.seconds) break;
  }
  live.stop();
  const pipeline::LiveReport report = live.report();
  watcher.look(report);
  if (preview) preview->finish();
  if (input_shows_pictures && report.frames_sent > 0 && report.finder.faces == 0)
    std::fprintf(stderr,
                 "volto run: %s: no face in any of the pictures; is it lit, upright and not too "
                 "small? --sheet F.png shows what was seen\n",
                 options.source.c_str());
  saveProfile(options.profile, live.neutral());
  printSummary(options, report);
  if (take) {
    const protocol::Result result = take->finish();
    if (!result.ok()) throw CommandError(kFailed, options.record + ": " + result.problem);
  }
  return kDone;
}

}  // namespace

RunVerb defineRun(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("source", options->source,
                 "camera:/dev/video0, camera:NAME (see volto cameras), a video, animated GIF, image or image sequence "
                 "(frames/%04d.png, a folder), or udp://HOST:PORT: landmarks from OpenSeeFace (port 11573)")
      ->required()
      ->type_name("SOURCE");
  app.add_option("--rig", options->rig, "the character, made by volto rig")->required()->type_name("C.rig");
  app.add_option("--publish", options->endpoint,
                 "where subscribers connect: ipc://NAME ($XDG_RUNTIME_DIR/volto/NAME), ipc:///path or "
                 "tcp://127.0.0.1:PORT (default ipc://main)")
      ->type_name("ENDPOINT");
  addModelFlags(app, options->models);
  app.add_flag("--realtime", options->realtime,
               "a file at its own pace, the newest picture wins (default: every picture, as fast as can be)");
  app.add_flag("--loop", options->loop, "a file from the start again, until stopped");
  addCameraFlags(app, options->camera);
  app.add_flag("--wait-for-camera", options->wait_for_camera, "begin although the camera is not there yet");
  app.add_option("--smoothing", options->smoothing, "0: no filter; 1: the default; more: smoother and later")
      ->type_name("X");
  for (const auto& [name, value] : {std::pair{"--smooth-lids", &options->regions.lids},
                                    {"--smooth-brows", &options->regions.brows},
                                    {"--smooth-mouth", &options->regions.mouth},
                                    {"--smooth-cheeks", &options->regions.cheeks},
                                    {"--smooth-head", &options->regions.head},
                                    {"--smooth-gaze", &options->regions.gaze}}) {
    app.add_option(name, *value, "this region more (above 1) or less (below 1) than the others")
        ->type_name("X")
        ->check(CLI::Range(0.0, kMostSmoothing));
  }
  app.add_option("--focal", options->focal_length_px,
                 "focal length of the camera in pixels (default: guessed from the picture's size)")
      ->type_name("PX")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--hold", options->hold_s,
                 "a face that is lost: its last expression and pose stay for so long (default 0.2)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 86400.0));
  app.add_option("--ease", options->ease_s, "... and then go back to neutral and upright within so long (default 0.5)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 86400.0));
  app.add_flag("--keep-head", options->keep_head, "... but the head stays turned as it was seen last");
  app.add_option("--profile", options->profile,
                 "the actor's profile: read if it is there, written at the end; kill -USR1 takes the face of the next "
                 "second as the face at rest")
      ->type_name("F");
  app.add_option("--record", options->record, "the landmarks of every frame into a take")->type_name("TAKE");
  app.add_flag("--force", options->force, "replace a take that exists");
  app.add_option("--preview", options->preview,
                 "a picture of the face with landmarks and axes beside the avatar, made anew twice a second")
      ->type_name("F.png");
  app.add_flag("--window", options->window, "the same in a window");
  app.add_option("--sheet", options->sheet, "at the end: moments of the performance, face beside avatar")
      ->type_name("F.png");
  addWeightNameFlags(app, options->names);
  app.add_flag("--no-mesh", options->no_mesh, "weights only: neither compute nor publish the deformed mesh");
  app.add_option(
         "--threads", options->threads,
         "of the networks (default 0: live one or one per processor, whichever is quicker at the time; else one per "
         "processor)")
      ->type_name("N")
      ->check(CLI::Range(0, 64));
  app.add_option("--wait", options->wait_s, "wait at most so long for a first subscriber (default 0: do not wait)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 86400.0));
  app.add_option("--seconds", options->seconds, "stop after so long (default 0: at the end, or never)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 1e9));
  app.add_flag("--stats", options->stats, "every second, and at the end: what each stage does and how long it takes");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
