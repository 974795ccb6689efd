// Heads with all 84 points known, turned, scaled and moved anyhow, and what a fit makes of them when told a few.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include <gtest/gtest.h>

#include "rig/fitting/fit_points.h"

// Ten times slower there, and seen often enough in the other tests.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VOLTO_PLAIN_BUILD_ONLY() GTEST_SKIP() << "SKIPPED: measured in the plain build"
#else
#define VOLTO_PLAIN_BUILD_ONLY() static_cast<void>(0)
#endif

namespace volto::rig::test {

struct KnownHead {
  Mesh mesh;
  FeaturePointChoices truth;  // all 84

  static KnownHead read(const std::filesystem::path& mesh, const std::filesystem::path& points);

  // Any rotation, scale 0.01 to 100, any translation, all from the seed. 0: as it is.
  KnownHead placedAnyhow(unsigned seed) const;
  KnownHead mirrored() const;   // x -> -x, vertices and polygons as they were: left-handed, inside out
  KnownHead insideOut() const;  // every polygon the other way round

  Eigen::Vector3d at(std::string_view id) const;
  double eyeSeparation() const;
  FeaturePointChoices told(std::span<const std::string_view> ids) const;
};

// Distances from the truth in eye separations, over all 84 points.
struct FitError {
  double mean = 0, worst = 0;
  std::string_view worst_point;
};
FitError errorOf(const FittedPoints& fitted, const KnownHead& head);

}  // namespace volto::rig::test
