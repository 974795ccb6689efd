// volto inspect: what a file is and how healthy it is, for people or as JSON.
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "rig/rig_file.h"
#include "tools/cli/describe_health.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/file_description.h"
#include "tools/cli/output_file.h"
#include "tools/cli/read_input.h"
#include "tools/cli/rig_picture.h"
#include "tools/cli/verb.h"

namespace volto::cli {

namespace {

struct Options {
  std::string file;
  std::string picture;
  bool json = false;
};

int run(const Options& options) {
  requireReadable(options.file);
  if (!options.picture.empty()) {
    requireDifferent(options.file, options.picture);
    requireReplaceable(options.picture);
  }
  const Json description = describeFile(options.file);
  if (!options.picture.empty() && description.value("kind", "") != "rig")
    throw CommandError(kBadData,
                       options.file + ": --picture shows a rig; this is a " + description.value("kind", "file"));
  if (!options.picture.empty()) writeRigPicture(options.picture, rig::readRig(options.file));
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
  return [options] { return run(*options); };
}

}  // namespace volto::cli
