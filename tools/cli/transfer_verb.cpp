// volto transfer: one character's expressions on another's face.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "retarget/retargeter.h"
#include "rig/mesh_io.h"
#include "rig/parallel.h"
#include "rig/rig_file.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/mask_examples.h"
#include "tools/cli/output_file.h"
#include "tools/cli/progress.h"
#include "tools/cli/read_input.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/verb.h"
#include "transfer/added_examples.h"
#include "transfer/expression_transfer.h"
#include "transfer/mesh_set.h"

namespace volto::cli {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  std::string source, examples, target, output, method;
  std::size_t every = 1;
  int threads = 0;
  bool quiet = false;
};

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

transfer::Method methodOf(const std::string& name) {
  if (name == "mask") return transfer::Method::mask;
  if (name.empty() || name == "deformation") return transfer::Method::deformation;
  if (name == "individual")
    throw CommandError(
        kWrongUsage,
        "--method individual: how a character of its own smiles is not learnt yet; use mask or deformation");
  throw CommandError(kWrongUsage, "--method " + name + ": there is no such method; use mask or deformation");
}

rig::Rig readCharacter(const std::string& path) {
  requireReadable(path);
  if (rig::isMeshFileName(path))
    throw CommandError(kBadData,
                       path + ": is a mesh that is not rigged; make its rig with volto rig " + path + " -o C.rig");
  return rig::readRig(path);
}

// Same file name as the example; what is no OBJ becomes one.
std::filesystem::path resultPath(const Options& options, const std::filesystem::path& example) {
  return std::filesystem::path(options.output) / example.filename().replace_extension(".obj");
}

// Example motions of the mask have no mesh of their own, so nothing but the mask can carry them: each target vertex
// follows it by the target's own regions, scaled by the target's FAPU, as live faces do.
int runMaskExamples(const Options& options) {
  if (methodOf(options.method) != transfer::Method::mask && !options.method.empty())
    throw CommandError(kWrongUsage, "--method " + options.method + ": " + options.examples +
                                        " holds motions of the mask and no meshes; use --method mask");
  const rig::Rig target = readCharacter(options.target);
  const MaskExamples examples = readMaskExamples(options.examples, options.every);
  makeOutputFolder(options.output);
  retarget::Retargeter retargeter(target, {.mesh = true, .weights = false});
  AvatarFrame avatar;
  rig::VertexPositions positions = target.neutral.positions;
  Progress progress("expression", examples.frames.size());
  for (std::size_t k = 0; k < examples.frames.size(); ++k) {
    if (stopRequested()) throw CommandError(kFailed, "stopped before the end; the folder is not complete");
    retargeter.reset();  // each expression by itself
    retargeter.push(examples.frames[k], avatar);
    for (Eigen::Index v = 0; v < positions.rows(); ++v)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        positions(v, axis) =
            static_cast<double>(avatar.vertices[static_cast<std::size_t>(v)][static_cast<std::size_t>(axis)]);
    rig::writeObj(std::filesystem::path(options.output) / (examples.names[k] + ".obj"), target.neutral, positions);
    progress.show(k);
  }
  if (!options.quiet) std::printf("%zu expressions of the mask to %s\n", examples.frames.size(), target.name.c_str());
  return kDone;
}

int run(const Options& options) {
  if (options.examples == "table" || std::filesystem::is_regular_file(options.examples))
    return runMaskExamples(options);
  const transfer::Method method = methodOf(options.method);
  if (options.source.empty())
    throw CommandError(kWrongUsage, "--source S.rig is missing: the character whose expressions the meshes in " +
                                        options.examples + " are");
  const rig::Rig source = readCharacter(options.source), target = readCharacter(options.target);
  if (!std::filesystem::is_directory(options.examples))
    throw CommandError(kNoInput, options.examples + ": no such folder or file; it holds one mesh per expression of " +
                                     options.source + ", or is a take, or the word table");
  std::error_code error;
  if (std::filesystem::equivalent(options.examples, options.output, error))
    throw CommandError(kWrongUsage,
                       options.output + ": is the folder of the examples, which would be lost; give another");

  auto start = Clock::now();
  const transfer::MeshSet examples = transfer::readMeshSet(options.examples, source.neutral, options.threads);
  const double reading = secondsSince(start);
  const std::vector<std::string> still = transfer::stillMeshes(examples, source.neutral);
  makeOutputFolder(options.output);

  start = Clock::now();
  const transfer::ExpressionTransfer transfer(source, target, {.method = method, .threads = options.threads});
  const double preparing = secondsSince(start);
  start = Clock::now();
  const std::vector<rig::VertexPositions> results = transfer.transfer(examples.positions);
  const double computing = secondsSince(start);
  if (stopRequested()) throw CommandError(kFailed, "stopped before anything was written");

  start = Clock::now();
  rig::parallelFor(results.size(), [&](std::size_t i) {
    if (!stopRequested()) rig::writeObj(resultPath(options, examples.files[i]), target.neutral, results[i]);
  });
  if (stopRequested()) throw CommandError(kFailed, "stopped before the end; the folder is not complete");
  if (options.quiet) return kDone;

  std::printf("%zu expressions of %s to %s by %s\n", results.size(), source.name.c_str(), target.name.c_str(),
              method == transfer::Method::mask ? "mask" : "deformation");
  if (method == transfer::Method::mask)
    std::printf("mask: %zu points on the target%s\n", transfer.maskPoints(),
                transfer.sameMesh() ? ", read off the same vertices of the source" : "");
  else if (transfer.sameMesh())
    std::puts("correspondence: the same mesh, vertex by vertex");
  else
    std::printf("correspondence: %zu of %zu vertices by the generic head; the others follow the mask\n",
                transfer.correspondingVertices(), target.neutral.vertexCount());
  std::printf("time: read %.2f s, prepare %.2f s, transfer %.2f s, write %.2f s\n", reading, preparing, computing,
              secondsSince(start));
  const std::vector<std::int32_t> added = transfer::addedTo(source.contacts, source.fapu.fapu.eye_separation,
                                                            source.neutral.positions, examples.positions);
  for (std::size_t i = 0; i < added.size(); ++i)
    if (added[i] >= 0)
      std::printf("note: %s is made to be added to %s: by itself it turns lips or lids inside out, as on the source\n",
                  examples.names[i].c_str(), examples.names[static_cast<std::size_t>(added[i])].c_str());
  for (const std::string& name : still)
    std::printf("note: %s does not move on the source: empty on the target too\n", name.c_str());
  return kDone;
}

}  // namespace

RunVerb defineTransfer(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("--source", options->source, "the character whose expressions the meshes are, made by volto rig")
      ->type_name("S.rig");
  app.add_option("--examples", options->examples,
                 "folder of meshes: the source's mesh, one file per expression, vertices in the same order; or motions "
                 "of the mask, which need no source: a take or a CSV file as for volto bake, or table for the 52 ARKit "
                 "shapes of Volto's expression table")
      ->required()
      ->type_name("DIR|TAKE|table");
  app.add_option("--every", options->every, "of a take, every Nth frame (default 1)")
      ->type_name("N")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}));
  app.add_option("--target", options->target, "the character that gets them, made by volto rig")
      ->required()
      ->type_name("T.rig");
  app.add_option("-o,--output", options->output,
                 "folder for one OBJ per expression: the target's vertices in its own order")
      ->required()
      ->type_name("DIR");
  app.add_option(
         "--method", options->method,
         "deformation (default): every wrinkle of the examples, for faces that are built alike; or mask: through the "
         "control "
         "mask's points, smooth, for any two faces, however unlike; finer when both were rigged with --subdivide")
      ->type_name("mask|deformation");
  app.add_option("--threads", options->threads, "how many to use (default: every core)")->check(CLI::Range(1, 64));
  app.add_flag("--quiet", options->quiet, "print nothing");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
