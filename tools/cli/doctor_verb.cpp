// volto doctor: what is there, what is missing, and how to get it.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "capture/detection/face_detector.h"
#include "capture/detection/landmark_model.h"
#include "capture/detection/network.h"
#include "capture/sha256.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/model_flags.h"
#include "tools/cli/verb.h"
#include "tracker/landmark_layout.h"

namespace volto::cli {

namespace {

using Json = nlohmann::json;

struct Options {
  ModelFlags models;
  bool json = false;
};

struct Finding {
  capture::ModelManifest manifest;
  std::filesystem::path path;
  std::string problem;  // empty: it works
  std::string sha256;   // of the file that is there
};

Finding examine(const capture::ModelManifest& manifest, const std::vector<std::filesystem::path>& folders,
                bool allow_unlisted) {
  Finding finding{manifest, {}, {}, {}};
  try {
    const capture::ModelFile model = capture::findModel(manifest.task, manifest.name, folders);
    finding.manifest = model.manifest;
    finding.path = model.path;
    if (model.path.empty()) {
      finding.problem = "not there";
      return finding;
    }
    finding.sha256 = capture::sha256Hex(capture::readModelBytes(model, true));
    const std::string bytes = capture::readModelBytes(model, allow_unlisted);
    if (manifest.task == capture::ModelManifest::Task::faces) {
      capture::FaceDetector(model.manifest, bytes, model.path.string());
    } else {
      capture::LandmarkModel(model.manifest, bytes, model.path.string());
    }
  } catch (const std::exception& error) {
    finding.problem = error.what();
  }
  return finding;
}

const char* taskName(capture::ModelManifest::Task task) {
  return task == capture::ModelManifest::Task::faces ? "faces" : "landmarks";
}

void print(const Finding& finding) {
  const capture::ModelManifest& m = finding.manifest;
  std::printf(
      "%s %s (%s): %s\n", finding.problem.empty() ? "ok     " : "missing", m.name.c_str(),
      m.task == capture::ModelManifest::Task::faces ? "faces" : std::string(tracker::layoutName(m.layout)).c_str(),
      finding.problem.empty() ? finding.path.string().c_str() : finding.problem.c_str());
  if (finding.problem.empty()) return;
  std::printf("          file     %s\n", m.file.c_str());
  std::printf("          sha256   %s\n", m.sha256.empty()
                                             ? "not listed: needs --allow-unlisted-model or a manifest of your own"
                                             : m.sha256.c_str());
  std::printf("          get it   %s\n", m.get.c_str());
  std::printf("          licence  %s\n", m.licence.c_str());
  std::printf("          loads in %s\n", m.loads.c_str());
}

int run(const Options& options) {
  const auto folders = modelFolders(options.models);
  std::vector<Finding> findings;
  for (const capture::ModelManifest& manifest : capture::shippedModels())
    findings.push_back(examine(manifest, folders, options.models.allow_unlisted));
  bool faces = false, landmarks = false;
  for (const Finding& finding : findings) {
    if (!finding.problem.empty()) continue;
    (finding.manifest.task == capture::ModelManifest::Task::faces ? faces : landmarks) = true;
  }
  if (options.json) {
    Json models = Json::array();
    for (const Finding& f : findings) {
      models.push_back({{"name", f.manifest.name},
                        {"task", taskName(f.manifest.task)},
                        {"file", f.manifest.file},
                        {"path", f.path.string()},
                        {"ok", f.problem.empty()},
                        {"problem", f.problem},
                        {"sha256", f.sha256},
                        {"licence", f.manifest.licence},
                        {"get", f.manifest.get}});
    }
    Json places = Json::array();
    for (const auto& folder : folders) places.push_back(folder.string());
    std::puts(Json({{"opencv", capture::openCvVersion()},
                    {"folders", places},
                    {"models", models},
                    {"camera_and_video", faces && landmarks}})
                  .dump(1)
                  .c_str());
  } else {
    std::printf("networks run in OpenCV %s; model files are looked for in", capture::openCvVersion().c_str());
    for (const auto& folder : folders) std::printf(" %s", folder.string().c_str());
    std::puts("");
    for (const Finding& finding : findings) print(finding);
    std::puts(faces && landmarks
                  ? "cameras and videos: ready"
                  : "cameras and videos: a face detector and a landmark model are needed; recordings and "
                    "landmarks from other programs (udp://) need none");
  }
  return faces && landmarks ? kDone : kBadConfiguration;
}

}  // namespace

RunVerb defineDoctor(CLI::App& app) {
  auto options = std::make_shared<Options>();
  addModelFlags(app, options->models);
  app.add_flag("--json", options->json, "for programs");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
