#include "tools/pipeline/replay.h"

#include <algorithm>

#include "tools/pipeline/pacer.h"

namespace volto::pipeline {

namespace {

constexpr std::int64_t kReportInterval_ns = 500'000'000;

protocol::StageLatency stage(const char* name, const LatencyHistogram& latency) {
  return {name, latency.count(), static_cast<double>(latency.percentile(0.5)) * 1e-3,
          static_cast<double>(latency.percentile(0.99)) * 1e-3};
}

void report(const Performance& performance, const ReplayResult& so_far, protocol::PipelineState state,
            protocol::Publisher& publisher) {
  protocol::StatusReport report;
  report.state = state;
  report.source = performance.source;
  report.frames_in = so_far.frames;
  report.dropped_driver = so_far.gaps;
  report.deadline_misses = so_far.late;
  report.stages = {stage("tracker", so_far.tracker), stage("retarget", so_far.retarget),
                   stage("landmarks to sent", so_far.sent)};
  publisher.setReport(report);
}

}  // namespace

ReplayResult replay(const Performance& performance, FramePath& path, protocol::Publisher& publisher,
                    const ReplayOptions& options, const std::function<bool()>& stop) {
  ReplayResult result;
  const std::size_t count = performance.frameCount();
  const bool has_landmarks = !performance.landmarks.empty();
  const std::int64_t first_time = performance.time(0);
  const auto frame_ns = performance.rate() > 0 ? static_cast<std::int64_t>(1e9 / performance.rate()) : std::int64_t{0};
  const std::int64_t round_ns = performance.time(count - 1) - first_time + frame_ns;
  const std::uint64_t first_seq =
      has_landmarks ? performance.landmarks[0].capture_seq : performance.masks[0].capture_seq;
  const std::uint64_t last_seq =
      has_landmarks ? performance.landmarks[count - 1].capture_seq : performance.masks[count - 1].capture_seq;

  report(performance, result, protocol::PipelineState::running, publisher);
  const std::int64_t start = monotonicNow();
  const Pacer pacer(start, options.speed);
  LandmarkFrame landmarks;
  std::int64_t next_report = start + kReportInterval_ns;
  std::int64_t last_sent = start, first_sent = start;

  for (std::uint64_t round = 0;; ++round) {
    if (round > 0) path.restart();
    for (std::size_t frame = 0; frame < count; ++frame) {
      const std::int64_t offset = static_cast<std::int64_t>(round) * round_ns + performance.time(frame) - first_time;
      std::int64_t due = pacer.due(offset);
      while (!stop() && !pacer.wait(due)) {
      }
      if (stop()) {
        result.stopped = true;
        break;
      }
      const std::int64_t in = monotonicNow();
      if (options.speed <= 0) due = in;
      path.push(performance, frame);
      result.tracker.add(path.trackedAt() - in);
      result.retarget.add(path.retargetedAt() - path.trackedAt());

      const std::uint64_t seq_shift = round * (last_seq - first_seq + 1);
      if (has_landmarks) {
        landmarks = performance.landmarks[frame];  // into the memory of the frame before
        landmarks.t_capture_ns = due;
        landmarks.capture_seq += seq_shift;
        publisher.push(landmarks);
      }
      path.mask().t_capture_ns = due;
      path.mask().capture_seq += seq_shift;
      path.avatar().t_capture_ns = due;
      path.avatar().capture_seq += seq_shift;
      publisher.push(path.mask());
      publisher.push(path.avatar());
      publisher.flush();

      last_sent = monotonicNow();
      if (result.frames == 0) first_sent = last_sent;
      ++result.frames;
      result.sent.add(last_sent - in);
      if (options.speed > 0 &&
          last_sent > due + static_cast<std::int64_t>(static_cast<double>(frame_ns) / options.speed))
        ++result.late;
      if (last_sent >= next_report) {
        next_report = last_sent + kReportInterval_ns;
        report(performance, result, protocol::PipelineState::running, publisher);
      }
    }
    if (!result.stopped) result.gaps += performance.gaps();
    if (result.stopped || !options.loop) break;
  }
  report(performance, result, protocol::PipelineState::stopping, publisher);
  const protocol::PublisherCounters counters = publisher.counters();
  result.dropped = counters.replaced + counters.refused + counters.send_failures;
  result.seconds = static_cast<double>(last_sent - first_sent) * 1e-9;
  return result;
}

}  // namespace volto::pipeline
