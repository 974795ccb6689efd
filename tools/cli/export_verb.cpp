// volto export: a character, and a performance on it, for other programs.
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "rig/file_bytes.h"
#include "rig/gltf_skin.h"
#include "rig/rig_file.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/progress.h"
#include "tools/cli/read_input.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/tracking_flags.h"
#include "tools/cli/verb.h"
#include "tools/export/glb_file.h"
#include "tools/export/movement.h"
#include "tools/export/shape_folder.h"

namespace volto::cli {

namespace {

struct Options {
  std::string rig;
  std::string output;
  std::string take;
  std::string skin;
  std::size_t every = 1;
  TrackingFlags tracking;
};

constexpr const char* kStopped = "stopped before the end; what is not complete was not written";

exporter::Movement movementOf(const rig::Rig& rig, const Options& options) {
  const pipeline::Performance performance = readPerformanceFor("export", options.take);
  pipeline::FramePath path(rig, trackingOptions(options.tracking, performance), {.mesh = true, .weights = true});
  exporter::MovementRecorder recorder(rig);
  Progress progress("frame", performance.frameCount());
  for (std::size_t frame = 0; frame < performance.frameCount(); ++frame) {
    if (stopRequested()) throw CommandError(kFailed, kStopped);
    path.push(performance, frame);
    if (frame % options.every == 0) recorder.add(path.avatar(), performance.time(frame));
    progress.show(frame);
  }
  return recorder.movement();
}

rig::GltfSkin skinFor(const rig::Rig& rig, const Options& options) {
  requireReadable(options.skin);
  if (!hasExtension(options.skin, ".glb") && !hasExtension(options.skin, ".gltf"))
    throw CommandError(kBadData, options.skin + ": a skin is read from a .glb or .gltf file");
  rig::GltfSkin skin = rig::readGltfSkin(options.skin);
  if (skin.joints.empty()) throw CommandError(kBadData, options.skin + ": has no skin; export it with its armature");
  if (skin.joint.size() != rig.neutral.vertexCount())
    throw CommandError(kBadData, options.skin + ": " + std::to_string(skin.joint.size()) +
                                     " vertices, the character has " + std::to_string(rig.neutral.vertexCount()) +
                                     "; give the file that it was rigged from");
  return skin;
}

int run(const Options& options) {
  requireReadable(options.rig);
  if (!hasExtension(options.output, ".glb")) {
    if (!options.skin.empty()) throw CommandError(kWrongUsage, "--skin goes into a GLB file; OBJ files hold no bones");
    if (!options.take.empty())
      throw CommandError(kWrongUsage,
                         "--take goes into a GLB file; for a folder of OBJ files per frame use volto bake --obj");
    const std::string extension = std::filesystem::path(options.output).extension().string();
    const bool folder =
        options.output.ends_with('/') || extension.empty() || std::filesystem::is_directory(options.output);
    if (!folder)
      throw CommandError(kWrongUsage,
                         options.output + ": is neither a .glb file nor a folder for OBJ files (its name ends in /)");
    const rig::Rig rig = rig::readRig(options.rig);
    makeOutputFolder(options.output);
    Progress progress("shape", rig.blendshapes.size());
    exporter::writeShapeFolder(options.output, rig, [&](std::size_t done) {
      progress.show(done);
      return !stopRequested();
    });
    if (stopRequested()) throw CommandError(kFailed, "stopped before the end; the folder is not complete");
    return kDone;
  }
  requireDifferent(options.rig, options.output);
  requireReplaceable(options.output);
  const rig::Rig rig = rig::readRig(options.rig);
  std::optional<rig::GltfSkin> skin;
  if (!options.skin.empty()) skin = skinFor(rig, options);
  std::optional<exporter::Movement> movement;
  if (!options.take.empty()) {
    requireDifferent(options.take, options.output);
    movement = movementOf(rig, options);
  }
  rig::writeFileAtomically(options.output,
                           exporter::formatGlb(rig, movement ? &*movement : nullptr, skin ? &*skin : nullptr));
  return kDone;
}

}  // namespace

RunVerb defineExport(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("rig", options->rig, "the character, made by volto rig")->required()->type_name("C.rig");
  app.add_option("-o,--output", options->output,
                 "F.glb: the mesh with materials, its blendshapes as morph targets, eyes that turn; or a folder (DIR/) "
                 "for one OBJ file per "
                 "blendshape")
      ->required()
      ->type_name("F.glb|DIR/");
  app.add_option("--take", options->take,
                 "a performance to go into the GLB file as its animation: a take, an OpenFace CSV file with landmarks, "
                 "or a Live Link "
                 "Face CSV file")
      ->type_name("TAKE");
  app.add_option("--skin", options->skin,
                 "the GLB or glTF file that the character was rigged from: its bones and what hangs on them go into "
                 "the GLB file too")
      ->type_name("S.glb");
  app.add_option("--every", options->every, "of the take, every Nth frame (default 1)")
      ->type_name("N")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}));
  addTrackingFlags(app, options->tracking);
  return [options] { return run(*options); };
}

}  // namespace volto::cli
