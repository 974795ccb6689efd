// Pictures to files. The same picture gives the same bytes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "tools/picture/picture.h"

namespace volto::picture {

// 8-bit RGB PNG.
std::vector<std::byte> encodePng(const Picture& picture);

// Written whole or not at all (temporary file beside it, then renamed). Throws std::system_error.
void writePng(const std::filesystem::path& path, const Picture& picture);

struct ApngOptions {
  int plays = 0;      // 0: for ever
  int colours = 192;  // 2 .. 255: palette shared by all frames; fewer make a smaller file
};

// Animated PNG (https://wiki.mozilla.org/APNG_Specification): palette of the whole sequence, and of every frame only
// what has changed. A program that does not know animation shows the first frame. Throws std::invalid_argument without
// frames, when sizes differ, or fps is not 0.1 .. 1000.
std::vector<std::byte> encodeApng(std::span<const Picture> frames, double fps, const ApngOptions& options = {});
void writeApng(const std::filesystem::path& path, std::span<const Picture> frames, double fps,
               const ApngOptions& options = {});

}  // namespace volto::picture
