#include "capture/livelink_csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "capture/csv_rows.h"

namespace volto::capture {
namespace {

constexpr std::size_t kAbsent = std::numeric_limits<std::size_t>::max();
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kDay_ns = 24 * 3600 * kSecond_ns;
constexpr double kOvershoot = 0.05;  // weights beyond 0..1 by more than this are worth a word
constexpr double kMaxAngle_rad = 6.5;

bool sameName(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

// A whole number of one or two digits that must be followed by `end` (or by nothing, for '\0'); removes both from
// `text`.
std::optional<int> twoDigits(std::string_view& text, char end) {
  int value = 0;
  std::size_t digits = 0;
  while (digits < text.size() && text[digits] >= '0' && text[digits] <= '9') {
    value = value * 10 + (text[digits] - '0');
    if (++digits > 2) return std::nullopt;
  }
  if (digits == 0) return std::nullopt;
  text.remove_prefix(digits);
  if (text.empty()) return end == '\0' ? std::optional(value) : std::nullopt;
  if (end != '\0') {
    if (text.front() != end) return std::nullopt;
    text.remove_prefix(1);
  }
  return value;
}

}  // namespace

std::optional<std::int64_t> timecodeNs(std::string_view text) {
  const auto hours = twoDigits(text, ':');
  const auto minutes = hours ? twoDigits(text, ':') : std::nullopt;
  const auto seconds = minutes ? twoDigits(text, ':') : std::nullopt;
  const auto frames = seconds ? twoDigits(text, '\0') : std::nullopt;
  if (!frames || *hours > 23 || *minutes > 59 || *seconds > 59 || *frames > 59) return std::nullopt;
  std::int64_t fraction_ns = 0;  // of a frame, in 1e-9 frames
  if (!text.empty()) {
    if (text.front() != '.' || text.size() < 2 || text.size() > 10) return std::nullopt;
    std::int64_t place = kSecond_ns / 10;
    for (const char c : text.substr(1)) {
      if (c < '0' || c > '9') return std::nullopt;
      fraction_ns += (c - '0') * place;
      place /= 10;
    }
  }
  return (*hours * 3600 + *minutes * 60 + *seconds) * kSecond_ns + (*frames * kSecond_ns + fraction_ns) / 60;
}

struct LiveLinkCsvReader::State {
  CsvRows rows;
  std::size_t timecode = kAbsent, count = kAbsent;
  std::array<std::size_t, kArkitBlendshapeCount> shape{};
  std::array<std::size_t, 3> head{};                // yaw, pitch, roll
  std::array<std::array<std::size_t, 2>, 2> eye{};  // left, right: yaw, pitch
  ArkitObserved observed;
  bool has_head = false, has_eyes = false;

  ReadReport report;
  bool any_frame = false, ended = false;
  std::int64_t first_ns = 0, last_ns = 0, midnights_ns = 0;
  std::string last_timecode;
  std::uint64_t last_line = 0, seq = 0;
  std::uint64_t weights_clamped = 0;
  std::string first_equal, first_clamped;

  State(ByteSource source, const std::string& name) : rows(std::move(source), name) { mapColumns(); }

  std::size_t column(std::string_view wanted) const {
    std::size_t found = kAbsent;
    for (std::size_t i = 0; i < rows.columns().size(); ++i) {
      if (!sameName(rows.columns()[i], wanted)) continue;
      if (found != kAbsent) rows.fail("column '" + rows.columns()[i] + "' is there twice; keep one of them");
      found = i;
    }
    return found;
  }

  void mapColumns() {
    timecode = column("Timecode");
    if (timecode == kAbsent) rows.fail("no column 'Timecode' in the header; is this a Live Link Face CSV file?");
    count = column("BlendShapeCount");
    for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
      shape[k] = column(kArkitBlendshapeNames[k]);
      observed[k] = shape[k] != kAbsent;
    }
    if (observed.none()) {
      rows.fail(
          "the header names none of the 52 ARKit blendshapes (EyeBlinkLeft, ...); is this a Live Link Face CSV file?");
    }
    head = {column("HeadYaw"), column("HeadPitch"), column("HeadRoll")};
    eye = {{{column("LeftEyeYaw"), column("LeftEyePitch")}, {column("RightEyeYaw"), column("RightEyePitch")}}};
    has_head = head[0] != kAbsent && head[1] != kAbsent && head[2] != kAbsent;
    has_eyes = eye[0][0] != kAbsent && eye[0][1] != kAbsent && eye[1][0] != kAbsent && eye[1][1] != kAbsent;
    if (count != kAbsent) rows.allowShortRows(std::max(timecode, count) + 1);
  }

  double number(std::size_t index) const {
    double value = 0.0;
    if (parseNumber(rows.fields()[index], value) == NumberKind::finite) return value;
    const std::string column_text = "column '" + rows.columns()[index] + "' ";
    if (rows.fields()[index].empty()) rows.fail(column_text + "is empty; a number is expected");
    rows.fail(column_text + "holds " + shown(rows.fields()[index]) + "; a finite number is expected");
  }

  float angle(std::size_t index) const {
    const double value = number(index);
    if (std::abs(value) > kMaxAngle_rad) {
      rows.fail("column '" + rows.columns()[index] + "' holds " + shown(rows.fields()[index]) +
                "; an angle in radians is expected");
    }
    return static_cast<float>(value);
  }

  bool lastCellCut() const {
    if (rows.endsWithNewline()) return false;
    double ignored = 0.0;
    return parseNumber(rows.fields().back(), ignored) != NumberKind::finite;
  }

  void readFace(WeightFrame& out);
  bool readRow(WeightFrame& out);
  void finish();
};

void LiveLinkCsvReader::State::readFace(WeightFrame& out) {
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    if (!observed[k]) continue;
    const double value = number(shape[k]);
    if ((value < -kOvershoot || value > 1.0 + kOvershoot) && weights_clamped++ == 0) {
      first_clamped =
          rows.here() + ": column '" + rows.columns()[shape[k]] + "' holds " + shown(rows.fields()[shape[k]]);
    }
    out.weights[k] = static_cast<float>(std::clamp(value, 0.0, 1.0));
  }
  if (has_head) {
    const float yaw = angle(head[0]), pitch = angle(head[1]), roll = angle(head[2]);
    out.head.observed = yaw != 0.0F || pitch != 0.0F || roll != 0.0F;
    out.head.yaw_rad = 0.0F - yaw;
    out.head.pitch_rad = 0.0F - pitch;
    out.head.roll_rad = roll;
  }
  if (has_eyes) {
    out.gaze.left = {0.0F - angle(eye[0][0]), 0.0F - angle(eye[0][1])};
    out.gaze.right = {0.0F - angle(eye[1][0]), 0.0F - angle(eye[1][1])};
    out.gaze.confidence = 1.0F;
  }
}

bool LiveLinkCsvReader::State::readRow(WeightFrame& out) {
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

    const std::string_view code = rows.fields()[timecode];
    const auto of_day = timecodeNs(code);
    if (!of_day) rows.fail("the timecode is " + shown(code) + "; HH:MM:SS:FF.fff with frames 0 to 59 is expected");
    std::int64_t t_ns = *of_day + midnights_ns;
    if (any_frame && t_ns < last_ns - kDay_ns / 2) {
      midnights_ns += kDay_ns;
      t_ns += kDay_ns;
    }
    if (any_frame && t_ns < last_ns) {
      rows.fail("the time runs backward, from " + last_timecode + " (line " + std::to_string(last_line) + ") to " +
                std::string(code) + "; sort the rows by time or cut the file here");
    }
    if (any_frame && t_ns == last_ns) {
      if (report.rows_equal_time++ == 0) first_equal = rows.here();
      continue;
    }
    if (!any_frame) first_ns = t_ns;

    out = WeightFrame{};
    out.t_capture_ns = t_ns - first_ns;
    out.capture_seq = seq++;
    out.observed = observed;
    out.face_present = count == kAbsent || number(count) > 0.0;
    if (out.face_present && rows.fields().size() < rows.columns().size()) {
      rows.fail("the row has " + std::to_string(rows.fields().size()) + " fields, the header " +
                std::to_string(rows.columns().size()) + "; the file is damaged or was edited");
    }
    if (!out.face_present)
      ++report.rows_lost;
    else
      readFace(out);
    any_frame = true;
    last_ns = t_ns;
    last_timecode = code;
    last_line = rows.line();
    return true;
  }
}

void LiveLinkCsvReader::State::finish() {
  if (report.rows_equal_time > 0) {
    report.warnings.push_back(first_equal + ": " + std::to_string(report.rows_equal_time) +
                              " row(s) with the same time as the row before left out, first here");
  }
  if (weights_clamped > 0) {
    report.warnings.push_back(first_clamped + "; " + std::to_string(weights_clamped) +
                              " weight(s) outside 0..1 clamped");
  }
  report.last_row_cut = rows.lastRowCut();
  if (report.last_row_cut) {
    report.warnings.push_back(rows.here() + ": the file ends in the middle of this row; the row was left out");
  }
}

LiveLinkCsvReader::LiveLinkCsvReader(const std::filesystem::path& path)
    : state_(std::make_unique<State>(fileBytes(path), path.string())) {}
LiveLinkCsvReader::LiveLinkCsvReader(std::string_view text, const std::string& name)
    : state_(std::make_unique<State>(memoryBytes(text), name)) {}
LiveLinkCsvReader::~LiveLinkCsvReader() = default;
LiveLinkCsvReader::LiveLinkCsvReader(LiveLinkCsvReader&&) noexcept = default;
LiveLinkCsvReader& LiveLinkCsvReader::operator=(LiveLinkCsvReader&&) noexcept = default;

const ArkitObserved& LiveLinkCsvReader::observed() const { return state_->observed; }
bool LiveLinkCsvReader::next(WeightFrame& out) { return state_->readRow(out); }
const ReadReport& LiveLinkCsvReader::report() const { return state_->report; }

namespace {

WeightRecording readAll(LiveLinkCsvReader reader, const std::string& name) {
  WeightRecording recording;
  recording.observed = reader.observed();
  WeightFrame frame;
  while (reader.next(frame)) recording.frames.push_back(frame);
  recording.report = reader.report();
  if (recording.frames.empty()) {
    throw InputError(name + ":2: there is no complete row after the header; the file was cut or nothing was recorded");
  }
  return recording;
}

}  // namespace

WeightRecording readLiveLinkCsv(const std::filesystem::path& path) {
  return readAll(LiveLinkCsvReader(path), path == "-" ? "standard input" : path.string());
}
WeightRecording parseLiveLinkCsv(std::string_view text, const std::string& name) {
  return readAll(LiveLinkCsvReader(text, name), name);
}

}  // namespace volto::capture
