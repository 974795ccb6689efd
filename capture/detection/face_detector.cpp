#include "capture/detection/face_detector.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "capture/detection/crop.h"
#include "capture/detection/network.h"

namespace volto::capture {
namespace {

constexpr std::array<int, 3> kStrides = {8, 16, 32};
constexpr int kNearSide = 96;             // of the small picture for a face that is about known
constexpr float kSameFaceOverlap = 0.3F;  // boxes that share more than this are one face
constexpr std::size_t kMostFaces = 64;

float overlap(const DetectedFace& a, const DetectedFace& b) {
  const float w = std::min(a.x + a.width, b.x + b.width) - std::max(a.x, b.x);
  const float h = std::min(a.y + a.height, b.y + b.height) - std::max(a.y, b.y);
  if (!(w > 0 && h > 0)) return 0;
  return w * h / (a.width * a.height + b.width * b.height - w * h);
}

// One size of picture.
struct Scale {
  Network network;
  int side_x, side_y;
};

// The four outputs of one stride of YuNet, as libfacedetection.train exports them: rows are the cells of the grid.
struct Head {
  std::span<const float> cls, obj, box, points;
};

Head headOf(const Network& network, int stride, int width, int height, const std::string& name) {
  const std::size_t cells = static_cast<std::size_t>(width / stride) * static_cast<std::size_t>(height / stride);
  const auto values = [&](const char* kind, std::size_t per_cell) {
    const std::string wanted = std::string(kind) + std::to_string(stride);
    const Network::Output* const output = network.output(wanted);
    if (output == nullptr || output->values.size() != cells * per_cell) {
      throw InputError(name + ": its output " + wanted +
                       (output == nullptr ? " is missing"
                                          : " holds " + std::to_string(output->values.size()) + " numbers, not " +
                                                std::to_string(cells * per_cell)) +
                       "; it is no YuNet, or the manifest's input size is not its own");
    }
    return output->values;
  };
  return {values("cls_", 1), values("obj_", 1), values("bbox_", 4), values("kps_", 10)};
}

}  // namespace

struct FaceDetector::State {
  ModelManifest manifest;
  std::string bytes, name;
  Normalisation normalisation;
  Scale full;
  std::optional<Scale> near;
  std::vector<DetectedFace> candidates;

  void detect(Scale& scale, const Image& image, const ImageFromCrop& image_from_crop, float least_score,
              std::vector<DetectedFace>& out) {
    sampleCrop(image, image_from_crop, scale.side_x, scale.side_y, normalisation, true, scale.network.input());
    scale.network.run();
    candidates.clear();
    for (const int stride : kStrides) {
      const Head head = headOf(scale.network, stride, scale.side_x, scale.side_y, name);
      const auto columns = static_cast<std::size_t>(scale.side_x / stride);
      const auto s = static_cast<float>(stride);
      for (std::size_t i = 0; i < head.cls.size(); ++i) {
        const float score = std::sqrt(std::clamp(head.cls[i], 0.0F, 1.0F) * std::clamp(head.obj[i], 0.0F, 1.0F));
        if (!(score >= least_score)) continue;
        const auto column = static_cast<float>(i % columns), row = static_cast<float>(i / columns);
        const float w = std::exp(std::min(head.box[4 * i + 2], 8.0F)) * s;
        const float h = std::exp(std::min(head.box[4 * i + 3], 8.0F)) * s;
        const float x = (column + head.box[4 * i]) * s - 0.5F * w, y = (row + head.box[4 * i + 1]) * s - 0.5F * h;
        DetectedFace face;
        face.score = score;
        const auto corner = image_from_crop(x, y);  // a detector's picture is never turned
        face.x = corner[0];
        face.y = corner[1];
        face.width = w * static_cast<float>(image_from_crop.a);
        face.height = h * static_cast<float>(image_from_crop.a);
        bool finite = std::isfinite(face.x + face.y + face.width + face.height);
        for (std::size_t k = 0; k < kFaceAnchorCount; ++k) {
          face.anchors[k] =
              image_from_crop((column + head.points[10 * i + 2 * k]) * s, (row + head.points[10 * i + 2 * k + 1]) * s);
          finite = finite && std::isfinite(face.anchors[k][0] + face.anchors[k][1]);
        }
        if (finite) candidates.push_back(face);
      }
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const DetectedFace& a, const DetectedFace& b) { return a.score > b.score; });
    out.clear();
    for (const DetectedFace& face : candidates) {
      const bool known = std::any_of(
          out.begin(), out.end(), [&](const DetectedFace& other) { return overlap(face, other) > kSameFaceOverlap; });
      if (!known) out.push_back(face);
      if (out.size() == kMostFaces) break;
    }
  }
};

FaceDetector::FaceDetector(const ModelManifest& manifest, std::string_view onnx, const std::string& name_for_errors)
    : state_(
          new State{manifest,
                    std::string(onnx),
                    name_for_errors,
                    {manifest.rgb, manifest.mean, manifest.deviation},
                    {Network(onnx, name_for_errors, manifest.width, manifest.height), manifest.width, manifest.height},
                    std::nullopt,
                    {}}) {
  State& s = *state_;
  if (manifest.width % kStrides.back() != 0 || manifest.height % kStrides.back() != 0)
    throw InputError(name_for_errors + ": YuNet's input must be a multiple of 32 wide and high");
  for (const int stride : kStrides) headOf(s.full.network, stride, s.full.side_x, s.full.side_y, s.name);
  if (manifest.any_size) {
    s.near.emplace(Scale{Network(onnx, name_for_errors, kNearSide, kNearSide), kNearSide, kNearSide});
    for (const int stride : kStrides) headOf(s.near->network, stride, kNearSide, kNearSide, s.name);
  }
}
FaceDetector::~FaceDetector() = default;
FaceDetector::FaceDetector(FaceDetector&&) noexcept = default;

std::int64_t FaceDetector::network_ns() const {
  return state_->full.network.spent_ns() + (state_->near ? state_->near->network.spent_ns() : 0);
}

void FaceDetector::detect(const Image& image, float least_score, std::vector<DetectedFace>& out) {
  State& s = *state_;
  out.clear();
  if (image.width <= 0 || image.height <= 0) return;
  ImageFromCrop whole;
  whole.a =
      std::max(static_cast<double>(image.width) / s.full.side_x, static_cast<double>(image.height) / s.full.side_y);
  s.detect(s.full, image, whole, least_score, out);
}

void FaceDetector::detectNear(const Image& image, const ImageSquare& part, float least_score,
                              std::vector<DetectedFace>& out) {
  State& s = *state_;
  out.clear();
  if (image.width <= 0 || image.height <= 0 || !(part.side > 1)) return;
  Scale& scale = s.near ? *s.near : s.full;
  ImageFromCrop square;
  square.a = part.side / std::min(scale.side_x, scale.side_y);
  square.tx = part.x;
  square.ty = part.y;
  s.detect(scale, image, square, least_score, out);
}

}  // namespace volto::capture
