// LandmarkModel: the points of one face, from an upright crop of an image.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "capture/detection/crop.h"
#include "capture/detection/model_manifest.h"
#include "frames/landmark_frame.h"

namespace volto::capture {

// Thread-bound.
class LandmarkModel {
 public:
  // Throws InputError when the network is not what the manifest says.
  LandmarkModel(const ModelManifest& manifest, std::string_view onnx, const std::string& name_for_errors);
  ~LandmarkModel();
  LandmarkModel(LandmarkModel&&) noexcept;

  const ModelManifest& manifest() const;

  // The crop for a face whose anchors are known. False when they make no face.
  bool crop(const FaceAnchors& in_image, ImageFromCrop& out) const;

  // Fills points_px and, where the model tells, point_confidence (else empty). Returns the model's confidence that
  // there is a face, 0..1; 1 where it does not say. Points that are not finite: 0.
  float run(const Image& image, const ImageFromCrop& image_from_crop, LandmarkFrame& out);

  // Spent in the network itself so far; the rest is taking crops and reading the answer.
  std::int64_t network_ns() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::capture
