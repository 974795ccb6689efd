// volto inspect: what a file is and how healthy it is, for people or as JSON.
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "rig/rig_file.h"
#include "tools/cli/describe_health.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/expression_report.h"
#include "tools/cli/file_description.h"
#include "tools/cli/output_file.h"
#include "tools/cli/read_input.h"
#include "tools/cli/rig_picture.h"
#include "tools/cli/verb.h"

namespace volto::cli {

namespace {

struct Options {
  std::string file;
  std::string picture, sheet, combinations;
  std::string take;
  int cell_px = 256;
  bool json = false;
};

int run(const Options& options) {
  requireReadable(options.file);
  bool pictures = false;
  for (const std::string* path : {&options.picture, &options.sheet, &options.combinations}) {
    if (path->empty()) continue;
    requireDifferent(options.file, *path);
    requireReplaceable(*path);
    pictures = true;
  }
  Json description = describeFile(options.file);
  const bool is_rig = description.value("kind", "") == "rig";
  if (pictures && !is_rig)
    throw CommandError(kBadData, options.file + ": --picture, --sheet and --combinations show a rig; this is a " +
                                     description.value("kind", "file"));
  if (!options.take.empty() && !is_rig)
    throw CommandError(kBadData, options.file + ": --take plays on a rig; this is a " + description.value("kind", "file"));
  std::string performance;
  if (pictures || !options.take.empty() || (is_rig && options.json)) {
    const rig::Rig rig = rig::readRig(options.file);
    if (!options.picture.empty()) writeRigPicture(options.picture, rig);
    if (!options.sheet.empty()) writeShapeSheet(options.sheet, rig, options.cell_px);
    if (!options.combinations.empty()) writeCombinationSheet(options.combinations, rig, options.cell_px);
    if (options.json) description["expressions"] = expressionReport(rig);
    if (!options.take.empty()) {
      const Json report = performanceReport(rig, options.take);
      performance = performanceInWords(report);
      if (options.json) description["performance"] = report;
    }
  }
  std::string text;
  if (options.json) {
    text = description.dump(1) + "\n";
  } else if (description.contains("health")) {
    Json shorter = description;
    shorter.erase("health");
    shorter.erase("problems");
    text = describeInWords(shorter) + healthInWords(description["health"], description["problems"]);
  } else {
    text = describeInWords(description);
  }
  if (!options.json) text += performance;
  std::fputs(text.c_str(), stdout);
  return 0;
}

}  // namespace

RunVerb defineInspect(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("file", options->file,
                 "a rig, a take, a mesh (OBJ, PLY, OFF, STL, glTF, GLB), an OpenFace CSV or a Live Link Face CSV file")
      ->required()
      ->type_name("FILE");
  app.add_flag("--json", options->json, "for programs");
  app.add_option("--picture", options->picture,
                 "for a rig: a picture of the mask on the mesh, the regions in colour and the worst expressions")
      ->type_name("F.png");
  app.add_option("--sheet", options->sheet, "for a rig: a picture of neutral from three sides and of every blendshape")
      ->type_name("F.png");
  app.add_option("--combinations", options->combinations, "for a rig: a picture of twelve combined expressions")
      ->type_name("F.png");
  app.add_option("--take", options->take, "for a rig: measure this performance on it too, frame by frame")
      ->type_name("TAKE");
  app.add_option("--cell", options->cell_px, "size of a cell of these sheets")
      ->type_name("PX")
      ->capture_default_str()
      ->check(CLI::Range(64, 1024));
  return [options] { return run(*options); };
}

}  // namespace volto::cli
