#include "capture/openface_csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "capture/csv_rows.h"

namespace volto::capture {
namespace {

constexpr std::size_t kPoints = 68;
constexpr std::size_t kAbsent = std::numeric_limits<std::size_t>::max();
constexpr double kMaxTime_s = 4e9;        // the year 2096, for files that count from 1970
constexpr double kMaxPixel = 1e6;         // no image is that large
constexpr double kMaxMillimetre = 1e7;    // ten kilometres from the camera
constexpr double kSmallestFace_px = 2.0;  // a face smaller than that is not in pixels, or not there

using Columns = std::array<std::size_t, kPoints>;

std::string secondsText(double seconds) {
  char text[32];
  const auto [stop, error] = std::to_chars(text, text + sizeof text, seconds);
  return error == std::errc() ? std::string(text, stop) : std::string("?");
}

// "x_12" -> 12 for the prefix "x_"; nothing for other names.
std::optional<std::size_t> pointNumber(std::string_view column, std::string_view prefix) {
  if (!column.starts_with(prefix)) return std::nullopt;
  column.remove_prefix(prefix.size());
  std::size_t number = 0;
  const auto [stop, error] = std::from_chars(column.data(), column.data() + column.size(), number);
  if (error != std::errc() || stop != column.data() + column.size()) return std::nullopt;
  return number;
}

}  // namespace

struct OpenFaceCsvReader::State {
  CsvRows rows;
  std::size_t frame = kAbsent, face_id = kAbsent, timestamp = kAbsent, confidence = kAbsent, success = kAbsent;
  std::array<Columns, 2> px{};
  std::array<Columns, 3> mm{};
  bool has_3d = false;

  ReadReport report;
  std::string first_face;
  bool any_frame = false;
  bool ended = false;
  double last_time_s = 0.0;
  std::int64_t last_t_ns = 0;
  std::uint64_t last_line = 0;
  std::uint64_t last_seq = 0;
  std::uint64_t frames_with_face = 0, frames_too_small = 0, frames_renumbered = 0;
  std::string first_equal, first_other, first_small, first_renumbered;

  State(ByteSource source, const std::string& name) : rows(std::move(source), name) { mapColumns(); }

  std::size_t column(std::string_view wanted) const {
    std::size_t found = kAbsent;
    for (std::size_t i = 0; i < rows.columns().size(); ++i) {
      if (rows.columns()[i] != wanted) continue;
      if (found != kAbsent) rows.fail("column '" + std::string(wanted) + "' is there twice; keep one of them");
      found = i;
    }
    return found;
  }

  // Finds prefix0 .. prefix67. Returns how many there are; refuses repeated ones and ones past the last point.
  std::size_t group(std::string_view prefix, Columns& out) const {
    out.fill(kAbsent);
    std::size_t found = 0;
    for (std::size_t i = 0; i < rows.columns().size(); ++i) {
      const auto number = pointNumber(rows.columns()[i], prefix);
      if (!number) continue;
      if (*number >= kPoints) {
        rows.fail("column " + shown(rows.columns()[i]) + " is one point too many; 68 points, 0 to 67, are expected");
      }
      if (out[*number] != kAbsent)
        rows.fail("column " + shown(rows.columns()[i]) + " is there twice; keep one of them");
      out[*number] = i;
      ++found;
    }
    return found;
  }

  void checkComplete(std::string_view prefix, const Columns& columns, std::size_t found) const {
    if (found == kPoints) return;
    const auto missing = static_cast<std::size_t>(std::find(columns.begin(), columns.end(), kAbsent) - columns.begin());
    rows.fail("the file has " + std::to_string(found) + " columns '" + std::string(prefix) + "*', 68 are needed ('" +
              std::string(prefix) + std::to_string(missing) + "' is missing); record all 68 points");
  }

  void mapColumns() {
    const std::size_t found_x = group("x_", px[0]), found_y = group("y_", px[1]);
    if (found_x == 0 && found_y == 0) {
      std::size_t action_units = 0;
      for (const auto& name : rows.columns()) {
        action_units += name.starts_with("AU") && (name.ends_with("_r") || name.ends_with("_c"));
      }
      if (action_units > 0) {
        rows.fail("the file has no landmarks (" + std::to_string(action_units) +
                  " action unit columns only); record it again with OpenFace's option -2Dfp");
      }
      rows.fail("no landmark columns x_0..x_67, y_0..y_67 in the header; is this an OpenFace CSV file?");
    }
    checkComplete("x_", px[0], found_x);
    checkComplete("y_", px[1], found_y);
    const std::size_t found_mm[3] = {group("X_", mm[0]), group("Y_", mm[1]), group("Z_", mm[2])};
    has_3d = found_mm[0] + found_mm[1] + found_mm[2] > 0;
    if (has_3d) {
      checkComplete("X_", mm[0], found_mm[0]);
      checkComplete("Y_", mm[1], found_mm[1]);
      checkComplete("Z_", mm[2], found_mm[2]);
    }
    frame = column("frame");
    face_id = column("face_id");
    timestamp = column("timestamp");
    confidence = column("confidence");
    success = column("success");
    if (timestamp == kAbsent) {
      rows.fail("no column 'timestamp'; files of single images have no times, record from a video");
    }
  }

  // A number that must be there in every row.
  double needed(std::size_t index) const {
    double value = 0.0;
    const std::string_view cell = rows.fields()[index];
    switch (parseNumber(cell, value)) {
      case NumberKind::finite:
        return value;
      case NumberKind::empty:
        rows.fail("column '" + rows.columns()[index] + "' is empty; a number is expected");
      case NumberKind::not_finite:
      case NumberKind::malformed:
        break;
    }
    rows.fail("column '" + rows.columns()[index] + "' holds " + shown(cell) + "; a finite number is expected");
  }

  // A landmark coordinate. False when the frame is without a face and the value says so too (NaN, infinite, empty).
  bool coordinate(std::size_t index, bool face, double limit, float& out) const {
    double value = 0.0;
    const std::string_view cell = rows.fields()[index];
    const NumberKind kind = parseNumber(cell, value);
    if (kind == NumberKind::finite && std::abs(value) <= limit) {
      out = static_cast<float>(value);
      return true;
    }
    if (!face && kind != NumberKind::malformed) return false;
    const std::string column_text = "column '" + rows.columns()[index] + "' ";
    if (kind == NumberKind::malformed) rows.fail(column_text + "holds " + shown(cell) + "; a number is expected");
    const std::string cell_text = kind == NumberKind::empty ? std::string("is empty") : "holds " + shown(cell);
    rows.fail(column_text + cell_text + " in a row with a face; give the point a position or set success to 0");
  }

  // Without a newline at the end, the last number may have been cut: "12e" and "" are, "12.3" nobody can tell.
  bool lastCellCut() const {
    if (rows.endsWithNewline()) return false;
    double ignored = 0.0;
    const NumberKind kind = parseNumber(rows.fields().back(), ignored);
    return kind == NumberKind::empty || kind == NumberKind::malformed;
  }

  bool readRow(LandmarkFrame& out);
  void finish();
};

bool OpenFaceCsvReader::State::readRow(LandmarkFrame& out) {
  for (;;) {
    if (ended) return false;
    const bool got = rows.next();
    if (got && lastCellCut()) rows.markLastRowCut();
    if (!got || rows.lastRowCut()) {
      ended = true;
      finish();
      return false;
    }
    ++report.rows_read;
    if (face_id != kAbsent) {
      const std::string_view id = rows.fields()[face_id];
      if (report.rows_read == 1) first_face = id;
      if (id != first_face) {
        if (report.rows_other_faces++ == 0) first_other = rows.here();
        continue;
      }
    }

    const double time_s = needed(timestamp);
    if (time_s < 0.0 || time_s > kMaxTime_s) {
      rows.fail("the time is " + secondsText(time_s) + " s; seconds since the start of the recording are expected");
    }
    const auto t_ns = static_cast<std::int64_t>(std::llround(time_s * 1e9));
    if (any_frame && t_ns < last_t_ns) {
      rows.fail("the time runs backward, from " + secondsText(last_time_s) + " s (line " + std::to_string(last_line) +
                ") to " + secondsText(time_s) + " s; sort the rows by time or cut the file here");
    }
    if (any_frame && t_ns == last_t_ns) {
      if (report.rows_equal_time++ == 0) first_equal = rows.here();
      continue;
    }

    std::uint64_t seq = any_frame ? last_seq + 1 : 0;
    if (frame != kAbsent) {
      const double number = needed(frame);
      if (number < 0.0 || number > 9e15 || number != std::floor(number)) {
        rows.fail("the frame number is " + shown(rows.fields()[frame]) + "; a whole number from 0 up is expected");
      }
      const auto given = static_cast<std::uint64_t>(number);
      if (!any_frame || given > last_seq)
        seq = given;
      else if (frames_renumbered++ == 0)
        first_renumbered = rows.here();
    }

    bool face = true;
    if (success != kAbsent) {
      const double value = needed(success);
      if (value != 0.0 && value != 1.0) {
        rows.fail("column 'success' holds " + shown(rows.fields()[success]) + "; 0 or 1 is expected");
      }
      face = value == 1.0;
    }
    double sure = face ? 1.0 : 0.0;
    if (confidence != kAbsent) {
      const NumberKind kind = parseNumber(rows.fields()[confidence], sure);
      if (kind != NumberKind::finite && (face || kind == NumberKind::malformed)) sure = needed(confidence);
      if (sure < -1.0 || sure > 1.0) {  // OpenFace 1 counted from -1
        rows.fail("the confidence is " + shown(rows.fields()[confidence]) + "; a number from 0 to 1 is expected");
      }
    }

    out.t_capture_ns = t_ns;
    out.capture_seq = seq;
    out.layout = LandmarkLayout::ibug68;
    out.confidence = static_cast<float>(std::max(sure, 0.0));
    out.image_width_px = out.image_height_px = 0;
    out.focal_length_px = 0.0;
    out.point_confidence.clear();
    out.points_px.resize(kPoints);
    out.points_camera_mm.resize(has_3d ? kPoints : 0);
    float low[2], high[2];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      low[axis] = std::numeric_limits<float>::max();
      high[axis] = std::numeric_limits<float>::lowest();
      for (std::size_t i = 0; i < kPoints; ++i) {
        float& value = out.points_px[i][axis];
        if (!coordinate(px[axis][i], face, kMaxPixel, value)) continue;
        low[axis] = std::min(low[axis], value);
        high[axis] = std::max(high[axis], value);
      }
    }
    if (has_3d) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < kPoints; ++i) {
          coordinate(mm[axis][i], face, kMaxMillimetre, out.points_camera_mm[i][axis]);
        }
      }
    }
    if (face) {
      ++frames_with_face;
      if (high[0] - low[0] < kSmallestFace_px && high[1] - low[1] < kSmallestFace_px) {
        if (frames_too_small++ == 0) first_small = rows.here();
        face = false;
      }
    }
    out.face_present = face;
    if (!face) {
      out.points_px.clear();
      out.points_camera_mm.clear();
      ++report.rows_lost;
    }
    any_frame = true;
    last_time_s = time_s;
    last_t_ns = t_ns;
    last_line = rows.line();
    last_seq = seq;
    return true;
  }
}

void OpenFaceCsvReader::State::finish() {
  if (frames_with_face > 0 && frames_too_small == frames_with_face) {
    rows.fail(
        "in every row the 68 points lie within 2 pixels of each other; x_* and y_* must be in pixels, are they 0..1?");
  }
  const auto add = [&](std::uint64_t count, const std::string& where, const std::string& what) {
    if (count > 0) report.warnings.push_back(where + ": " + what);
  };
  add(report.rows_equal_time, first_equal,
      std::to_string(report.rows_equal_time) + " row(s) with the same time as the row before left out, first here");
  add(report.rows_other_faces, first_other,
      std::to_string(report.rows_other_faces) + " row(s) of other faces than face_id " + shown(first_face) +
          " left out, first here");
  add(frames_too_small, first_small,
      std::to_string(frames_too_small) + " row(s) whose points lie within 2 pixels taken as no face, first here");
  add(frames_renumbered, first_renumbered,
      std::to_string(frames_renumbered) + " frame number(s) do not rise and were counted on, first here");
  report.last_row_cut = rows.lastRowCut();
  add(report.last_row_cut ? 1 : 0, rows.here(), "the file ends in the middle of this row; the row was left out");
}

OpenFaceCsvReader::OpenFaceCsvReader(const std::filesystem::path& path)
    : state_(std::make_unique<State>(fileBytes(path), path.string())) {}
OpenFaceCsvReader::OpenFaceCsvReader(std::string_view text, const std::string& name)
    : state_(std::make_unique<State>(memoryBytes(text), name)) {}
OpenFaceCsvReader::~OpenFaceCsvReader() = default;
OpenFaceCsvReader::OpenFaceCsvReader(OpenFaceCsvReader&&) noexcept = default;
OpenFaceCsvReader& OpenFaceCsvReader::operator=(OpenFaceCsvReader&&) noexcept = default;

bool OpenFaceCsvReader::has3d() const { return state_->has_3d; }
bool OpenFaceCsvReader::next(LandmarkFrame& out) { return state_->readRow(out); }
const ReadReport& OpenFaceCsvReader::report() const { return state_->report; }

namespace {

LandmarkRecording readAll(OpenFaceCsvReader reader, const std::string& name) {
  LandmarkRecording recording;
  recording.has_3d = reader.has3d();
  LandmarkFrame frame;
  while (reader.next(frame)) recording.frames.push_back(frame);
  recording.report = reader.report();
  if (recording.frames.empty()) {
    throw InputError(name + ":2: there is no complete row after the header; the file was cut or nothing was recorded");
  }
  return recording;
}

}  // namespace

LandmarkRecording readOpenFaceCsv(const std::filesystem::path& path) {
  return readAll(OpenFaceCsvReader(path), path == "-" ? "standard input" : path.string());
}
LandmarkRecording parseOpenFaceCsv(std::string_view text, const std::string& name) {
  return readAll(OpenFaceCsvReader(text, name), name);
}

}  // namespace volto::capture
