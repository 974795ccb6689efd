// volto rig: a mesh and its feature points to a character.
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "rig/rig_file.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/read_input.h"
#include "tools/cli/verb.h"

namespace volto::cli {

namespace {

constexpr std::size_t kPointsFileLimit = std::size_t{16} << 20;

struct Options {
  std::string mesh;
  std::string output;
  std::string points;
  std::string name;
};

int run(const Options& options) {
  requireReadable(options.mesh);
  if (options.points.empty()) {
    throw CommandError(
        kBadData,
        options.mesh +
            ": no feature points: 2.1, 2.2, 2.3 and the other 81 are missing; give them with --points P.json");
  }
  requireReadable(options.points);
  requireDifferent(options.mesh, options.output);
  requireDifferent(options.points, options.output);
  requireReplaceable(options.output);

  const rig::FeaturePointChoices choices =
      rig::parseFeaturePoints(readWhole(options.points, kPointsFileLimit), options.points);
  const rig::Mesh mesh = rig::readMesh(options.mesh);
  const std::filesystem::path mesh_path(options.mesh);
  rig::RigOptions rig_options;
  rig_options.name = options.name.empty() ? mesh_path.stem().string() : options.name;
  rig::Rig character = [&] {
    try {
      return rig::buildRig(mesh, choices, rig_options);
    } catch (const rig::InputError& error) {  // it knows points and vertices, not the files they came from
      throw rig::InputError(options.points + " on " + options.mesh + ": " + error.what());
    }
  }();
  character.mesh_file = mesh_path.filename().string();
  for (const std::string& substitution : character.fapu.substitutions) {
    std::fprintf(stderr, "volto rig: note: %s: %s\n", options.mesh.c_str(), substitution.c_str());
  }
  rig::writeRig(options.output, character);
  return kDone;
}

}  // namespace

RunVerb defineRig(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("mesh", options->mesh, "the neutral head, an OBJ file")->required()->type_name("MESH");
  app.add_option("-o,--output", options->output, "the character to write")->required()->type_name("C.rig");
  app.add_option("--points", options->points,
                 "JSON file of feature points: {\"feature_points\": {\"2.1\": 4711, \"3.7\": [x, y, z], ...}}; a "
                 "vertex index from 0 in file "
                 "order, or a position; all 84 of the control mask")
      ->type_name("P.json");
  app.add_option("--name", options->name, "the character's name (default: the mesh file's, without its ending)")
      ->type_name("N");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
