// The whole way of a frame: landmarks, tracker, retarget, encoded message, sent; and how fast a take replays with the
// mesh published.
#include <atomic>
#include <string>
#include <thread>
#include <unistd.h>

#include <benchmark/benchmark.h>

#include "protocol/publisher.h"
#include "protocol/subscriber.h"
#include "retarget/retargeter.h"
#include "tests/bench/pipeline_cost.h"
#include "tests/bench/report.h"
#include "tests/bench/scene.h"
#include "tracker/tracker.h"

namespace volto::bench {
namespace {

constexpr std::size_t kFrames = 1200;
constexpr double kPaceUs = 2000.0;

protocol::Character characterOf(const rig::Rig& rig) {
  protocol::Character character;
  character.name = "bench";
  for (const rig::Blendshape& shape : rig.blendshapes) character.blendshape_names.push_back(shape.name);
  character.neutral = neutralVertices(rig);
  character.triangles = rig::triangulate(rig.neutral);
  character.has_mesh = true;
  return character;
}

// Somebody who subscribes to everything and counts.
class Listener {
 public:
  explicit Listener(std::string endpoint)
      : thread_([this, endpoint = std::move(endpoint)](const std::stop_token& stop) {
          protocol::SubscriberOptions options;
          options.endpoint = endpoint;
          options.receive_high_water_mark = 100;
          protocol::Subscriber subscriber(options);
          protocol::ReceivedMessage message;
          while (!stop.stop_requested()) {
            if (subscriber.receive(message, 50) && message.kind == protocol::MessageKind::mesh) ++meshes_;
          }
        }) {}
  std::uint64_t meshes() const { return meshes_; }

 private:
  std::atomic<std::uint64_t> meshes_{0};
  std::jthread thread_;
};

// Tracker, retarget and publisher with one subscriber in a thread of its own.
struct Pipeline {
  std::vector<LandmarkFrame> landmarks = performanceLandmarks(kFrames);
  tracker::Tracker tracker;
  retarget::Retargeter retargeter{benchRig().rig};
  protocol::Publisher publisher;
  std::size_t character;
  Listener listener;
  MaskFrame mask;
  AvatarFrame avatar;

  explicit Pipeline(protocol::WhenFull when_full)
      : publisher(optionsFor(when_full)),
        character(publisher.setCharacter(characterOf(benchRig().rig))),
        listener(publisher.endpoint()) {
    publisher.waitForSubscriber(protocol::MessageKind::mesh, 5000);
  }

  static protocol::PublisherOptions optionsFor(protocol::WhenFull when_full) {
    protocol::PublisherOptions options;
    options.endpoint = "ipc:///tmp/volto-bench-" + std::to_string(getpid());
    options.when_full = when_full;
    return options;
  }

  void compute(std::size_t frame) {
    tracker.push(landmarks[frame], mask);
    retargeter.push(mask, avatar);
  }
};

void landmarksToSent(benchmark::State& state) {
  Pipeline pipeline(protocol::WhenFull::wait);
  Samples tracker_us, retarget_us, encode_us, all_us, sent_us;
  std::size_t i = 0;
  auto next = std::chrono::steady_clock::now();
  for (auto _ : state) {
    // Paced, and awake while waiting: the machine's sleep is not what is measured.
    next += std::chrono::microseconds(static_cast<int>(kPaceUs));
    while (std::chrono::steady_clock::now() < next) {
    }
    const std::size_t frame = i++ % kFrames;
    const double t = timeUs([&] { pipeline.tracker.push(pipeline.landmarks[frame], pipeline.mask); });
    const double r = timeUs([&] { pipeline.retargeter.push(pipeline.mask, pipeline.avatar); });
    const double e = timeUs([&] { pipeline.publisher.push(pipeline.avatar, pipeline.character); });
    const double s = timeUs([&] { pipeline.publisher.flush(); });
    tracker_us.add(t);
    retarget_us.add(r);
    encode_us.add(e);
    all_us.add(t + r + e);
    sent_us.add(t + r + e + s);
    state.SetIterationTime(1e-6 * (t + r + e + s));
  }
  state.counters["tracker_us"] = tracker_us.median();
  state.counters["retarget_us"] = retarget_us.median();
  state.counters["encode_us"] = encode_us.median();
  state.counters["sent_us_p50"] = sent_us.median();
  state.counters["sent_us_p99"] = sent_us.quantile(0.99);
  setPipelineCostUs(all_us.median());
  const auto both = [](const Samples& s) {
    return microseconds(s.median()) + " p50, " + microseconds(s.quantile(0.99)) + " p99";
  };
  const std::string head = benchRig().name + " with mesh";
  report("landmarks to sent message, " + head, both(sent_us), "", "1 ms p50, 3 ms p99");
  report("... of it the tracker", both(tracker_us));
  report("... of it retarget (weights and mesh)", both(retarget_us));
  report("... of it encoding", both(encode_us));
}

void replay(benchmark::State& state) {
  Pipeline pipeline(protocol::WhenFull::wait);
  std::uint64_t frames = 0;
  const auto start = std::chrono::steady_clock::now();
  for (auto _ : state) {
    for (std::size_t frame = 0; frame < kFrames; ++frame) {
      pipeline.compute(frame);
      pipeline.publisher.push(pipeline.avatar, pipeline.character);
    }
    pipeline.publisher.flush();
    frames += kFrames;
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const double rate = static_cast<double>(frames) / seconds;
  state.counters["frames_per_s"] = rate;
  state.counters["meshes_received"] = static_cast<double>(pipeline.listener.meshes());
  report("replay as fast as it goes, " + benchRig().name + ", mesh published",
         std::to_string(static_cast<int>(rate)) + " frames a second",
         "a subscriber received " + std::to_string(100 * pipeline.listener.meshes() / frames) + " % of the meshes",
         "2000");
}

BENCHMARK(landmarksToSent)->Iterations(static_cast<benchmark::IterationCount>(kFrames))->UseManualTime();
BENCHMARK(replay)->Iterations(3)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

namespace {
double g_cost_us = 0.0;
}

void setPipelineCostUs(double us) { g_cost_us = us; }
double pipelineCostUs() { return g_cost_us; }

}  // namespace volto::bench
