// Live Link Face CSV files: the blendshape weights that an iPhone app (or a program that writes the same format)
// recorded. Header `Timecode,BlendShapeCount,` and names; found by name, upper and lower case alike, in any order;
// other columns are passed over.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/errors.h"
#include "capture/read_report.h"
#include "frames/weight_frame.h"

namespace volto::capture {

// Frame by frame, in bounded memory. One thread at a time.
//
// Timecode is HH:MM:SS:FF.fff: FF frames of 1/60 s, .fff a fraction of a frame; the first row is time 0 and midnight
// may pass. Weights are clamped to 0..1 (neural networks overshoot a little); a shape without a column is not observed.
// A row with BlendShapeCount 0 is a frame without a face. Eye angles in the file are radians, +yaw toward the subject's
// right and +pitch down for both eyes; they are turned into Gaze's signs. The signs of the head angles are taken to be
// the same as the eyes' (no public file with head motion was at hand to prove it); head.observed is false in rows where
// all three are zero, as files without head motion have them. Same rules as OpenFaceCsvReader for time, damaged rows
// and the end of the file; NaN or infinite numbers are errors.
class LiveLinkCsvReader {
 public:
  explicit LiveLinkCsvReader(const std::filesystem::path& path);      // "-" is standard input
  LiveLinkCsvReader(std::string_view text, const std::string& name);  // `text` must outlive the reader
  ~LiveLinkCsvReader();
  LiveLinkCsvReader(LiveLinkCsvReader&&) noexcept;
  LiveLinkCsvReader& operator=(LiveLinkCsvReader&&) noexcept;

  // Shapes that have a column.
  const ArkitObserved& observed() const;
  bool next(WeightFrame& out);
  const ReadReport& report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct WeightRecording {
  std::vector<WeightFrame> frames;  // at least one; t_capture_ns rising from 0
  ArkitObserved observed;
  ReadReport report;
};

WeightRecording readLiveLinkCsv(const std::filesystem::path& path);
WeightRecording parseLiveLinkCsv(std::string_view text, const std::string& name);

// "18:43:58:59.723" -> nanoseconds since midnight. Nothing for text that is no such timecode.
std::optional<std::int64_t> timecodeNs(std::string_view text);

}  // namespace volto::capture
