// The options that say which models find the face, and where their files are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/detection/face_finder.h"
#include "capture/detection/model_manifest.h"

namespace CLI {
class App;
}

namespace volto::cli {

struct ModelFlags {
  std::vector<std::string> folders;
  std::string faces, landmarks;  // names or manifests; empty: the first that is there
  std::string face = "front";
  bool allow_unlisted = false;
};

void addModelFlags(CLI::App& app, ModelFlags& flags);

// Where models are looked for: --models, else $VOLTO_MODELS (a list with ':'), else $XDG_DATA_HOME/volto/models
// (~/.local/share/volto/models) and /usr/share/volto/models.
std::vector<std::filesystem::path> modelFolders(const ModelFlags& flags);

// Throws CommandError (kBadConfiguration when a model is nowhere, with how to get it), capture::InputError,
// std::system_error.
capture::FaceFinder makeFaceFinder(const ModelFlags& flags);

}  // namespace volto::cli
