#include "tools/pipeline/performance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "capture/csv_kind.h"
#include "capture/csv_rows.h"
#include "capture/livelink_csv.h"
#include "capture/openface_csv.h"
#include "protocol/codec.h"
#include "protocol/take_reader.h"
#include "rig/errors.h"
#include "rig/expression_table.h"
#include "tools/pipeline/weights_to_mask.h"

namespace volto::pipeline {

namespace {

constexpr std::string_view kSqliteMagic = "SQLite format 3";
constexpr std::size_t kDetectionBytes = 64 * 1024;
constexpr std::size_t kPipedLimit = std::size_t{1} << 30;

// At most `limit` bytes; one more when there are more.
std::string readUpTo(const capture::ByteSource& source, std::size_t limit) {
  std::string text;
  std::array<char, 65536> block;
  while (text.size() <= limit) {
    const std::size_t got = source(block.data(), std::min(block.size(), limit + 1 - text.size()));
    if (got == 0) break;
    text.append(block.data(), got);
  }
  return text;
}

void takeReport(capture::ReadReport report, Performance& out) {
  if (report.last_row_cut) {
    // A whole performance was asked for: half of one is not quietly passed off as it.
    const std::string where =
        report.warnings.empty() ? std::string("the file ends in the middle of its last row") : report.warnings.back();
    throw rig::InputError(where.substr(0, where.find(';')) + "; copy it again, or delete that row to use the rest");
  }
  out.lost = report.rows_equal_time;
  out.warnings = std::move(report.warnings);
}

Performance fromLandmarks(capture::LandmarkRecording recording) {
  Performance out;
  out.format = PerformanceFormat::openface_csv;
  out.landmarks = std::move(recording.frames);
  takeReport(std::move(recording.report), out);
  return out;
}

Performance fromWeights(const capture::WeightRecording& recording) {
  Performance out;
  out.format = PerformanceFormat::live_link_csv;
  out.masks.resize(recording.frames.size());
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    maskFromWeights(recording.frames[i], rig::ExpressionTable::standard(), out.masks[i]);
  }
  takeReport(recording.report, out);
  return out;
}

// The frames of one kind and of the first source that has any. A frame whose time does not advance is left out and
// counted.
template <typename Message, typename Frame>
void readStream(protocol::TakeReader& reader, protocol::MessageKind kind, std::vector<Frame>& frames,
                Performance& out) {
  reader.rewind();
  protocol::TakeRow row;
  Message message;
  std::uint64_t other_sources = 0, not_later = 0;
  while (reader.next(row)) {
    if (row.kind != kind) continue;
    if (frames.empty()) out.source = row.name;
    if (row.name != out.source) {
      ++other_sources;
    } else if (!protocol::decode(row.payload, message)) {
      ++out.lost;  // the reader has checked it already: cannot happen
    } else if (!frames.empty() && message.frame.t_capture_ns <= frames.back().t_capture_ns) {
      ++not_later;
    } else {
      frames.push_back(message.frame);
    }
  }
  // A take keeps the monotonic clock of the machine it was made on; a performance begins at zero.
  const std::int64_t start_ns = frames.empty() ? 0 : frames.front().t_capture_ns;
  for (Frame& frame : frames) frame.t_capture_ns -= start_ns;
  out.lost += not_later;
  if (other_sources > 0) {
    out.warnings.push_back(std::to_string(other_sources) + " frames of other sources than " + out.source + " left out");
  }
  if (not_later > 0) out.warnings.push_back(std::to_string(not_later) + " frames whose time does not advance left out");
}

Performance fromTake(const std::string& path) {
  protocol::TakeReader reader(path);
  Performance out;
  out.format = PerformanceFormat::take;
  readStream<protocol::LandmarkMessage>(reader, protocol::MessageKind::landmarks, out.landmarks, out);
  if (out.landmarks.empty()) readStream<protocol::MaskMessage>(reader, protocol::MessageKind::mask, out.masks, out);
  const protocol::TakeReaderCounters& counters = reader.counters();
  out.lost += counters.bad_rows + counters.lost_rows;
  if (counters.damaged()) {
    out.warnings.push_back(path + ": damaged, " + std::to_string(counters.bad_rows + counters.lost_rows) +
                           " messages lost; " + counters.first_problem);
  }
  if (out.frameCount() == 0) {
    throw rig::InputError(path + ": the take holds no landmarks and no masks; record with --topics landmarks/");
  }
  return out;
}

}  // namespace

std::string_view formatName(PerformanceFormat format) {
  switch (format) {
    case PerformanceFormat::take:
      return "take";
    case PerformanceFormat::openface_csv:
      return "OpenFace CSV";
    case PerformanceFormat::live_link_csv:
      return "Live Link Face CSV";
  }
  return "unknown";
}

std::uint64_t Performance::gaps() const {
  std::uint64_t missing = 0;
  const auto add = [&](std::uint64_t before, std::uint64_t after) {
    missing += after > before + 1 ? after - before - 1 : 0;
  };
  for (std::size_t i = 1; i < landmarks.size(); ++i) add(landmarks[i - 1].capture_seq, landmarks[i].capture_seq);
  for (std::size_t i = 1; i < masks.size(); ++i) add(masks[i - 1].capture_seq, masks[i].capture_seq);
  return missing;
}

double Performance::durationS() const {
  return frameCount() < 2 ? 0.0 : static_cast<double>(time(frameCount() - 1) - time(0)) * 1e-9;
}

double Performance::rate() const {
  if (frameCount() < 2) return 0.0;
  std::vector<std::int64_t> steps;
  steps.reserve(frameCount() - 1);
  for (std::size_t i = 1; i < frameCount(); ++i) steps.push_back(time(i) - time(i - 1));
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle > 0 ? 1e9 / static_cast<double>(*middle) : 0.0;
}

Performance readPerformance(const std::filesystem::path& path) {
  const bool piped = path == "-";
  const std::string name = piped ? "standard input" : path.string();
  std::string text = readUpTo(capture::fileBytes(path), piped ? kPipedLimit : kDetectionBytes);
  if (piped && text.size() > kPipedLimit)
    throw rig::InputError("standard input: more than 1 GiB; give the file by name");

  Performance out;
  if (text.starts_with(kSqliteMagic)) {
    if (piped) throw rig::InputError("standard input: a take cannot be read from a pipe; give the file by name");
    out = fromTake(path.string());
  } else if (capture::csvKind(text) == capture::CsvKind::live_link) {
    out = fromWeights(piped ? capture::parseLiveLinkCsv(text, name) : capture::readLiveLinkCsv(path));
  } else {
    // Also for a file that is nothing known: the reader says what is wrong with it.
    out = fromLandmarks(piped ? capture::parseOpenFaceCsv(text, name) : capture::readOpenFaceCsv(path));
  }
  if (out.source.empty()) out.source = piped ? "stdin" : path.stem().string();
  return out;
}

}  // namespace volto::pipeline
