// volto bake: a performance on a character, to files. The same input gives the same bytes.
#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "rig/file_bytes.h"
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
#include "tools/export/glb_file.h"
#include "tools/export/livelink_csv.h"
#include "tools/export/movement.h"
#include "tools/pipeline/weights_csv.h"

namespace volto::cli {

namespace {

struct Options {
  std::string take;
  std::string rig;
  std::string obj;
  std::string csv;
  std::string glb;
  std::string livelink;
  std::string png;
  std::string view = "front";
  std::size_t every = 1;
  bool sheet = false;
  bool animate = false;
  int size_px = 0;
  double from_s = 0;
  double to_s = 0;  // 0: to the end
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
    if (mesh_.materials.empty()) return;
    options_.material_library = "materials.mtl";
    rig::writeMtl(folder_ / options_.material_library, mesh_);
  }

  void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t) override {
    for (std::size_t v = 0; v < avatar.vertices.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        positions_(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) =
            static_cast<double>(avatar.vertices[v][axis]);
      }
    }
    rig::writeObj(folder_ / frameFileName(number, ".obj"), mesh_, positions_, options_);
  }

 private:
  std::filesystem::path folder_;
  const rig::Mesh& mesh_;
  rig::VertexPositions positions_;
  rig::ObjOptions options_;
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

class LiveLinkSink : public Sink {
 public:
  LiveLinkSink(const std::string& path, const rig::Rig& rig) : rows_(rig), file_(path) {
    file_.write(exporter::liveLinkHeader());
  }

  void frame(std::size_t, const AvatarFrame& avatar, std::int64_t t_ns) override {
    text_.clear();
    rows_.append(text_, t_ns, avatar);
    file_.write(text_);
  }

  void finish() override { file_.commit(); }

 private:
  exporter::LiveLinkRows rows_;
  OutputFile file_;
  std::string text_;
};

class GlbSink : public Sink {
 public:
  GlbSink(const std::string& path, const rig::Rig& rig) : path_(path), rig_(rig), recorder_(rig) {
    requireReplaceable(path);
  }
  void frame(std::size_t, const AvatarFrame& avatar, std::int64_t t_ns) override { recorder_.add(avatar, t_ns); }
  void finish() override { rig::writeFileAtomically(path_, exporter::formatGlb(rig_, &recorder_.movement())); }

 private:
  std::string path_;
  const rig::Rig& rig_;
  exporter::MovementRecorder recorder_;
};

class PngSink : public Sink {
 public:
  PngSink(const Options& options, const rig::Rig& rig, std::size_t frames)
      : baker_({options.png, options.view, options.sheet, options.animate, options.size_px}, rig, frames) {}
  void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t t_ns) override {
    baker_.frame(number, t_ns, avatar);
  }
  void finish() override { baker_.finish(); }

 private:
  PictureBaker baker_;
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
  if (options.animate && (options.png.empty() || options.sheet)) {
    throw CommandError(kWrongUsage, "--animate makes one moving picture of --png F; it needs --png and no --sheet");
  }
  if (options.obj.empty() && options.csv.empty() && options.png.empty() && options.glb.empty() &&
      options.livelink.empty()) {
    throw CommandError(kWrongUsage,
                       "say what to make: --obj DIR, --glb F, --csv F, --livelink F or --png F; see volto help bake");
  }
  requireReadable(options.rig);
  for (const std::string& output : {options.csv, options.png, options.glb, options.livelink}) {
    if (output.empty()) continue;
    requireDifferent(options.take, output);
    requireDifferent(options.rig, output);
  }
  const rig::Rig rig = rig::readRig(options.rig);
  const pipeline::Performance performance = readPerformanceFor("bake", options.take);
  const bool mesh = !options.obj.empty() || !options.png.empty() || !options.glb.empty();
  pipeline::FramePath path(rig, trackingOptions(options.tracking, performance), {.mesh = mesh, .weights = true});

  const std::vector<std::size_t> wanted = framesToWrite(performance, options);
  if (wanted.empty()) throw CommandError(kWrongUsage, "no frame lies between --from and --to");
  std::vector<std::unique_ptr<Sink>> sinks;
  if (!options.obj.empty()) sinks.push_back(std::make_unique<ObjSink>(options.obj, rig.neutral));
  if (!options.csv.empty()) sinks.push_back(std::make_unique<CsvSink>(options.csv, rig));
  if (!options.livelink.empty()) sinks.push_back(std::make_unique<LiveLinkSink>(options.livelink, rig));
  if (!options.glb.empty()) sinks.push_back(std::make_unique<GlbSink>(options.glb, rig));
  if (!options.png.empty()) sinks.push_back(std::make_unique<PngSink>(options, rig, wanted.size()));

  Progress progress("baking frame", wanted.back() + 1);
  std::size_t next = 0;
  for (std::size_t frame = 0; frame <= wanted.back(); ++frame) {
    if (stopRequested()) throw CommandError(kFailed, "stopped before the end; what is not complete was not written");
    path.push(performance, frame);  // also those that are not written: filters and warm starts depend on them
    if (frame != wanted[next]) continue;
    ++next;
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
  app.add_option(
         "--glb", options->glb,
         "one GLB file: the character with its blendshapes as morph targets, and the performance as its animation")
      ->type_name("F.glb");
  app.add_option("--livelink", options->livelink,
                 "weights in Live Link Face's CSV format, with the true times as timecode; - is standard output")
      ->type_name("F.csv");
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
  app.add_flag("--animate", options->animate, "--png makes one animated PNG (APNG) of all frames written");
  app.add_option("--size", options->size_px,
                 "width and height of a picture (default 512; tile of a sheet 320, animation 288)")
      ->type_name("PX")
      ->check(CLI::Range(16, 4096));
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
