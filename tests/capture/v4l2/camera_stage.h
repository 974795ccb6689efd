// A fake camera, the source on it, and what a test wants to know about what comes out.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "capture/image_source.h"
#include "capture/v4l2/camera_source.h"
#include "tests/capture/fake/pictures.h"
#include "tests/capture/fake/virtual_system.h"

namespace volto::capture {

inline constexpr std::int64_t kMs = 1'000'000, kSecond = 1'000'000'000;

struct Stage {
  // Opens at once; a camera that cannot be opened throws DeviceError out of the constructor.
  explicit Stage(const std::string& script, CameraOptions options = {})
      : system(script), source(openCamera(options, system)) {}

  fake::Device& camera(std::size_t index = 0) { return system.world().device(index); }
  const SourceCounters& counters() const { return source->counters(); }
  double seconds() { return static_cast<double>(system.nowNs() - fake::VirtualSystem::kStartNs) * 1e-9; }

  Next next(std::int64_t timeout_ms = 100) { return source->next(image, std::chrono::milliseconds(timeout_ms)); }

  // Calls next() until so many pictures have come or the time is over; gives how many.
  int take(int pictures, std::int64_t within_ms = 60'000) {
    const std::int64_t deadline = system.nowNs() + within_ms * kMs;
    int taken = 0;
    while (taken < pictures && system.nowNs() < deadline) {
      if (next() == Next::frame) ++taken;
    }
    return taken;
  }

  // Seconds from now until `condition` holds after a next(); a large number when it does not within the limit.
  double until(const std::function<bool()>& condition, double limit_s = 30) {
    const std::int64_t start = system.nowNs();
    while (!condition()) {
      next(10);
      if (static_cast<double>(system.nowNs() - start) > limit_s * 1e9) return 1e9;
    }
    return static_cast<double>(system.nowNs() - start) * 1e-9;
  }
  double untilState(SourceState state, double limit_s = 30) {
    return until([&] { return source->state() == state; }, limit_s);
  }
  double untilPictures(std::uint64_t count, double limit_s = 30) {
    return until([&] { return counters().captured >= count; }, limit_s);
  }

  fake::VirtualSystem system;
  std::unique_ptr<ImageSource> source;
  Image image;
};

// Does the text hold all of these?
inline testing::AssertionResult says(const std::string& text, std::initializer_list<const char*> parts) {
  for (const char* const part : parts) {
    if (text.find(part) == std::string::npos)
      return testing::AssertionFailure() << "\"" << text << "\" does not say \"" << part << "\"";
  }
  return testing::AssertionSuccess();
}

// Largest difference of the middles of the eight bars from their true colours.
inline int colourError(const Image& image) {
  int worst = 0;
  for (int bar = 0; bar < 8; ++bar) {
    const int x = (2 * bar + 1) * image.width / 16, y = image.height / 2;
    for (std::size_t c = 0; c < 3; ++c) {
      const int seen = image.bgr[3 * static_cast<std::size_t>(y * image.width + x) + c];
      worst = std::max(worst, std::abs(seen - fake::kBars[static_cast<std::size_t>(bar)][c]));
    }
  }
  return worst;
}

// The message of the DeviceError that opening gives; empty when it opens.
inline std::string openingError(const std::string& script, const CameraOptions& options = {},
                                const std::function<void(fake::VirtualSystem&)>& prepare = {}) {
  fake::VirtualSystem system(script);
  if (prepare) prepare(system);
  try {
    openCamera(options, system);
    return {};
  } catch (const DeviceError& error) {
    EXPECT_EQ(system.world().openFiles(), 0U) << "left open";
    EXPECT_EQ(system.world().liveMaps(), 0U) << "left mapped";
    return error.what();
  }
}

}  // namespace volto::capture
