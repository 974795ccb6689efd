// A recorded performance, whole and in memory, whatever file it came from.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"

namespace volto::pipeline {

enum class PerformanceFormat { take, openface_csv, live_link_csv };
std::string_view formatName(PerformanceFormat format);

struct Performance {
  PerformanceFormat format = PerformanceFormat::openface_csv;
  std::string source;  // the recorded source's name, for topics: a take says it, else the file's stem

  // One of the two is filled: points that the tracker still has to read, or expressions that are known already.
  std::vector<LandmarkFrame> landmarks;
  std::vector<MaskFrame> masks;

  std::uint64_t lost = 0;  // frames of the file that are not here: damaged, cut off, not later than the one before
  std::vector<std::string> warnings;  // one line each

  std::size_t frameCount() const { return landmarks.empty() ? masks.size() : landmarks.size(); }
  std::int64_t time(std::size_t frame) const {
    return landmarks.empty() ? masks[frame].t_capture_ns : landmarks[frame].t_capture_ns;
  }
  // Frames that the recording's own numbering says are missing.
  std::uint64_t gaps() const;
  double durationS() const;
  // Frames per second from the median step; 0 with fewer than two frames.
  double rate() const;
};

// Reads a take, an OpenFace CSV file with landmarks, or a Live Link Face CSV file: by what is in it, whatever it is
// called. "-" reads CSV from standard input. Throws rig::InputError, capture::InputError, protocol::SetupError (all:
// "file:line: what; what to do"), and std::system_error when the file cannot be opened.
Performance readPerformance(const std::filesystem::path& path);

}  // namespace volto::pipeline
