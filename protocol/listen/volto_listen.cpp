// volto-listen: subscribes to a publisher and prints, one line a frame. The example for renderer authors: it links
// protocol alone, and what a renderer would do differently is in onWeights and onMesh.
#include <array>
#include <csignal>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "protocol/clock.h"
#include "protocol/endpoint.h"
#include "protocol/latency_window.h"
#include "protocol/listen/json_text.h"
#include "protocol/subscriber.h"

namespace {

using namespace volto;
using namespace volto::protocol;

volatile std::sig_atomic_t stopped = 0;

struct Options {
  SubscriberOptions subscriber;
  std::string name;
  std::uint64_t count = 0;
  double wait_s = 5;
  bool json = false, mesh = false, summary = false, quiet = false;
};

std::string stateName(TrackingState state) {
  constexpr std::array<const char*, 4> kNames{"no_face", "tracking", "holding", "easing"};
  return kNames[static_cast<std::size_t>(state)];
}

class Listener {
 public:
  explicit Listener(const Options& options) : options_(options), subscriber_(options.subscriber) {}

  // Comes by itself, half a second after subscribing at the latest and every 5 s: names, triangles, neutral.
  void onCharacter(const ReceivedMessage& m) {
    CharacterMessage message;
    if (decode(m.payload, message).ok()) characters_[message.character_id] = std::move(message.character);
  }

  void onWeights(const ReceivedMessage& m) {
    if (!decodeWeights(m.payload, avatar_).ok()) return;
    const AvatarFrame& f = avatar_.frame;
    std::string weights, not_observed;
    for (std::size_t i = 0; i < f.weights.size(); ++i) {
      const std::string name = shapeName(i);
      if (options_.json) {
        weights += (i == 0 ? "" : ",") + jsonText(name) + ":" + number(f.weights[i]);
        if (f.observed[i] == 0) not_observed += (not_observed.empty() ? "" : ",") + jsonText(name);
      } else if (f.weights[i] >= 0.1F) {
        weights += " " + name + " " + number(static_cast<int>(f.weights[i] * 100 + 0.5F) / 100.0);
      }
    }
    if (!options_.json) return print(m, weights);
    const std::array<float, 4> eyes{f.gaze.left.yaw_rad, f.gaze.left.pitch_rad, f.gaze.right.yaw_rad,
                                    f.gaze.right.pitch_rad};
    print(m, ",\"weights\":{" + weights + "},\"not_observed\":[" + not_observed +
                 "],\"gaze\":{\"left_right_yaw_pitch_rad\":" + list(eyes) +
                 ",\"confidence\":" + number(f.gaze.confidence) + "}");
  }

  void onMesh(const ReceivedMessage& m) {
    if (!decodeMesh(m.payload, avatar_).ok()) return;
    if (!options_.json) return print(m, std::to_string(avatar_.frame.vertices.size()) + " vertices");
    std::string vertices;
    for (const auto& v : avatar_.frame.vertices) vertices += (vertices.empty() ? "" : ",") + list(v);
    print(m, ",\"vertices\":[" + vertices + "]");
  }

  int run() {
    ReceivedMessage m;
    std::uint64_t frames = 0;
    LatencyWindow latency;
    std::int64_t t_heard_ns = monotonicNs();
    while (stopped == 0 && (options_.count == 0 || frames < options_.count)) {
      if (!subscriber_.receive(m, 100)) {
        std::fflush(stdout);
        // status/ comes twice a second, so silence means that nobody is there.
        if (options_.wait_s <= 0 || static_cast<double>(monotonicNs() - t_heard_ns) < options_.wait_s * 1e9) continue;
        std::fprintf(stderr,
                     "volto-listen: %s: nobody publishes there (waited %g s); start 'volto run' or 'volto replay'\n",
                     options_.subscriber.endpoint.c_str(), options_.wait_s);
        return 69;
      }
      t_heard_ns = monotonicNs();
      if (m.kind == MessageKind::character) onCharacter(m);
      if (m.kind != MessageKind::weights && m.kind != MessageKind::mesh) continue;
      ++frames;
      latency.add(m.t_receive_ns - m.stamp.t_publish_ns);
      if (options_.quiet) continue;
      m.kind == MessageKind::weights ? onWeights(m) : onMesh(m);
    }
    std::fflush(stdout);
    if (!options_.summary) return 0;
    const SubscriberCounters& c = subscriber_.counters();
    const auto say = [](const char* what, std::uint64_t n) {
      std::fprintf(stderr, "%s %s  ", what, std::to_string(n).c_str());
    };
    say("frames", frames);
    say("lost", c.lost);
    say("superseded", c.superseded);
    say("stale", c.stale);
    say("invalid", c.invalid);
    std::fprintf(stderr, "latency p50 %.3f ms  p99 %.3f ms\n", static_cast<double>(latency.quantileNs(0.5)) / 1e6,
                 static_cast<double>(latency.quantileNs(0.99)) / 1e6);
    return 0;
  }

 private:
  std::string shapeName(std::size_t i) {
    // Too early for the names to have come: ask, and have them at once.
    if (characters_.size() < 100 && characters_.emplace(avatar_.character_id, Character{}).second) {
      for (CharacterMessage& c : subscriber_.requestCharacters({}, 1000))
        characters_[c.character_id] = std::move(c.character);
    }
    const std::vector<std::string>& names = characters_[avatar_.character_id].blendshape_names;
    return i < names.size() ? names[i] : "weight" + std::to_string(i);
  }

  void print(const ReceivedMessage& m, const std::string& rest) const {
    const AvatarFrame& f = avatar_.frame;
    const std::string topic(m.topic), seq = std::to_string(m.stamp.seq);
    if (!options_.json) {
      constexpr double kDegrees = 57.29577951308232;
      std::printf("%s %s %s  yaw %+.1f pitch %+.1f roll %+.1f  %s\n", topic.c_str(), seq.c_str(),
                  stateName(f.state).c_str(), f.head.yaw_rad * kDegrees, f.head.pitch_rad * kDegrees,
                  f.head.roll_rad * kDegrees, rest.c_str());
      return;
    }
    const std::string line =
        "{\"stream\":" + jsonText(topic) + ",\"seq\":" + seq +
        ",\"t_capture_ns\":" + std::to_string(m.stamp.t_capture_ns) +
        ",\"t_publish_ns\":" + std::to_string(m.stamp.t_publish_ns) +
        ",\"t_receive_ns\":" + std::to_string(m.t_receive_ns) +
        ",\"capture_seq\":" + std::to_string(m.stamp.capture_seq) +
        ",\"lost_before\":" + std::to_string(m.lost_before) + ",\"state\":\"" + stateName(f.state) +
        "\",\"confidence\":" + number(f.confidence) + ",\"head\":{\"yaw_rad\":" + number(f.head.yaw_rad) +
        ",\"pitch_rad\":" + number(f.head.pitch_rad) + ",\"roll_rad\":" + number(f.head.roll_rad) +
        ",\"rotation\":" + list(f.head.rotation) + ",\"translation_mm\":" + list(f.head.translation_mm) + "}";
    std::printf("%s%s}\n", line.c_str(), rest.c_str());
  }

  const Options& options_;
  Subscriber subscriber_;
  std::map<std::uint64_t, Character> characters_;
  AvatarMessage avatar_;
};

}  // namespace

int main(int argc, char** argv) {
  Options o;
  o.subscriber.endpoint = kDefaultEndpoint;
  bool newest = false;
  CLI::App app{"Subscribes to a Volto publisher and prints one line a frame."};
  app.add_option("endpoint", o.subscriber.endpoint, "ipc://NAME, ipc:///PATH or tcp://HOST:PORT")
      ->capture_default_str();
  app.add_option("--count", o.count, "stop after so many frames (0: never)");
  app.add_option("--stream", o.name, "only the character of this NAME");
  app.add_flag("--json", o.json, "one JSON object a line");
  app.add_flag("--mesh", o.mesh, "the deformed mesh too");
  app.add_flag("--newest", newest, "as a renderer would: skip to the newest frame, drop what is older than 250 ms");
  app.add_flag("--summary", o.summary,
               "at the end, frames, losses and latency (published to received) on standard error");
  app.add_flag("--quiet", o.quiet, "print no frames");
  app.add_option("--wait", o.wait_s, "give up after so many seconds without a sign of life (0: never)")
      ->capture_default_str();
  app.add_option("--server-key", o.subscriber.curve_server_public_key_file, "the publisher's public key file (CURVE)");
  app.add_option("--key", o.subscriber.curve_key_file, "our own key file (CURVE)");
  app.footer("Exit status: 0 done, 2 wrong usage, 69 nobody publishes there, 78 bad key file.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  const std::string name = o.name.empty() ? "" : o.name + "/";
  o.subscriber.topics = {"weights/" + name, "character/" + name, "status/"};
  if (o.mesh) o.subscriber.topics.push_back("mesh/" + name);
  o.subscriber.newest_only = newest;
  o.subscriber.max_age_ms = newest ? 250 : 0;
  o.subscriber.receive_high_water_mark = newest ? 4 : 64;
  try {
    return Listener(o).run();
  } catch (const SetupError& e) {
    std::fprintf(stderr, "volto-listen: %s\n", e.what());
    return e.exitStatus();
  }
}
