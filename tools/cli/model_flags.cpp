#include "tools/cli/model_flags.h"

#include <cstdlib>
#include <stdexcept>
#include <utility>

#include <CLI/CLI.hpp>

#include "tools/cli/exit_status.h"

namespace volto::cli {

namespace {

capture::ModelFile requireModel(capture::ModelManifest::Task task, const std::string& wanted,
                                const std::vector<std::filesystem::path>& folders) {
  capture::ModelFile model = capture::findModel(task, wanted, folders);
  if (!model.path.empty()) return model;
  std::string places;
  for (const std::filesystem::path& folder : folders) places.append(places.empty() ? "" : ", ").append(folder.string());
  throw CommandError(
      kBadConfiguration,
      std::string(task == capture::ModelManifest::Task::faces ? "no face detector" : "no landmark model") + ": " +
          model.manifest.file + " is in none of " + places + "; get it from " + model.manifest.get +
          " and give its folder with --models (volto doctor says more)");
}

}  // namespace

void addModelFlags(CLI::App& app, ModelFlags& flags) {
  app.add_option("--models", flags.folders,
                 "folder of the network files (default $VOLTO_MODELS, ~/.local/share/volto/models, "
                 "/usr/share/volto/models); nothing is ever fetched")
      ->type_name("DIR");
  app.add_option("--face-model", flags.faces, "face detector: a name that volto doctor lists, or a manifest (.json)")
      ->type_name("NAME");
  app.add_option("--landmark-model", flags.landmarks,
                 "landmark model: a name that volto doctor lists, or a manifest (.json)")
      ->type_name("NAME");
  app.add_flag("--allow-unlisted-model", flags.allow_unlisted, "use a file whose SHA-256 is not its manifest's");
  app.add_option(
         "--face", flags.face,
         "which face, where there are several: front (the nearest; default), 1, 2, ... counted from the left of "
         "the picture, or a place in it as fractions (0.25,0.5)")
      ->type_name("WHICH");
}

std::vector<std::filesystem::path> modelFolders(const ModelFlags& flags) {
  if (!flags.folders.empty()) return {flags.folders.begin(), flags.folders.end()};
  std::vector<std::filesystem::path> folders;
  if (const char* const named = std::getenv("VOLTO_MODELS"); named != nullptr && *named != '\0') {
    std::string rest = named;
    for (std::size_t at = 0; at <= rest.size();) {
      const std::size_t colon = std::min(rest.find(':', at), rest.size());
      if (colon > at) folders.emplace_back(rest.substr(at, colon - at));
      at = colon + 1;
    }
    return folders;
  }
  if (const char* const data = std::getenv("XDG_DATA_HOME"); data != nullptr && *data == '/') {
    folders.push_back(std::filesystem::path(data) / "volto/models");
  } else if (const char* const home = std::getenv("HOME"); home != nullptr && *home == '/') {
    folders.push_back(std::filesystem::path(home) / ".local/share/volto/models");
  }
  folders.emplace_back("/usr/local/share/volto/models");
  folders.emplace_back("/usr/share/volto/models");
  return folders;
}

capture::FaceFinder makeFaceFinder(const ModelFlags& flags) {
  capture::FaceFinderOptions options;
  try {
    options.choice = capture::parseFaceChoice(flags.face);
  } catch (const std::invalid_argument& error) {
    throw CommandError(kWrongUsage, std::string("--face ") + error.what());
  }
  for (const std::string& folder : flags.folders) {
    std::error_code ignored;
    if (!std::filesystem::is_directory(folder, ignored))
      throw CommandError(kBadConfiguration, "--models " + folder + ": there is no such folder");
  }
  const auto folders = modelFolders(flags);
  const capture::ModelFile faces = requireModel(capture::ModelManifest::Task::faces, flags.faces, folders);
  const capture::ModelFile landmarks = requireModel(capture::ModelManifest::Task::landmarks, flags.landmarks, folders);
  capture::FaceDetector detector(faces.manifest, capture::readModelBytes(faces, flags.allow_unlisted),
                                 faces.path.string());
  capture::LandmarkModel model(landmarks.manifest, capture::readModelBytes(landmarks, flags.allow_unlisted),
                               landmarks.path.string());
  return {std::move(detector), std::move(model), options};
}

}  // namespace volto::cli
