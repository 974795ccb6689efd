// A crop: the upright square of an image that a network sees, and where a face lies in it.
#pragma once

#include <array>
#include <span>

#include "capture/detection/model_manifest.h"
#include "capture/image.h"

namespace volto::capture {

// Rotation, one scale, translation: p_image = (a x - b y + tx, b x + a y + ty) for a point (x, y) of the crop, pixels.
struct ImageFromCrop {
  double a = 1, b = 0, tx = 0, ty = 0;

  double scale() const;
  std::array<float, 2> operator()(double x, double y) const {
    return {static_cast<float>(a * x - b * y + tx), static_cast<float>(b * x + a * y + ty)};
  }
  // The other way round.
  std::array<float, 2> inverse(double x, double y) const;
};

// The eyes' centres, nose and mouth corners of a landmark frame's points. Throws std::invalid_argument for an unknown
// layout; `points` has as many points as the layout.
FaceAnchors anchorsOf(LandmarkLayout layout, std::span<const std::array<float, 2>> points);

// The crop of width x height pixels in which a face with these anchors (in the image) stands upright and lies as the
// model wants it. A face that is turned away has its eyes closer together, one that nods its mouth closer to the eyes:
// the larger of the two measures counts, so that the crop does not close in on it. False when the anchors make no face.
bool cropOf(const FaceAnchors& in_image, const FaceAnchors& in_model, int width, int height, ImageFromCrop& out);

// How the network wants its numbers.
struct Normalisation {
  bool rgb = false;
  std::array<float, 3> mean{}, deviation{1, 1, 1};
};

// Fills 3 planes of height x width. What is larger in the image than in the crop is averaged, not skipped. Outside the
// image: its border, or black. (Where the border counts, a crop more than 2.5 times as small as what it shows is taken
// from the image at half its size, a quarter, ...: rounded to whole levels each time.)
void sampleCrop(const Image& image, const ImageFromCrop& image_from_crop, int width, int height,
                const Normalisation& normalisation, bool black_outside, std::span<float> planes);

}  // namespace volto::capture
