// The shipped take: the performance, seen by a camera, as landmark frames; and the truth behind it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "frames/landmark_frame.h"
#include "recordings/make/performance.h"

namespace volto::recordings {

inline constexpr std::uint64_t kShippedSeed = 20240607;
inline constexpr int kShippedRateHz = 60;
inline constexpr int kImageWidthPx = 640, kImageHeightPx = 480;
inline constexpr double kFocalLengthPx = 615.0;  // a webcam of 55 degrees

struct ShippedTake {
  std::vector<LandmarkFrame> frames;
  std::vector<Moment> truth;  // one per frame
};

// The same on every machine: positions are rounded to 1/256 of a pixel, so that the last bit of a library's sine cannot
// show.
ShippedTake makeShippedTake();

// volto_take.take, volto_take.truth.csv and manifest.json. Throws std::runtime_error.
void writeShippedTake(const ShippedTake& take, const std::filesystem::path& folder);

// The truth in the columns of `volto track`: timestamp, the 52 ARKit names, headYaw, headPitch, headRoll in degrees.
std::string truthCsv(const ShippedTake& take);

}  // namespace volto::recordings
