// FaceDetector: where faces are in an image, found from nothing.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "capture/detection/model_manifest.h"
#include "capture/image.h"

namespace volto::capture {

struct DetectedFace {
  float score = 0;                            // 0..1
  float x = 0, y = 0, width = 0, height = 0;  // pixels of the image
  FaceAnchors anchors{};                      // pixels of the image
};

// A square part of an image, pixels; may reach over its border.
struct ImageSquare {
  double x = 0, y = 0, side = 0;  // upper left corner
};

// Thread-bound.
class FaceDetector {
 public:
  // Throws InputError when the network is not what the manifest says.
  FaceDetector(const ModelManifest& manifest, std::string_view onnx, const std::string& name_for_errors);
  ~FaceDetector();
  FaceDetector(FaceDetector&&) noexcept;

  // All faces of the image with at least this score, the surest first, none twice.
  void detect(const Image& image, float least_score, std::vector<DetectedFace>& out);
  // The same in a part of it, on a small picture: a sixth of the cost. Where the network cannot do that: as detect() on
  // that part at full cost.
  void detectNear(const Image& image, const ImageSquare& part, float least_score, std::vector<DetectedFace>& out);

  // Spent in the network itself so far; the rest is taking crops and reading the answer.
  std::int64_t network_ns() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::capture
