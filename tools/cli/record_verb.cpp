// volto record: what an endpoint publishes, unchanged, into a take.
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "protocol/endpoint.h"
#include "protocol/subscriber.h"
#include "protocol/take_writer.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/progress.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/verb.h"
#include "tools/pipeline/pacer.h"
#include "tracker/landmark_layout.h"

namespace volto::cli {

namespace {

struct Options {
  std::string endpoint;
  std::string output;
  std::vector<std::string> topics;
  double seconds = 0;
  bool force = false;
};

// The take's header says which landmarks are in it, so the file is opened when the first of them is there, or after a
// moment without.
class Recorder {
 public:
  explicit Recorder(const Options& options) : options_(options) {}

  void push(const protocol::ReceivedMessage& message) {
    if (writer_) {
      append(message.topic, message.stamp, message.payload);
      return;
    }
    if (early_.empty()) first_at_ns_ = message.t_receive_ns;
    early_.push_back({std::string(message.topic), message.stamp, {message.payload.begin(), message.payload.end()}});
    std::string layout;
    if (message.kind == protocol::MessageKind::landmarks) {
      protocol::LandmarkMessage landmarks;
      if (protocol::decode(message.payload, landmarks)) layout = tracker::layoutName(landmarks.frame.layout);
    } else if (message.t_receive_ns - first_at_ns_ < kWaitForLandmarks_ns) {
      return;
    }
    open(layout);
  }

  // True when there is nothing more to record to: the disk is full.
  bool failed() const { return writer_ && !writer_->counters().error.empty(); }
  bool anything() const { return writer_ || !early_.empty(); }

  protocol::TakeWriterCounters finish() {
    if (!writer_) open("");
    const protocol::Result result = writer_->finish();
    if (!result) throw CommandError(kFailed, result.problem + "; what was recorded before is kept");
    return writer_->counters();
  }

 private:
  static constexpr std::int64_t kWaitForLandmarks_ns = 250'000'000;

  struct Early {
    std::string topic;
    protocol::Stamp stamp;
    std::vector<std::byte> payload;
  };

  void open(const std::string& layout) {
    protocol::TakeHeader header;
    header.name = std::filesystem::path(options_.output).stem().string();
    header.source = options_.endpoint;
    header.layout = layout;
    header.program = "volto " VOLTO_VERSION;
    writer_.emplace(options_.output, header, protocol::TakeWriterOptions{.force = options_.force});
    for (const Early& early : early_) append(early.topic, early.stamp, early.payload);
    early_.clear();
    early_.shrink_to_fit();
  }

  void append(std::string_view topic, const protocol::Stamp& stamp, protocol::Bytes payload) {
    (void)writer_->appendChecked(topic, stamp, payload);  // what is dropped is counted and told at the end
  }

  const Options& options_;
  std::optional<protocol::TakeWriter> writer_;
  std::vector<Early> early_;
  std::int64_t first_at_ns_ = 0;
};

int run(const Options& options) {
  protocol::parseEndpoint(options.endpoint);
  requireReplaceable(options.output);
  std::error_code ignored;
  if (!options.force && std::filesystem::exists(options.output, ignored)) {
    throw CommandError(kFailed, options.output + ": exists already; give --force to replace it, or another name");
  }

  protocol::SubscriberOptions subscriber_options;
  subscriber_options.endpoint = options.endpoint;
  subscriber_options.topics = options.topics;
  subscriber_options.receive_high_water_mark = 4096;  // a recorder would rather be late than lose a frame
  protocol::Subscriber subscriber(subscriber_options);

  Recorder recorder(options);
  Progress progress("recording message", 0);
  const std::int64_t end_ns = pipeline::monotonicNow() + static_cast<std::int64_t>(options.seconds * 1e9);
  protocol::ReceivedMessage message;
  std::uint64_t received = 0;
  while (!stopRequested() && !recorder.failed() && (options.seconds <= 0 || pipeline::monotonicNow() < end_ns)) {
    constexpr int kWait_ms = 100;
    if (!subscriber.receive(message, kWait_ms)) continue;
    recorder.push(message);
    progress.show(++received);
  }
  const protocol::SubscriberCounters& counters = subscriber.counters();
  if (!recorder.anything() && counters.invalid > 0) {
    throw CommandError(kUnavailable, options.endpoint + ": all of its " + std::to_string(counters.invalid) +
                                         " messages were refused and no take written: " + subscriber.lastProblem() +
                                         "; is it a Volto publisher of this version?");
  }
  if (!recorder.anything()) {
    throw CommandError(kUnavailable,
                       options.endpoint + ": nothing was received and no take written; is a publisher running there?");
  }
  const protocol::TakeWriterCounters written = recorder.finish();
  if (counters.invalid > 0) {
    std::fprintf(stderr, "volto record: warning: %llu messages refused, the last because: %s\n",
                 static_cast<unsigned long long>(counters.invalid), subscriber.lastProblem().c_str());
  }
  std::printf("%llu messages recorded to %s; %llu lost on the way, %llu dropped while writing\n",
              static_cast<unsigned long long>(written.committed), options.output.c_str(),
              static_cast<unsigned long long>(counters.lost), static_cast<unsigned long long>(written.dropped));
  return kDone;
}

}  // namespace

RunVerb defineRecord(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("endpoint", options->endpoint,
                 "where a publisher is or will be: ipc://NAME, ipc:///path or tcp://HOST:PORT")
      ->required()
      ->type_name("ENDPOINT");
  app.add_option("-o,--output", options->output, "the take to write")->required()->type_name("T.take");
  app.add_option("--topics", options->topics,
                 "beginnings of topics, for example landmarks/ weights/anna/ (default: everything)")
      ->type_name("TOPIC")
      ->delimiter(',');
  app.add_option("--seconds", options->seconds, "stop after so long (default: when told to by SIGTERM or SIGINT)")
      ->type_name("N")
      ->check(CLI::Range(0.0, 1e6));
  app.add_flag("--force", options->force, "replace a take that exists");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
