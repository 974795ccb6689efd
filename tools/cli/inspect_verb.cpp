// volto inspect: what a file is and how healthy it is, for people or as JSON.
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tools/cli/file_description.h"
#include "tools/cli/read_input.h"
#include "tools/cli/verb.h"

namespace volto::cli {

namespace {

struct Options {
  std::string file;
  bool json = false;
};

int run(const Options& options) {
  requireReadable(options.file);
  const Json description = describeFile(options.file);
  const std::string text = options.json ? description.dump(1) + "\n" : describeInWords(description);
  std::fputs(text.c_str(), stdout);
  return 0;
}

}  // namespace

RunVerb defineInspect(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("file", options->file, "a rig, a take, a mesh (OBJ, PLY, OFF, STL, glTF, GLB), an OpenFace CSV or a Live Link Face CSV file")
      ->required()
      ->type_name("FILE");
  app.add_flag("--json", options->json, "for programs");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
