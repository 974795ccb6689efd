// volto-listen: subscribes to a publisher and prints, one line a frame. The example for renderer authors: it links
// protocol alone, and all that a renderer would do differently is in onWeights and onMesh.
#include <array>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <map>
#include <string>

#include <CLI/CLI.hpp>

#include "protocol/clock.h"
#include "protocol/endpoint.h"
#include "protocol/latency_window.h"
#include "protocol/subscriber.h"

namespace {

using namespace volto;
using namespace volto::protocol;

volatile std::sig_atomic_t stopped = 0;

struct Options {
  std::string endpoint = std::string(kDefaultEndpoint);
  std::string name;
  std::uint64_t count = 0;
  double wait_s = 5;
  bool json = false, mesh = false, newest = false, summary = false, quiet = false;
  std::string server_key_file, key_file;
};

// A JSON string; names come from the publisher and may hold anything.
std::string jsonText(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

const char* stateName(TrackingState state) {
  constexpr std::array<const char*, 4> kNames{"no_face", "tracking", "holding", "easing"};
  return kNames[static_cast<std::size_t>(state)];
}

class Listener {
 public:
  explicit Listener(bool json) : json_(json) {}

  // Comes by itself within half a second of subscribing, and every 5 s: names, triangles, neutral.
  void onCharacter(const ReceivedMessage& m) {
    CharacterMessage message;
    if (decode(m.payload, message).ok()) characters_[message.character_id] = std::move(message.character);
  }

  void onWeights(const ReceivedMessage& m) {
    if (!decodeWeights(m.payload, avatar_).ok()) return;
    const AvatarFrame& f = avatar_.frame;
    begin(m);
    if (!json_) {
      constexpr double kDegrees = 57.29577951308232;
      std::printf("  yaw %+5.1f pitch %+5.1f roll %+5.1f ", f.head.yaw_rad * kDegrees, f.head.pitch_rad * kDegrees,
                  f.head.roll_rad * kDegrees);
      for (std::size_t i = 0; i < f.weights.size(); ++i) {
        if (f.weights[i] >= 0.1F) std::printf(" %s %.2f", shapeName(i).c_str(), f.weights[i]);
      }
      std::printf("\n");
      return;
    }
    std::printf(",\"weights\":{");
    for (std::size_t i = 0; i < f.weights.size(); ++i) {
      std::printf("%s%s:%.7g", i == 0 ? "" : ",", jsonText(shapeName(i)).c_str(), f.weights[i]);
    }
    std::string not_observed;
    for (std::size_t i = 0; i < f.weights.size(); ++i) {
      if (f.observed[i] == 0) not_observed += (not_observed.empty() ? "" : ",") + jsonText(shapeName(i));
    }
    std::printf(
        "},\"not_observed\":[%s],\"gaze\":{\"left_yaw_rad\":%.7g,\"left_pitch_rad\":%.7g,\"right_yaw_rad\":%.7g,",
        not_observed.c_str(), f.gaze.left.yaw_rad, f.gaze.left.pitch_rad, f.gaze.right.yaw_rad);
    std::printf("\"right_pitch_rad\":%.7g,\"confidence\":%.6g}}\n", f.gaze.right.pitch_rad, f.gaze.confidence);
  }

  void onMesh(const ReceivedMessage& m) {
    if (!decodeMesh(m.payload, avatar_).ok()) return;
    const auto& vertices = avatar_.frame.vertices;
    begin(m);
    if (!json_) {
      std::printf("  %zu vertices\n", vertices.size());
      return;
    }
    std::printf(",\"vertices\":[");
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      std::printf("%s[%.7g,%.7g,%.7g]", i == 0 ? "" : ",", vertices[i][0], vertices[i][1], vertices[i][2]);
    }
    std::printf("]}\n");
  }

 private:
  // The name of the shape, once the character is known.
  std::string shapeName(std::size_t i) const {
    const auto c = characters_.find(avatar_.character_id);
    if (c != characters_.end() && i < c->second.blendshape_names.size()) return c->second.blendshape_names[i];
    return "weight" + std::to_string(i);
  }

  void begin(const ReceivedMessage& m) const {
    const AvatarFrame& f = avatar_.frame;
    const std::string topic(m.topic);
    if (!json_) {
      std::printf("%s %" PRIu64 "  %s", topic.c_str(), m.stamp.seq, stateName(f.state));
      return;
    }
    std::printf("{\"stream\":%s,\"epoch\":\"%016" PRIx64 "\",\"seq\":%" PRIu64 ",\"capture_seq\":%" PRIu64
                ",\"lost_before\":%" PRIu64,
                jsonText(topic).c_str(), m.stamp.epoch, m.stamp.seq, m.stamp.capture_seq, m.lost_before);
    std::printf(",\"t_capture_ns\":%" PRId64 ",\"t_publish_ns\":%" PRId64 ",\"t_receive_ns\":%" PRId64,
                m.stamp.t_capture_ns, m.stamp.t_publish_ns, m.t_receive_ns);
    std::printf(",\"character_id\":\"%016" PRIx64 "\",\"state\":\"%s\",\"confidence\":%.6g", avatar_.character_id,
                stateName(f.state), f.confidence);
    const auto& q = f.head.rotation;
    const auto& t = f.head.translation_mm;
    std::printf(",\"head\":{\"yaw_rad\":%.7g,\"pitch_rad\":%.7g,\"roll_rad\":%.7g,\"rotation\":[%.7g,%.7g,%.7g,%.7g],",
                f.head.yaw_rad, f.head.pitch_rad, f.head.roll_rad, q[0], q[1], q[2], q[3]);
    std::printf("\"translation_mm\":[%.7g,%.7g,%.7g],\"observed\":%s}", t[0], t[1], t[2],
                f.head.observed ? "true" : "false");
  }

  bool json_;
  std::map<std::uint64_t, Character> characters_;
  AvatarMessage avatar_;
};

int listen(const Options& o) {
  SubscriberOptions how;
  how.endpoint = o.endpoint;
  how.newest_only = o.newest;
  how.max_age_ms = o.newest ? 250 : 0;
  how.receive_high_water_mark = o.newest ? 4 : 64;
  how.curve_server_public_key_file = o.server_key_file;
  how.curve_key_file = o.key_file;
  const std::string name = o.name.empty() ? "" : o.name + "/";
  how.topics = {"weights/" + name, "character/" + name, "status/"};
  if (o.mesh) how.topics.push_back("mesh/" + name);
  Subscriber subscriber(how);
  Listener listener(o.json);
  LatencyWindow latency;
  ReceivedMessage m;
  std::uint64_t frames = 0;
  std::int64_t t_heard_ns = monotonicNs();
  while (stopped == 0 && (o.count == 0 || frames < o.count)) {
    if (!subscriber.receive(m, 100)) {
      std::fflush(stdout);
      // status/ comes twice a second, so silence means that nobody is there.
      if (o.wait_s <= 0 || static_cast<double>(monotonicNs() - t_heard_ns) < o.wait_s * 1e9) continue;
      std::fprintf(
          stderr,
          "volto-listen: %s: nobody publishes there (waited %g s): start 'volto run' or 'volto replay', or --wait 0\n",
          o.endpoint.c_str(), o.wait_s);
      return 69;
    }
    t_heard_ns = monotonicNs();
    if (m.kind == MessageKind::character) listener.onCharacter(m);
    if (m.kind != MessageKind::weights && m.kind != MessageKind::mesh) continue;
    ++frames;
    latency.add(m.t_receive_ns - m.stamp.t_publish_ns);
    if (o.quiet) continue;
    m.kind == MessageKind::weights ? listener.onWeights(m) : listener.onMesh(m);
  }
  std::fflush(stdout);
  const SubscriberCounters& c = subscriber.counters();
  if (o.summary) {
    std::fprintf(stderr,
                 "frames %" PRIu64 "  lost %" PRIu64 "  superseded %" PRIu64 "  stale %" PRIu64 "  invalid %" PRIu64,
                 frames, c.lost, c.superseded, c.stale, c.invalid);
    std::fprintf(stderr, "  latency p50 %.3f ms  p99 %.3f ms (published to received, last %zu frames)\n",
                 static_cast<double>(latency.quantileNs(0.5)) / 1e6,
                 static_cast<double>(latency.quantileNs(0.99)) / 1e6,
                 static_cast<std::size_t>(std::min<std::uint64_t>(latency.count(), LatencyWindow::kSize)));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app{"Subscribes to a Volto publisher and prints one line a frame."};
  app.add_option("endpoint", o.endpoint, "ipc://NAME, ipc:///PATH or tcp://HOST:PORT")->capture_default_str();
  app.add_option("--count", o.count, "stop after so many frames (0: never)");
  app.add_option("--stream", o.name, "only the character of this NAME");
  app.add_flag("--json", o.json, "one JSON object a line");
  app.add_flag("--mesh", o.mesh, "the deformed mesh too");
  app.add_flag("--newest", o.newest, "as a renderer would: skip to the newest frame, drop what is older than 250 ms");
  app.add_flag("--summary", o.summary, "at the end, frames, losses and latency on standard error");
  app.add_flag("--quiet", o.quiet, "print no frames");
  app.add_option("--wait", o.wait_s, "give up after so many seconds without a sign of life (0: never)")
      ->capture_default_str();
  app.add_option("--server-key", o.server_key_file, "the publisher's public key file (CURVE)");
  app.add_option("--key", o.key_file, "our own key file (CURVE)");
  app.footer("Exit status: 0 done, 2 wrong usage, 69 nobody publishes there, 78 bad key file.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  try {
    return listen(o);
  } catch (const SetupError& e) {
    std::fprintf(stderr, "volto-listen: %s\n", e.what());
    return e.exitStatus();
  }
}
