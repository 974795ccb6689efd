// A performance made from nothing but the reference mask and the expression table: known weights, known head pose,
// ideal camera.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "frames/landmark_frame.h"

namespace volto::test {

struct SyntheticPerformanceOptions {
  std::size_t frames = 120;
  double rate = 60.0;           // frames a second
  double head_turn_rad = 0.15;  // amplitude of the yaw
  bool with_3d = true;
};

// Speaks (jawOpen), smiles and blinks; 640 x 480 pixels, focal length 800, head 600 mm away.
std::vector<LandmarkFrame> syntheticPerformance(const SyntheticPerformanceOptions& options = {});

// jawOpen as the performance above has it, 0..1.
float syntheticJawOpen(double seconds);

// As OpenFace writes it.
std::string openFaceCsv(const std::vector<LandmarkFrame>& frames);

// A Live Link Face file of `rows` rows at 60 a second in which jawOpen rises and tongueOut is 0.5.
std::string liveLinkCsv(std::size_t rows);

}  // namespace volto::test
