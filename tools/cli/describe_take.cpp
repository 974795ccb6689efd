#include <nlohmann/json.hpp>

#include "protocol/take_reader.h"
#include "tools/cli/file_description.h"

namespace volto::cli {

Json describeTake(const std::filesystem::path& path) {
  const protocol::TakeSummary summary = protocol::summarizeTake(path.string());
  Json out{{"kind", "take"}, {"file", path.filename().string()}};
  const protocol::TakeHeader& header = summary.header;
  out["name"] = header.name;
  out["source"] = header.source;
  out["layout"] = header.layout;
  out["actor"] = header.actor;
  out["note"] = header.note;
  out["program"] = header.program;
  out["start_realtime_ns"] = header.start_realtime_ns;
  out["finished"] = summary.finished;

  // The stream that a replay would play gives the take's length.
  std::uint64_t frames = 0, gaps = 0, lost = 0;
  double duration_s = 0;
  Json streams = Json::object();
  for (const auto& [topic, stream] : summary.streams) {
    const double seconds = static_cast<double>(stream.last_ns - stream.first_ns) * 1e-9;
    streams[topic] = {{"messages", stream.messages}, {"lost", stream.lost},   {"capture_lost", stream.capture_lost},
                      {"bytes", stream.bytes},       {"duration_s", seconds}, {"rate_hz", stream.rate_hz()}};
    lost += stream.lost;
    const bool landmarks = stream.kind == protocol::MessageKind::landmarks;
    if (landmarks || (frames == 0 && stream.kind == protocol::MessageKind::mask)) {
      frames = stream.messages;
      gaps = stream.capture_lost;
      duration_s = seconds;
    }
  }
  out["frames"] = frames;
  out["duration_s"] = duration_s;
  out["gaps"] = gaps;
  out["lost"] = lost;
  out["streams"] = std::move(streams);
  const protocol::TakeReaderCounters& counters = summary.counters;
  out["damage"] = {{"bad_rows", counters.bad_rows},
                   {"lost_rows", counters.lost_rows},
                   {"unknown_topics", counters.unknown_topics},
                   {"file_damaged", counters.file_damaged}};
  Json problems = Json::array();
  if (!summary.finished) problems.push_back("the take was not ended: its writer was killed or is still at it");
  if (counters.damaged()) problems.push_back("damaged: " + counters.first_problem);
  if (frames == 0) problems.push_back("there are no landmarks and no masks to replay");
  out["problems"] = std::move(problems);
  return out;
}

}  // namespace volto::cli
