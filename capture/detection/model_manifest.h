// ModelManifest: what Volto must know of a neural network to use it, read from a small JSON file, so that another model
// is a file and not code. capture/models/ holds the ones that are shipped, capture/models/README.md explains the keys.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "capture/errors.h"
#include "frames/landmark_frame.h"

namespace volto::capture {

// Five places that every face detector and every landmark layout knows; left and right are the subject's.
enum class FaceAnchor : std::uint8_t { right_eye, left_eye, nose, mouth_right, mouth_left };
inline constexpr std::size_t kFaceAnchorCount = 5;
using FaceAnchors = std::array<std::array<float, 2>, kFaceAnchorCount>;

struct ModelManifest {
  enum class Task : std::uint8_t { faces, landmarks };
  enum class Output : std::uint8_t {
    yunet,     // cls_S, obj_S, bbox_S, kps_S for the strides S = 8, 16, 32
    points,    // one row of coordinates, point after point
    heatmaps,  // OpenSeeFace: N maps of where, N of offsets down, N of offsets right
  };

  std::string name;
  Task task = Task::faces;
  std::string file;    // its usual file name
  std::string sha256;  // lower-case hexadecimal; empty: not known, used only when unlisted models are allowed
  std::string licence, get, loads;  // for people

  // What goes in: 1 x 3 x height x width, (byte - mean) / deviation.
  int width = 0, height = 0;
  bool any_size = false;                            // the network takes other sizes (multiples of 32) too
  bool rgb = false;                                 // else BGR
  std::array<float, 3> mean{}, deviation{1, 1, 1};  // in the order of the channels

  // What comes out.
  Output output = Output::yunet;
  int values_per_point = 2;  // x, y, ...
  bool in_pixels = false;    // of the input; else fractions of it
  enum class Score : std::uint8_t { none, probability, logit } score = Score::none;  // a further output of one number
  double logit_factor = 16;                                                          // heatmaps

  LandmarkLayout layout = LandmarkLayout::ibug68;
  // Where the anchors of a face that looks straight ahead lie in the network's picture, as fractions of its sides.
  FaceAnchors crop{};
};

// `name` begins every error. Throws InputError.
ModelManifest parseModelManifest(std::string_view json, const std::string& name);
// Throws InputError, std::system_error when it cannot be opened.
ModelManifest readModelManifest(const std::filesystem::path& path);

// The manifests that are compiled in, detectors first, in the order in which Volto prefers them.
const std::vector<ModelManifest>& shippedModels();

struct ModelFile {
  ModelManifest manifest;
  std::filesystem::path path;  // of the network; empty: not found
};

// Which file serves a task: the one that `wanted` names (a manifest's name, or a manifest's path), else the preferred
// one that is there. Looks in `folders` in their order, also for further manifests (*.json). The path is empty when the
// file is nowhere; throws InputError for a name that no manifest has.
ModelFile findModel(ModelManifest::Task task, const std::string& wanted,
                    const std::vector<std::filesystem::path>& folders);

// The whole file after it was checked: at most 256 MiB, the manifest's hash. One line says what is wrong with it and
// what to do. Throws InputError, std::system_error.
std::string readModelBytes(const ModelFile& model, bool allow_unlisted);

}  // namespace volto::capture
