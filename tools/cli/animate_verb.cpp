// volto animate: a performance that is written down, on a character: to subscribers, into files, into a take.
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "protocol/endpoint.h"
#include "protocol/publisher.h"
#include "protocol/take_writer.h"
#include "protocol/topics.h"
#include "rig/rig_file.h"
#include "tools/animation/animation_script.h"
#include "tools/animation/script_player.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/first_subscriber.h"
#include "tools/cli/frame_files.h"
#include "tools/cli/nearest_match.h"
#include "tools/cli/output_file.h"
#include "tools/cli/progress.h"
#include "tools/cli/read_input.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/verb.h"
#include "tools/pipeline/character.h"
#include "tools/pipeline/pacer.h"

namespace volto::cli {
namespace {

constexpr std::size_t kScriptLimit = std::size_t{16} << 20;

struct Options {
  std::string script, rig, endpoint, take;
  FrameFileFlags files;
  double rate_hz = 60;
  double wait_s = 0;
  bool loop = false, force = false;
};

class TakeFile : public FrameFile {
 public:
  TakeFile(const Options& options, const rig::Rig& rig, animation::ScriptPlayer& player)
      : player_(player),
        character_(pipeline::characterOf(rig)),
        source_(sourceOf(options)),
        writer_(open(options, rig)) {
    (void)writer_.append(character_);
  }
  void frame(std::size_t, const AvatarFrame&, std::int64_t) override {
    check(writer_.append(player_.mask(), source_));
    // A take holds what was done; the mesh follows from it and stays out while the frame is written.
    AvatarFrame& avatar = player_.avatar();
    std::swap(avatar.vertices, vertices_);
    const protocol::Result written = writer_.append(avatar, character_.name, protocol::characterId(character_));
    std::swap(avatar.vertices, vertices_);
    check(written);
  }
  void finish() override { check(writer_.finish()); }

  static std::string sourceOf(const Options& options) {
    return protocol::topicNameFrom(options.script == "-" ? "script"
                                                         : std::filesystem::path(options.script).stem().string());
  }

 private:
  static protocol::TakeWriter open(const Options& options, const rig::Rig& rig) {
    protocol::TakeHeader header;
    header.name = std::filesystem::path(options.take).stem().string();
    header.source = sourceOf(options);
    header.note = "written script, played on " + rig.name;
    header.program = "volto " VOLTO_VERSION;
    return protocol::TakeWriter(options.take, header, {.force = options.force, .reproducible = true});
  }
  static void check(const protocol::Result& result) {
    if (!result) throw CommandError(kFailed, result.problem);
  }

  animation::ScriptPlayer& player_;
  protocol::Character character_;
  std::string source_;
  decltype(AvatarFrame::vertices) vertices_;
  protocol::TakeWriter writer_;
};

void toFiles(const Options& options, const rig::Rig& rig, animation::ScriptPlayer& player) {
  const auto frames = static_cast<std::size_t>(player.frameCount());
  std::vector<std::unique_ptr<FrameFile>> files = openFrameFiles(options.files, rig, frames);
  if (!options.take.empty()) files.push_back(std::make_unique<TakeFile>(options, rig, player));
  Progress progress("frame", frames);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    if (stopRequested()) throw CommandError(kFailed, "stopped before the end; what is not complete was not written");
    player.play(frame);
    for (const auto& file : files) file->frame(frame, player.avatar(), player.time(frame));
    progress.show(frame);
  }
  for (const auto& file : files) file->finish();
}

void toSubscribers(const Options& options, const rig::Rig& rig, animation::ScriptPlayer& player) {
  protocol::PublisherOptions publisher_options;
  publisher_options.endpoint = options.endpoint;
  publisher_options.source = TakeFile::sourceOf(options);
  publisher_options.when_full = protocol::WhenFull::wait;
  publisher_options.send_high_water_mark = 16;
  protocol::Publisher publisher(publisher_options);
  publisher.setCharacter(pipeline::characterOf(rig));
  waitForFirstSubscriber(publisher, options.wait_s);

  const pipeline::Pacer pacer(pipeline::monotonicNow(), 1.0);
  const std::int64_t round_ns = player.time(player.frameCount() > 1 ? player.frameCount() - 1 : 1);
  std::uint64_t sent = 0;
  for (std::uint64_t round = 0; round == 0 || options.loop; ++round) {
    for (std::uint64_t frame = 0; frame < player.frameCount(); ++frame) {
      // The last frame of a round is the first of the next: it is sent once.
      if (options.loop && frame + 1 == player.frameCount() && frame > 0) continue;
      const std::int64_t due = pacer.due(static_cast<std::int64_t>(round) * round_ns + player.time(frame));
      while (!stopRequested() && !pacer.wait(due)) {
      }
      if (stopRequested()) break;
      player.play(frame);
      ++sent;
      for (std::int64_t* t : {&player.mask().t_capture_ns, &player.avatar().t_capture_ns}) *t = due;
      for (std::uint64_t* seq : {&player.mask().capture_seq, &player.avatar().capture_seq}) *seq = sent;
      publisher.push(player.mask());
      publisher.push(player.avatar());
      publisher.flush();
    }
    if (stopRequested()) break;
  }
  const protocol::PublisherCounters counters = publisher.counters();
  std::printf("%llu frames sent, %llu dropped\n", static_cast<unsigned long long>(sent),
              static_cast<unsigned long long>(counters.replaced + counters.refused + counters.send_failures));
}

int run(const Options& options) {
  const bool files = options.files.any() || !options.take.empty();
  if (!files && options.endpoint.empty())
    throw CommandError(
        kWrongUsage,
        "say where to: --publish ENDPOINT, --take F.take, --glb F, --obj DIR, --csv F, --livelink F or --png F");
  if (files && !options.endpoint.empty())
    throw CommandError(kWrongUsage, "--publish plays in real time, files are written at once; give one or the other");
  if (files && options.loop) throw CommandError(kWrongUsage, "--loop is for --publish: a file would have no end");
  options.files.requireConsistent();
  if (!options.endpoint.empty()) protocol::parseEndpoint(options.endpoint);
  requireReadable(options.script, true);
  requireReadable(options.rig);
  std::vector<std::string> outputs = options.files.files();
  if (!options.take.empty()) {
    outputs.push_back(options.take);
    requireReplaceable(options.take);
  }
  requireDifferent({options.script, options.rig}, outputs);
  const rig::Rig rig = rig::readRig(options.rig);
  std::vector<std::string> shapes;
  for (const rig::Blendshape& shape : rig.blendshapes) shapes.push_back(shape.name);
  const animation::AnimationScript script =
      animation::AnimationScript::parse(readWhole(options.script, kScriptLimit), options.script, shapes, nearestMatch);
  animation::ScriptPlayer player(rig, script, options.rate_hz, !options.endpoint.empty() || options.files.wantMesh());
  if (files)
    toFiles(options, rig, player);
  else
    toSubscribers(options, rig, player);
  return kDone;
}

}  // namespace

RunVerb defineAnimate(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.footer(
      "A script has one statement per line; # begins a comment.\n"
      "  define smile = mouthSmileLeft 1, mouthSmileRight 1   a name for shapes that go together\n"
      "  to 0.4 smooth: smile 0.8, jawOpen 0.2, headYaw 10    go there in 0.4 s (linear, smooth, in, out)\n"
      "  hold 0.5                                             stay\n"
      "  repeat 3 ... end                                     again and again\n"
      "  neutral 1                                            everything to rest\n"
      "Or plainly: a duration and one weight per shape of the character on each line, gone to linearly.");
  app.add_option("script", options->script, "the script; - is standard input")->required()->type_name("SCRIPT");
  app.add_option("--rig", options->rig, "the character, made by volto rig")->required()->type_name("C.rig");
  app.add_option("--publish", options->endpoint,
                 "to subscribers, in real time: ipc://NAME, ipc:///path or tcp://127.0.0.1:PORT")
      ->type_name("ENDPOINT");
  app.add_flag("--loop", options->loop, "with --publish: from the start again, until stopped");
  app.add_option("--wait", options->wait_s, "with --publish: wait at most so long for a first subscriber (default 0)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 86400.0));
  app.add_option("--take", options->take, "a take: the mask for any character, the weights of this one")
      ->type_name("F.take");
  app.add_flag("--force", options->force, "replace a take that exists");
  app.add_option("--rate", options->rate_hz, "frames a second (default 60)")
      ->type_name("HZ")
      ->check(CLI::Range(1.0, 1000.0));
  addFrameFileFlags(app, options->files);
  return [options] { return run(*options); };
}

}  // namespace volto::cli
