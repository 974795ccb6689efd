// volto replay: a recorded performance on a character, to subscribers.
#include <charconv>
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "protocol/endpoint.h"
#include "protocol/publisher.h"
#include "protocol/topics.h"
#include "rig/rig_file.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/first_subscriber.h"
#include "tools/cli/read_input.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/tracking_flags.h"
#include "tools/cli/verb.h"
#include "tools/cli/weight_names.h"
#include "tools/pipeline/character.h"
#include "tools/pipeline/replay.h"

namespace volto::cli {

namespace {

constexpr double kFastest = 1000.0, kSlowest = 0.001;

struct Options {
  std::string take;
  std::string rig;
  std::string endpoint = std::string(protocol::kDefaultEndpoint);
  std::string speed = "1";
  double wait_s = 0;
  bool loop = false;
  bool stats = false;
  WeightNameFlags names;
  bool no_mesh = false;
  bool lossless = false;
  TrackingFlags tracking;
};

double parseSpeed(const std::string& text) {
  if (text == "max") return 0;
  double speed = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), speed);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() ||
      !(speed >= kSlowest && speed <= kFastest)) {
    throw CommandError(kWrongUsage, "--speed " + text + " is no speed; give a number from 0.001 to 1000, or max");
  }
  return speed;
}

void printStage(const char* name, const pipeline::LatencyHistogram& latency) {
  std::printf("  %-18s p50 %8.1f us  p99 %8.1f us  max %8.1f us\n", name,
              static_cast<double>(latency.percentile(0.5)) * 1e-3, static_cast<double>(latency.percentile(0.99)) * 1e-3,
              static_cast<double>(latency.maximum()) * 1e-3);
}

void printSummary(const pipeline::ReplayResult& result, bool stats) {
  if (stats) {
    printStage("tracker", result.tracker);
    printStage("retarget", result.retarget);
    printStage("landmarks to sent", result.sent);
  }
  std::printf(
      "%llu frames in %.2f s, %.1f a second; %llu dropped, %llu late, %llu missing in the recording; landmarks to sent "
      "p50 %.3f ms, "
      "p99 %.3f ms\n",
      static_cast<unsigned long long>(result.frames), result.seconds, result.rate(),
      static_cast<unsigned long long>(result.dropped), static_cast<unsigned long long>(result.late),
      static_cast<unsigned long long>(result.gaps), static_cast<double>(result.sent.percentile(0.5)) * 1e-6,
      static_cast<double>(result.sent.percentile(0.99)) * 1e-6);
}

int run(const Options& options) {
  pipeline::ReplayOptions replay_options;
  replay_options.speed = parseSpeed(options.speed);
  replay_options.loop = options.loop;
  protocol::parseEndpoint(options.endpoint);  // wrong usage is told before anything is read

  requireReadable(options.rig);
  const rig::Rig rig = rig::readRig(options.rig);
  const pipeline::Performance performance = readPerformanceFor("replay", options.take);
  pipeline::FramePath path(rig, trackingOptions(options.tracking, performance),
                           {.mesh = !options.no_mesh, .weights = true});

  std::optional<rig::ShapeTranslation> translation = translationFor(options.names, rig);
  protocol::Character character = pipeline::characterOf(rig, !options.no_mesh);
  if (translation) {
    rename(*translation, character);
    path.speakAs(std::move(*translation));
  }

  protocol::PublisherOptions publisher_options;
  publisher_options.endpoint = options.endpoint;
  publisher_options.source = protocol::topicNameFrom(performance.source);
  publisher_options.when_full = options.lossless ? protocol::WhenFull::lossless : protocol::WhenFull::wait;
  // A quarter of a second at 60 frames: a subscriber that the system makes wait so long still gets every frame of a
  // replay.
  publisher_options.send_high_water_mark = 16;
  protocol::Publisher publisher(publisher_options);
  publisher.setCharacter(character);

  // In small steps, so that a signal is heard. Without a subscriber it goes on: nobody has to listen.
  waitForFirstSubscriber(publisher, options.wait_s);
  const pipeline::ReplayResult result = pipeline::replay(performance, path, publisher, replay_options, stopRequested);
  printSummary(result, options.stats);
  return kDone;
}

}  // namespace

RunVerb defineReplay(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option(
         "take", options->take,
         "a take, an OpenFace CSV file with landmarks, or a Live Link Face CSV file; - is CSV from standard input")
      ->required()
      ->type_name("TAKE");
  app.add_option("--rig", options->rig, "the character, made by volto rig")->required()->type_name("C.rig");
  app.add_option("--publish", options->endpoint,
                 "where subscribers connect: ipc://NAME ($XDG_RUNTIME_DIR/volto/NAME), ipc:///path or "
                 "tcp://127.0.0.1:PORT (default ipc://main)")
      ->type_name("ENDPOINT");
  app.add_option("--speed", options->speed, "times as fast as recorded, or max: as fast as can be (default 1)")
      ->type_name("X|max");
  app.add_flag("--loop", options->loop, "from the start again, until stopped");
  app.add_flag("--no-mesh", options->no_mesh, "weights only: neither compute nor publish the deformed mesh");
  app.add_flag(
      "--lossless", options->lossless,
      "wait up to a second for a slow subscriber rather than let it lose frames: for recording, not for keeping time");
  app.add_option("--wait", options->wait_s, "wait at most so long for a first subscriber (default 0: do not wait)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 86400.0));
  app.add_flag("--stats", options->stats, "at the end, the time that each stage took");
  addWeightNameFlags(app, options->names);
  addTrackingFlags(app, options->tracking);
  return [options] { return run(*options); };
}

}  // namespace volto::cli
