// volto rig: a mesh and its feature points to a character.
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "rig/rig_definition.h"
#include "rig/rig_file.h"
#include "tools/cli/describe_health.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/read_input.h"
#include "tools/cli/rig_flags.h"
#include "tools/cli/rig_points.h"
#include "tools/cli/verb.h"

namespace volto::cli {

namespace {

constexpr std::size_t kPointsFileLimit = std::size_t{16} << 20;

struct Options {
  std::string mesh;
  std::string output;
  std::string points;
  std::string name;
  std::string regions;
  std::string save_definition;
  std::string subdivide;
  std::string examples;
  bool quiet = false;
};

// "head.obj" has its definition in "head.rig.json", where there is one.
std::string definitionBeside(const std::string& mesh) {
  const std::filesystem::path path = std::filesystem::path(mesh).replace_extension(".rig.json");
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) ? path.string() : std::string();
}

// Everything that can be known to be wrong before the work starts.
void checkPaths(const Options& options) {
  requireReadable(options.mesh);
  for (const std::string* in : {&options.points, &options.regions})
    if (!in->empty()) requireReadable(*in);
  requireDifferent({options.mesh, options.points}, std::vector{options.output, options.save_definition});
  for (const std::string* out : {&options.output, &options.save_definition})
    if (!out->empty()) requireReplaceable(*out);
  if (!options.regions.empty()) requireDifferent(options.regions, options.output);
  if (!options.save_definition.empty() && std::filesystem::path(options.save_definition) == options.output)
    throw CommandError(kWrongUsage, options.output + ": the rig and its definition cannot be one file");
}

int run(Options options) {
  if (options.regions.empty()) {
    options.regions = definitionBeside(options.mesh);
    if (!options.regions.empty()) std::fprintf(stderr, "volto rig: note: using %s\n", options.regions.c_str());
  }
  checkPaths(options);
  rig::RigDefinition definition;
  if (!options.regions.empty())
    definition = rig::parseRigDefinition(readWhole(options.regions, kPointsFileLimit), options.regions);
  rig::FeaturePointChoices given = definition.points;
  if (!options.points.empty())  // what is said on the command line goes before what was kept
    for (const auto& [point, choice] :
         rig::parseFeaturePoints(readWhole(options.points, kPointsFileLimit), options.points))
      given[point] = choice;
  rig::RigOptions rig_options;
  definition.applyTo(rig_options);
  if (!options.subdivide.empty())
    rig_options.subdivision = parseSubdivision(options.subdivide, !options.examples.empty());

  const rig::Mesh mesh = rig::readMesh(options.mesh);
  for (const std::string& note : mesh.notes) std::fprintf(stderr, "volto rig: note: %s\n", note.c_str());
  if (rig_options.subdivision.budget > 0 && options.examples.empty())
    throw CommandError(kWrongUsage, "automatic subdivision needs an example set: --examples DIR");
  if (!options.examples.empty() && rig_options.subdivision.budget > 0)
    rig_options.examples = readExamples(options.examples, mesh);
  const std::filesystem::path mesh_path(options.mesh);
  rig_options.name = options.name.empty() ? mesh_path.stem().string() : options.name;
  rig_options.mesh_file = mesh_path.filename().string();

  // It knows points and vertices, not the files they came from.
  const std::string sources = (options.points.empty() ? std::string() : options.points + " on ") + options.mesh +
                              (options.regions.empty() ? std::string() : " with " + options.regions);
  try {
    const CompletePoints complete = completePoints(mesh, given);
    definition.check(mesh);
    const rig::Rig character = rig::buildRig(mesh, complete.points, rig_options);
    // Not before: what is refused is told in one line.
    for (const std::string& note : complete.notes)
      std::fprintf(stderr, "volto rig: note: %s: %s\n", options.mesh.c_str(), note.c_str());
    rig::writeRig(options.output, character);
    if (!options.save_definition.empty()) {
      OutputFile file(options.save_definition);
      file.write(rig::formatRigDefinition(rig::definitionOf(character, rig_options)));
      file.commit();
    }
    if (!options.quiet) {
      nlohmann::ordered_json problems = nlohmann::ordered_json::array();
      const nlohmann::ordered_json health = describeHealth(character, problems);
      std::fputs(healthInWords(health, problems).c_str(), stdout);
    }
  } catch (const rig::InputError& error) {
    throw rig::InputError(sources + ": " + error.what());
  }
  return kDone;
}

}  // namespace

RunVerb defineRig(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("mesh", options->mesh, "the neutral head: an OBJ, PLY, OFF, STL, glTF or GLB file")
      ->required()
      ->type_name("MESH");
  app.add_option("-o,--output", options->output, "the character to write")->required()->type_name("C.rig");
  app.add_option(
         "--points", options->points,
         "JSON file of feature points: {\"feature_points\": {\"2.1\": 4711, \"3.7\": [x, y, z], ...}}; a "
         "vertex index from 0 in file order, or a position; any number of the control mask's 84: ten that help most "
         "are 3.7 3.12 4.3 4.4 9.3 8.3 8.4 2.1 10.7 10.8; none: the face is looked for")
      ->type_name("P.json");
  app.add_option("--name", options->name, "the character's name (default: the mesh file's, without its ending)")
      ->type_name("N");
  app.add_option(
         "--regions", options->regions,
         "rig definition: points, labels, regions, stiffness, parts, subdivision as a person decided them (default: "
         "MESH's name with .rig.json, where it is there)")
      ->type_name("R.json");
  app.add_option("--save-definition", options->save_definition,
                 "write what was used as a rig definition, to edit and to give to --regions again")
      ->type_name("R.json");
  app.add_option("--subdivide", options->subdivide,
                 "refine the mask for dense driving data: N times every triangle, or auto:POINTS where --examples are "
                 "reproduced worst (auto alone: 200 points)")
      ->type_name("N|auto[:POINTS]");
  app.add_option("--examples", options->examples, "folder of meshes, the same head with expressions, for auto")
      ->type_name("DIR");
  app.add_flag("--quiet", options->quiet, "no report on the rig's health");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
