// volto bake: a performance on a character, to files. The same input gives the same bytes.
#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "rig/mesh_io.h"
#include "rig/rig_file.h"
#include "tools/cli/bake_picture.h"
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
  std::string take;
  std::string rig;
  std::string obj;
  std::string csv;
  std::string png;
  std::string view = "front";
  std::size_t every = 1;
  bool sheet = false;
  TrackingFlags tracking;
};

// One file format being written; frames arrive in order, finish() puts in place what must be whole.
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t t_ns) = 0;
  virtual void finish() {}
};

class ObjSink : public Sink {
 public:
  ObjSink(std::filesystem::path folder, const rig::Mesh& mesh)
      : folder_(std::move(folder)), mesh_(mesh), positions_(mesh.positions) {
    makeOutputFolder(folder_);
  }

  void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t) override {
    for (std::size_t v = 0; v < avatar.vertices.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        positions_(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) =
            static_cast<double>(avatar.vertices[v][axis]);
      }
    }
    rig::writeObj(folder_ / frameFileName(number, ".obj"), mesh_, positions_);
  }

 private:
  std::filesystem::path folder_;
  const rig::Mesh& mesh_;
  rig::VertexPositions positions_;
};

class CsvSink : public Sink {
 public:
  CsvSink(const std::string& path, const rig::Rig& rig) : file_(path) {
    std::vector<std::string> names;
    for (const rig::Blendshape& shape : rig.blendshapes) names.push_back(shape.name);
    pipeline::appendWeightsHeader(text_, names);
    file_.write(text_);
  }

  void frame(std::size_t, const AvatarFrame& avatar, std::int64_t t_ns) override {
    text_.clear();
    pipeline::appendWeightsRow(text_, t_ns, avatar.weights, avatar.observed, avatar.head);
    file_.write(text_);
  }

  void finish() override { file_.commit(); }

 private:
  OutputFile file_;
  std::string text_;
};

class PngSink : public Sink {
 public:
  PngSink(const Options& options, const rig::Rig& rig, std::size_t frames)
      : baker_({options.png, options.view, options.sheet}, rig, frames) {}
  void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t t_ns) override {
    baker_.frame(number, t_ns, avatar);
  }
  void finish() override { baker_.finish(); }

 private:
  PictureBaker baker_;
};

int run(const Options& options) {
  if (options.obj.empty() && options.csv.empty() && options.png.empty()) {
    throw CommandError(kWrongUsage, "say what to make: --obj DIR, --csv F or --png F; see volto help bake");
  }
  requireReadable(options.rig);
  for (const std::string& output : {options.csv, options.png}) {
    if (output.empty()) continue;
    requireDifferent(options.take, output);
    requireDifferent(options.rig, output);
  }
  const rig::Rig rig = rig::readRig(options.rig);
  const pipeline::Performance performance = readPerformanceFor("bake", options.take);
  const bool mesh = !options.obj.empty() || !options.png.empty();
  pipeline::FramePath path(rig, trackingOptions(options.tracking, performance), {.mesh = mesh, .weights = true});

  const std::size_t count = (performance.frameCount() + options.every - 1) / options.every;
  std::vector<std::unique_ptr<Sink>> sinks;
  if (!options.obj.empty()) sinks.push_back(std::make_unique<ObjSink>(options.obj, rig.neutral));
  if (!options.csv.empty()) sinks.push_back(std::make_unique<CsvSink>(options.csv, rig));
  if (!options.png.empty()) sinks.push_back(std::make_unique<PngSink>(options, rig, count));

  Progress progress("baking frame", performance.frameCount());
  for (std::size_t frame = 0; frame < performance.frameCount(); ++frame) {
    if (stopRequested()) throw CommandError(kFailed, "stopped before the end; what is not complete was not written");
    path.push(performance,
              frame);  // every frame, also those that are not written: filters and warm starts depend on it
    if (frame % options.every != 0) continue;
    for (const auto& sink : sinks) sink->frame(frame, path.avatar(), performance.time(frame));
    progress.show(frame);
  }
  for (const auto& sink : sinks) sink->finish();
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
  app.add_option("--obj", options->obj,
                 "a folder for one OBJ file per frame, frame_000000.obj and so on; head pose not applied")
      ->type_name("DIR");
  app.add_option("--csv", options->csv,
                 "weights of the character's blendshapes and head angles, a row per frame; - is standard output")
      ->type_name("F");
  app.add_option(
         "--png", options->png,
         "pictures: a folder for one per frame, or with --sheet, or where the name ends in .png, one sheet of moments")
      ->type_name("F|DIR");
  app.add_option("--every", options->every, "write every Nth frame (default 1)")
      ->type_name("N")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}));
  app.add_option("--view", options->view, "front, three-quarter or side (default front)")
      ->type_name("VIEW")
      ->check(CLI::IsMember({"front", "three-quarter", "side"}));
  app.add_flag("--sheet", options->sheet,
               "--png makes one contact sheet of several moments, spread over the performance");
  addTrackingFlags(app, options->tracking);
  return [options] { return run(*options); };
}

}  // namespace volto::cli
