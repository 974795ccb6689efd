// Pictures of numbers: landmarks on the image plane, weights over time.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "frames/landmark_frame.h"
#include "tools/picture/picture.h"

namespace volto::picture {

// Part of the image plane that a landmark plot shows, pixels.
struct ImageArea {
  float left = 0.0F, top = 0.0F, right = 640.0F, bottom = 480.0F;
};

// What all frames with a face fill, with some space around: one area for a sequence keeps the plot still. The image's
// own area where the frames know its size. A default where no frame has a face.
ImageArea areaOf(std::span<const LandmarkFrame> frames);

// The points of one frame; for ibug68 joined to jaw, brows, nose, eyes and mouth. A frame without a face is said to be
// one.
Picture plotLandmarks(const LandmarkFrame& frame, int width_px, int height_px, const ImageArea& area);

struct Curve {
  std::string name;
  std::vector<float> values;  // one per time; NaN leaves a gap
  std::optional<Colour> colour;
};

struct CurvePlot {
  std::string title;
  std::vector<double> time_s;  // rising
  std::vector<Curve> curves;
  float low = 0.0F, high = 1.0F;   // of the value axis; equal: fitted to the curves
  std::optional<double> marker_s;  // a vertical line, for a frame of an animation
};

// All curves in one diagram with a legend. Throws std::invalid_argument when a curve has another length than the times.
Picture plotCurves(const CurvePlot& plot, int width_px, int height_px);

// One narrow strip per curve, its name on the left: for many curves, such as 52 weights.
Picture plotStrips(const CurvePlot& plot, int width_px, int strip_px = 18);

// The curves that move most, in order of their spread; at most `count`. For choosing what to plot.
std::vector<std::size_t> liveliestCurves(std::span<const Curve> curves, std::size_t count);

}  // namespace volto::picture
