#include "capture/detection/landmark_model.h"

#include <algorithm>
#include <cmath>

#include "capture/detection/network.h"

namespace volto::capture {
namespace {

double logistic(double x) { return 1 / (1 + std::exp(-x)); }

}  // namespace

struct LandmarkModel::State {
  ModelManifest manifest;
  std::string name;
  Normalisation normalisation;
  Network network;
  std::size_t count;              // points of the layout
  std::size_t points_output = 0;  // which outputs of the network hold what
  std::size_t score_output = 0;
  int grid_x = 0, grid_y = 0;  // heatmaps

  std::string sizes() const {
    std::string text;
    for (const Network::Output& output : network.outputs()) {
      text.append(text.empty() ? "" : ", ").append(output.name).append(" ");
      for (std::size_t i = 0; i < output.shape.size(); ++i)
        text.append(i > 0 ? "x" : "").append(std::to_string(output.shape[i]));
    }
    return text;
  }

  // Finds the outputs by their size, since exporters name them as they like.
  void findOutputs() {
    const auto& outputs = network.outputs();
    const bool maps = manifest.output == ModelManifest::Output::heatmaps;
    const std::size_t wanted = count * static_cast<std::size_t>(manifest.values_per_point);
    const auto fits = [&](const Network::Output& output) {
      if (!maps) return output.values.size() == wanted;
      return output.shape.size() == 4 && output.shape[1] == static_cast<int>(3 * count) && output.shape[2] > 1 &&
             output.shape[3] > 1;
    };
    const auto points = std::find_if(outputs.begin(), outputs.end(), fits);
    if (points == outputs.end()) {
      throw InputError(name + ": none of its outputs (" + sizes() + ") is " +
                       (maps ? std::to_string(3 * count) + " maps" : std::to_string(wanted) + " numbers") +
                       " for the " + std::to_string(count) + " points that " + manifest.name +
                       " says; another model, or a wrong manifest");
    }
    points_output = static_cast<std::size_t>(points - outputs.begin());
    if (maps) {
      grid_y = points->shape[2];
      grid_x = points->shape[3];
    }
    if (manifest.score == ModelManifest::Score::none) return;
    const auto score = std::find_if(outputs.begin(), outputs.end(),
                                    [](const Network::Output& output) { return output.values.size() == 1; });
    if (score == outputs.end())
      throw InputError(name + ": none of its outputs (" + sizes() + ") is the single number that " + manifest.name +
                       " names as score");
    score_output = static_cast<std::size_t>(score - outputs.begin());
  }

  void readPoints(std::span<const float> values, const ImageFromCrop& image_from_crop, LandmarkFrame& out) const {
    const double unit_x = manifest.in_pixels ? 1.0 : manifest.width,
                 unit_y = manifest.in_pixels ? 1.0 : manifest.height;
    const auto step = static_cast<std::size_t>(manifest.values_per_point);
    for (std::size_t i = 0; i < count; ++i)
      out.points_px[i] = image_from_crop(values[i * step] * unit_x, values[i * step + 1] * unit_y);
  }

  // OpenSeeFace, tracker.py: the highest cell of each map says where, the logits of two more maps how far beside it,
  // down first. Its value is the point's confidence. Returns the mean of them.
  float readMaps(std::span<const float> values, const ImageFromCrop& image_from_crop, LandmarkFrame& out) const {
    const std::size_t cells = static_cast<std::size_t>(grid_x) * static_cast<std::size_t>(grid_y);
    const double reach_x = manifest.width - 1, reach_y = manifest.height - 1;
    const auto offset = [&](float p) {
      const double q = std::clamp(static_cast<double>(p), 1e-7, 1 - 1e-7);
      return std::log(q / (1 - q)) / manifest.logit_factor;
    };
    out.point_confidence.resize(count);
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const float* const map = values.data() + i * cells;
      const auto cell = static_cast<std::size_t>(std::max_element(map, map + cells) - map);
      const auto row = static_cast<double>(cell / static_cast<std::size_t>(grid_x));
      const auto column = static_cast<double>(cell % static_cast<std::size_t>(grid_x));
      const double y = reach_y * (row / (grid_y - 1) + offset(values[(count + i) * cells + cell]));
      const double x = reach_x * (column / (grid_x - 1) + offset(values[(2 * count + i) * cells + cell]));
      out.points_px[i] = image_from_crop(x, y);
      out.point_confidence[i] = std::clamp(map[cell], 0.0F, 1.0F);
      sum += out.point_confidence[i];
    }
    return static_cast<float>(sum / static_cast<double>(count));
  }
};

LandmarkModel::LandmarkModel(const ModelManifest& manifest, std::string_view onnx, const std::string& name_for_errors)
    : state_(new State{manifest,
                       name_for_errors,
                       {manifest.rgb, manifest.mean, manifest.deviation},
                       Network(onnx, name_for_errors, manifest.width, manifest.height),
                       landmarkCount(manifest.layout)}) {
  state_->findOutputs();
}
LandmarkModel::~LandmarkModel() = default;
LandmarkModel::LandmarkModel(LandmarkModel&&) noexcept = default;

const ModelManifest& LandmarkModel::manifest() const { return state_->manifest; }

bool LandmarkModel::crop(const FaceAnchors& in_image, ImageFromCrop& out) const {
  return cropOf(in_image, state_->manifest.crop, state_->manifest.width, state_->manifest.height, out);
}

std::int64_t LandmarkModel::network_ns() const { return state_->network.spent_ns(); }

float LandmarkModel::run(const Image& image, const ImageFromCrop& image_from_crop, LandmarkFrame& out) {
  State& s = *state_;
  sampleCrop(image, image_from_crop, s.manifest.width, s.manifest.height, s.normalisation, false, s.network.input());
  const auto& outputs = s.network.run();
  out.points_px.resize(s.count);
  out.point_confidence.clear();
  float confidence = 1;
  if (s.manifest.output == ModelManifest::Output::heatmaps) {
    confidence = s.readMaps(outputs[s.points_output].values, image_from_crop, out);
  } else {
    s.readPoints(outputs[s.points_output].values, image_from_crop, out);
  }
  if (s.manifest.score != ModelManifest::Score::none) {
    const float score = outputs[s.score_output].values[0];
    confidence = s.manifest.score == ModelManifest::Score::logit ? static_cast<float>(logistic(score)) : score;
  }
  for (const auto& point : out.points_px)
    if (!std::isfinite(point[0]) || !std::isfinite(point[1])) return 0;
  return std::isfinite(confidence) ? std::clamp(confidence, 0.0F, 1.0F) : 0;
}

}  // namespace volto::capture
