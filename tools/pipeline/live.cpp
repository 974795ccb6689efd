#include "tools/pipeline/live.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "protocol/topics.h"
#include "tools/pipeline/pacer.h"
#include "tools/pipeline/slot.h"

namespace volto::pipeline {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kReportInterval_ns = 500'000'000;
constexpr auto kPatience = 50ms;  // how long a stage waits before it looks around
// A file in real time: frames that may wait before a stage. A stall of a few of them is made up for within a second,
// and a frame that is shown a little late bears its own time all the same. A camera's frames never wait.
constexpr std::size_t kFileRoom = 6;
constexpr std::int64_t kSilence_ns = 150'000'000;  // a source that says nothing for so long shows no face

struct Captured {
  capture::Image image;
  std::int64_t t_shown_ns = 0;  // the t_capture_ns that subscribers are told
  std::int64_t arrived_ns = 0;  // when it was handed to the pipeline
};

struct Found {
  LandmarkFrame landmarks;
  capture::Image image;
  std::int64_t t_shown_ns = 0, arrived_ns = 0;
  std::int64_t worked_ns = 0;  // by the stages so far, without the networks and without waiting
};

// A frame that has been sent, for those who look at it.
struct Sent {
  LandmarkFrame landmarks;
  capture::Image image;
  MaskFrame mask;
  AvatarFrame avatar;
  std::int64_t t_source_ns = 0;
};

// What a stage has done; read by others.
class Meter {
 public:
  void add(std::int64_t ns) {
    const std::lock_guard lock(mutex_);
    latency_.add(ns);
  }
  StageReport report(std::string name, double seconds) const {
    const std::lock_guard lock(mutex_);
    StageReport out;
    out.name = std::move(name);
    out.count = latency_.count();
    out.rate_hz = seconds > 0 ? static_cast<double>(out.count) / seconds : 0;
    out.latency = latency_;
    return out;
  }

 private:
  mutable std::mutex mutex_;
  LatencyHistogram latency_;
};

}  // namespace

struct Live::State {
  State(const rig::Rig& rig, LiveInput in, protocol::Publisher& p, const LiveOptions& o, protocol::TakeWriter* t)
      : input(std::move(in)),
        publisher(p),
        options(o),
        take(t),
        source_name(protocol::topicNameFrom(input.name)),
        path(rig, o.tracking, {.mesh = o.mesh, .weights = true}),
        captured(policy(), room()),
        found(policy(), room()),
        sent(policy()) {
    if (options.translation) path.speakAs(*options.translation);
  }

  SlotPolicy policy() const { return options.every_frame ? SlotPolicy::every_frame : SlotPolicy::newest_wins; }
  std::size_t room() const { return input.live || options.every_frame ? 1 : kFileRoom; }

  void capture();
  void captureDatagrams();
  void detect();
  void track();
  void publish(Found& item);
  void show();
  void beSilent(Found& item);
  void calibrate(const LandmarkFrame& landmarks);
  void noteSource();
  void sendReport(protocol::PipelineState state);
  LiveReport makeReport() const;

  template <typename Stage>
  void run(Stage stage) {
    threads.emplace_back([this, stage] {
      try {
        (this->*stage)();
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        closeAll(true);
        ended = true;
        end_changed.notify_all();
      }
    });
  }
  void closeAll(bool throw_away) {
    captured.close(throw_away);
    found.close(throw_away);
    sent.close(throw_away);
  }

  LiveInput input;
  protocol::Publisher& publisher;
  LiveOptions options;
  protocol::TakeWriter* take;
  std::string source_name;
  FramePath path;

  Slot<Captured> captured;
  Slot<Found> found;
  Slot<Sent> sent;
  std::atomic<bool> stopping{false};
  std::atomic<bool> calibrate_wanted{false};
  std::atomic<std::uint64_t> frames_sent{0}, faces{0}, calibrations{0};
  std::vector<std::thread> threads;
  std::int64_t start_ns = 0;

  Meter capture_meter, detection_meter, tracker_meter, retarget_meter, learning_meter, publish_meter, work_meter,
      whole_meter;

  // The tracker thread's own.
  std::vector<LandmarkFrame> rest;
  bool calibrating = false;

  mutable std::mutex mutex;  // guards what follows
  std::condition_variable end_changed;
  bool ended = false;
  std::exception_ptr failure;
  capture::SourceCounters source;
  capture::SourceState source_state = capture::SourceState::no_signal;
  capture::SourceInfo source_info;
  std::string notice;
  capture::FaceFinderCounters finder_counters;
  capture::DatagramCounters datagram_counters;
  std::optional<tracker::NeutralFace> neutral;
};

void Live::State::noteSource() {
  const std::lock_guard lock(mutex);
  if (input.images) {
    source = input.images->counters();
    source_state = input.images->state();
    source_info = input.images->info();
    notice = input.images->notice();
  } else {
    datagram_counters = input.datagrams->counters();
    notice = input.datagrams->notice();
  }
}

void Live::State::capture() {
  Captured item;
  std::int64_t first_ns = -1, noted_ns = 0;
  capture::SourceState noted = capture::SourceState::no_signal;
  while (!stopping) {
    const std::int64_t before = monotonicNow();
    const capture::Next next = input.images->next(item.image, kPatience);
    const std::int64_t now = monotonicNow();
    if (now - noted_ns > kReportInterval_ns || input.images->state() != noted || next == capture::Next::ended) {
      noted_ns = now;
      noted = input.images->state();
      noteSource();
    }
    if (next == capture::Next::ended) break;
    if (next == capture::Next::nothing) continue;
    item.arrived_ns = now;
    if (input.live) {
      item.t_shown_ns = item.image.t_capture_ns;
    } else if (options.every_frame) {
      item.t_shown_ns = now;
    } else {  // a file in real time: its own spacing
      if (first_ns < 0) first_ns = now - item.image.t_capture_ns;
      item.t_shown_ns = first_ns + item.image.t_capture_ns;
    }
    capture_meter.add(now - before);
    if (!captured.put(item)) break;
  }
  captured.close();
}

void Live::State::captureDatagrams() {
  Found item;
  std::int64_t noted_ns = 0;
  while (!stopping) {
    const capture::Next next = input.datagrams->next(item.landmarks, kPatience);
    const std::int64_t now = monotonicNow();
    if (now - noted_ns > kReportInterval_ns) {
      noted_ns = now;
      noteSource();
    }
    if (next != capture::Next::frame) continue;
    item.arrived_ns = now;
    item.t_shown_ns = item.landmarks.t_capture_ns;
    capture_meter.add(now - item.t_shown_ns);
    if (!found.put(item)) break;
  }
  noteSource();
  found.close();
}

void Live::State::detect() {
  Captured in;
  Found out;
  for (;;) {
    const auto taken = captured.take(in, kPatience);
    if (taken == Slot<Captured>::Taken::closed) break;
    if (taken == Slot<Captured>::Taken::nothing) continue;
    const std::int64_t before = monotonicNow(), networks_before = input.finder->counters().networks_ns;
    input.finder->push(in.image, out.landmarks);
    out.t_shown_ns = in.t_shown_ns;
    out.arrived_ns = in.arrived_ns;
    if (options.keep_images) std::swap(in.image, out.image);
    const std::int64_t took = monotonicNow() - before;
    detection_meter.add(took);
    out.worked_ns = took - (input.finder->counters().networks_ns - networks_before);
    {
      const std::lock_guard lock(mutex);
      finder_counters = input.finder->counters();
    }
    if (!found.put(out)) break;
  }
  found.close();
}

// The source says nothing (unplugged, nobody sends): subscribers see the face eased to neutral, not a frozen one.
void Live::State::beSilent(Found& item) {
  item.landmarks.face_present = false;
  item.landmarks.points_px.clear();
  item.landmarks.points_camera_mm.clear();
  item.landmarks.point_confidence.clear();
  item.landmarks.confidence = 0;
  item.landmarks.t_capture_ns = item.t_shown_ns = item.arrived_ns = monotonicNow();
  item.worked_ns = 0;
}

void Live::State::calibrate(const LandmarkFrame& landmarks) {
  if (calibrate_wanted.exchange(false)) {
    calibrating = true;
    rest.clear();
  }
  if (!calibrating) return;
  if (landmarks.face_present) rest.push_back(landmarks);
  if (rest.size() < 2) return;
  const double seconds = 1e-9 * static_cast<double>(rest.back().t_capture_ns - rest.front().t_capture_ns);
  if (seconds < options.calibration_s) return;
  calibrating = false;
  path.setNeutral(tracker::neutralFromRest(rest, options.tracking.tracker));
  ++calibrations;
}

void Live::State::track() {
  Found in;
  Sent out;
  std::int64_t last_ns = 0;  // of the tracker's own time
  std::uint64_t last_seq = 0;
  LandmarkLayout last_layout = LandmarkLayout::ibug68;
  std::int64_t noted_ns = 0;
  for (;;) {
    const auto taken = found.take(in, kPatience);
    if (taken == Slot<Found>::Taken::closed) break;
    if (taken == Slot<Found>::Taken::nothing) {
      if (!input.live || last_ns == 0 || monotonicNow() - last_ns < kSilence_ns) continue;
      if (input.images) {
        const std::lock_guard lock(mutex);
        if (source_state == capture::SourceState::streaming) continue;
      }
      beSilent(in);
      in.landmarks.capture_seq = last_seq;
      in.landmarks.layout = last_layout;
    }
    const std::int64_t before = monotonicNow();
    calibrate(in.landmarks);
    if (options.mesh && options.mesh_on_demand) path.setMesh(publisher.wantsMesh());
    path.push(in.landmarks);
    if (input.live) last_ns = before;
    last_seq = in.landmarks.capture_seq;
    last_layout = in.landmarks.layout;
    tracker_meter.add(path.trackedAt() - before);
    retarget_meter.add(path.retargetedAt() - path.trackedAt());
    if (in.worked_ns > 0) in.worked_ns += path.retargetedAt() - before;
    out.t_source_ns = in.landmarks.t_capture_ns;
    publish(in);
    const std::int64_t gone = monotonicNow();
    path.learn();
    learning_meter.add(monotonicNow() - gone);
    if (path.mask().state == TrackingState::tracking) ++faces;
    if (before - noted_ns > kReportInterval_ns) {
      noted_ns = before;
      tracker::NeutralFace known = path.neutral();
      const std::lock_guard lock(mutex);
      if (faces > 0) neutral = std::move(known);
    }
    if (options.look) {
      std::swap(out.landmarks, in.landmarks);
      out.mask = path.mask();
      std::swap(out.avatar, path.avatar());
      if (options.keep_images) std::swap(out.image, in.image);
      if (!sent.put(out)) break;
    }
  }
  if (faces > 0) {
    const std::lock_guard lock(mutex);
    neutral = path.neutral();
  }
  sent.close();
}

// Encodes and sends here, while the mesh is still in this processor's cache and no other thread has to be woken.
void Live::State::publish(Found& item) {
  const std::int64_t before = monotonicNow();
  if (take != nullptr) (void)take->append(item.landmarks, source_name);
  item.landmarks.t_capture_ns = path.mask().t_capture_ns = path.avatar().t_capture_ns = item.t_shown_ns;
  publisher.send(item.landmarks, path.mask(), path.avatar());
  const std::int64_t now = monotonicNow();
  publish_meter.add(now - before);
  if (item.worked_ns > 0) work_meter.add(item.worked_ns + now - before);
  whole_meter.add(now - item.arrived_ns);
  ++frames_sent;
}

// Tells how it goes twice a second, and shows what has been sent to those who look.
void Live::State::show() {
  Sent item;
  std::int64_t next_report = 0;
  for (;;) {
    const auto taken = sent.take(item, kPatience);
    if (taken == Slot<Sent>::Taken::closed) break;
    if (const std::int64_t now = monotonicNow(); now >= next_report) {
      next_report = now + kReportInterval_ns;
      sendReport(protocol::PipelineState::running);
    }
    if (taken == Slot<Sent>::Taken::nothing) continue;
    options.look({input.images ? &item.image : nullptr, item.landmarks, item.mask, item.avatar, item.t_source_ns});
  }
  sendReport(protocol::PipelineState::no_signal);
  const std::lock_guard lock(mutex);
  ended = true;
  end_changed.notify_all();
}

LiveReport Live::State::makeReport() const {
  LiveReport out;
  out.seconds = 1e-9 * static_cast<double>(monotonicNow() - start_ns);
  const auto add = [&](const char* name, const Meter& meter, std::uint64_t dropped, unsigned waiting) {
    StageReport stage = meter.report(name, out.seconds);
    stage.dropped = dropped;
    stage.waiting = waiting;
    out.stages.push_back(std::move(stage));
  };
  const std::lock_guard lock(mutex);
  add("capture", capture_meter, source.dropped + source.sequence_gaps + datagram_counters.dropped, 0);
  if (input.images) add("detection", detection_meter, captured.replaced(), captured.waiting());
  add("tracker", tracker_meter, found.replaced(), found.waiting());
  add("retarget", retarget_meter, 0, 0);
  add("learning", learning_meter, 0, 0);
  add("publish", publish_meter, 0, 0);
  if (input.images) add("all but networks", work_meter, 0, 0);
  add("arrival to sent", whole_meter, 0, 0);
  out.source = source;
  out.source_state = source_state;
  out.source_info = source_info;
  out.notice = notice;
  out.finder = finder_counters;
  out.datagrams = datagram_counters;
  out.frames_sent = frames_sent;
  out.faces = faces;
  out.calibrations = calibrations;
  return out;
}

void Live::State::sendReport(protocol::PipelineState state) {
  const LiveReport now = makeReport();
  protocol::StatusReport report;
  report.state = state;
  if (state == protocol::PipelineState::running && input.images) {
    if (now.source_state == capture::SourceState::no_signal) report.state = protocol::PipelineState::no_signal;
    if (now.source_state == capture::SourceState::stalled) report.state = protocol::PipelineState::stalled;
  }
  report.source = input.name;
  report.frames_in = input.images ? now.source.captured : now.datagrams.frames;
  report.dropped_driver = now.source.sequence_gaps + now.source.dropped + now.datagrams.dropped;
  report.dropped_decode = now.source.corrupt;
  report.reconnects = now.source.reconnects;
  report.bad_messages = now.datagrams.wrong_size + now.datagrams.refused;
  for (const StageReport& stage : now.stages) {
    report.dropped_late += stage.name == "capture" ? 0 : stage.dropped;
    report.stages.push_back({stage.name, stage.count, static_cast<double>(stage.latency.percentile(0.5)) * 1e-3,
                             static_cast<double>(stage.latency.percentile(0.99)) * 1e-3});
  }
  if (take != nullptr) {
    const protocol::TakeWriterCounters written = take->counters();
    report.recording = written.error.empty();
    report.recorded_messages = written.appended;
    report.dropped_recording = written.dropped;
    report.recording_error = written.error;
  }
  publisher.setReport(report);
}

Live::Live(const rig::Rig& rig, LiveInput input, protocol::Publisher& publisher, const LiveOptions& options,
           protocol::TakeWriter* take)
    : state_(std::make_unique<State>(rig, std::move(input), publisher, options, take)) {}

Live::~Live() {
  try {
    stop();
  } catch (...) {  // told by stop() to those who call it
  }
}

void Live::start() {
  State& s = *state_;
  s.start_ns = monotonicNow();
  if (s.input.images) {
    s.run(&State::capture);
    s.run(&State::detect);
  } else {
    s.run(&State::captureDatagrams);
  }
  s.run(&State::track);
  s.run(&State::show);
}

bool Live::waitForEnd(std::chrono::milliseconds timeout) {
  State& s = *state_;
  std::unique_lock lock(s.mutex);
  return s.end_changed.wait_for(lock, timeout, [&] { return s.ended; });
}

void Live::stop() {
  State& s = *state_;
  bool ended = false;
  {
    const std::lock_guard lock(s.mutex);
    ended = s.ended;
  }
  s.stopping = true;
  s.closeAll(!ended);
  for (std::thread& thread : s.threads) thread.join();
  s.threads.clear();
  const std::lock_guard lock(s.mutex);
  if (s.failure) std::rethrow_exception(std::exchange(s.failure, nullptr));
}

void Live::recalibrate() { state_->calibrate_wanted = true; }

std::optional<tracker::NeutralFace> Live::neutral() const {
  const std::lock_guard lock(state_->mutex);
  return state_->neutral;
}

LiveReport Live::report() const { return state_->makeReport(); }

}  // namespace volto::pipeline
