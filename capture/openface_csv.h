// OpenFace 2 CSV files: 68 landmarks (iBUG / Multi-PIE order) per row, in pixels and, where the file has them, in
// millimetres. Columns as OpenFace's RecorderCSV writes them (T. Baltrusaitis et al., OpenFace 2.0, FG 2018), found by
// name:
//   timestamp (s), x_0..x_67, y_0..y_67 (px)            needed
//   frame, face_id, confidence (0..1), success (0/1)    used where present
//   X_0..X_67, Y_*, Z_* (mm, camera frame)              used where present
// All other columns are passed over.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "capture/errors.h"
#include "capture/read_report.h"
#include "frames/landmark_frame.h"

namespace volto::capture {

// Frame by frame, in bounded memory. One thread at a time.
//
// A row with success 0 is a frame without a face (face_present false, no points), whatever its landmarks hold. In a row
// with success 1 every landmark must be a finite number: an empty, NaN or infinite one is an error that names line and
// column. Times must rise: a row with the same time as the one before is dropped and counted, a smaller time is an
// error. Where a file holds several faces, the first one's rows are kept. A row cut off at the end of the file is
// dropped and reported.
class OpenFaceCsvReader {
 public:
  // Opens the file ("-" is standard input) and reads its header. Throws InputError, or std::system_error when it cannot
  // be opened.
  explicit OpenFaceCsvReader(const std::filesystem::path& path);
  // `text` must outlive the reader; `name` begins every error.
  OpenFaceCsvReader(std::string_view text, const std::string& name);
  ~OpenFaceCsvReader();
  OpenFaceCsvReader(OpenFaceCsvReader&&) noexcept;
  OpenFaceCsvReader& operator=(OpenFaceCsvReader&&) noexcept;

  bool has3d() const;
  // The next frame, or false at the end. `out` is reused: nothing is allocated after the first frame. Throws
  // InputError, std::system_error.
  bool next(LandmarkFrame& out);
  // So far; complete once next() has returned false.
  const ReadReport& report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct LandmarkRecording {
  std::vector<LandmarkFrame> frames;  // at least one; t_capture_ns rising
  bool has_3d = false;
  ReadReport report;
};

// The whole file at once. Also refuses a file without a single frame.
LandmarkRecording readOpenFaceCsv(const std::filesystem::path& path);
LandmarkRecording parseOpenFaceCsv(std::string_view text, const std::string& name);

}  // namespace volto::capture
