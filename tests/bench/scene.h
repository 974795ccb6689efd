// What the benchmarks run on: a head of the size that studios use, and a lively performance.
#pragma once

#include <string>
#include <vector>

#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"
#include "rig/rig.h"

namespace volto::bench {

struct BenchRig {
  rig::Rig rig;
  std::string name;
};

// The ICT head (26 719 vertices) where VOLTO_DATA has it, else the head shipped with Volto. Rigged once.
const BenchRig& benchRig();

// Feature points and vertices in single precision, as the references take them.
std::vector<std::array<float, 3>> neutralVertices(const rig::Rig& rig);
std::vector<std::array<float, 3>> neutralControls(const rig::Rig& rig);

// `count` moments of the shipped take, from its speech on: landmarks with camera noise ...
std::vector<LandmarkFrame> performanceLandmarks(std::size_t count);
// ... and masks made straight from its weights by the expression table, with 1 % of noise that no expression explains.
// No prior.
std::vector<MaskFrame> performanceMasks(std::size_t count);

}  // namespace volto::bench
