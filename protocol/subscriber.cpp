#include "protocol/subscriber.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <poll.h>

#include "protocol/clock.h"
#include "protocol/sockets.h"

namespace volto::protocol {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr int kSlowHighWaterMark = 8;     // character/ and status/
constexpr std::size_t kMaxStreams = 256;  // distinct topics whose sequence we follow
constexpr std::size_t kEpochsRemembered = 8;
constexpr std::int64_t kReconnectMinNs = 100 * kMs, kReconnectMaxNs = 2000 * kMs;

bool isSlow(MessageKind kind) { return kind == MessageKind::character || kind == MessageKind::status; }

// A message at an aligned address: where ZeroMQ put it, or copied if that address is odd (small messages; large ones
// lie well).
struct Held {
  std::string topic;
  Message message;
  std::vector<std::uint64_t> copy;
  Bytes payload;
  MessageKind kind = MessageKind::status;
  Stamp stamp;
  std::uint64_t lost_before = 0;
  bool new_epoch = false;
  std::int64_t t_receive_ns = 0;

  void assign(Message&& received) {
    message = std::move(received);
    payload = Bytes(reinterpret_cast<const std::byte*>(message.data()), message.size());
    if (reinterpret_cast<std::uintptr_t>(payload.data()) % alignof(std::uint64_t) == 0) return;
    copy.resize((payload.size() + 7) / 8);
    std::memcpy(copy.data(), payload.data(), payload.size());
    payload = Bytes(reinterpret_cast<const std::byte*>(copy.data()), payload.size());
  }
};

struct Following {
  std::uint64_t epoch = 0;
  std::uint64_t seq = 0;
};

// A SUB socket that is made anew when ZeroMQ gives it up: after a message beyond MAXMSGSIZE it would never connect
// again.
struct Connection {
  Socket socket, monitor;
  int high_water_mark = 0;
  std::vector<std::string> prefixes;
  bool connected = false;
  bool lost = false;
  std::int64_t t_retry_ns = 0;
  std::int64_t backoff_ns = kReconnectMinNs;
};

}  // namespace

struct Subscriber::State {
  explicit State(const SubscriberOptions& how)
      : options(how),
        endpoint(parseEndpoint(options.endpoint.empty() ? std::string(kDefaultEndpoint) : options.endpoint)) {
    if (endpoint.transport == Endpoint::Transport::tcp && endpoint.port == 0) {
      throw SetupError(SetupError::Kind::usage, endpoint.address() + ": a subscriber must know the port");
    }
    const bool has_server = !options.curve_server_public_key_file.empty();
    if (has_server != !options.curve_key_file.empty()) {
      throw SetupError(SetupError::Kind::usage,
                       "CURVE wants the publisher's public key file and a key file of our own");
    }
    if (!endpoint.loopback && !has_server) {
      throw SetupError(SetupError::Kind::usage, endpoint.address() + ": is on another machine; that wants CURVE keys");
    }
    if (has_server) {
      server_key = readCurvePublicKey(options.curve_server_public_key_file);
      keys = readCurveKeys(options.curve_key_file);
    }
    splitPrefixes();
    for (Connection& c : connections) {
      if (!c.prefixes.empty()) open(c);
    }
  }

  // Frames on the first connection, what comes now and then on the second.
  void splitPrefixes() {
    frames().high_water_mark = options.receive_high_water_mark;
    slow().high_water_mark = kSlowHighWaterMark;
    const std::vector<std::string> wanted = options.topics.empty() ? std::vector<std::string>{""} : options.topics;
    for (std::size_t i = 0; i < kMessageKindCount; ++i) {
      const auto kind = static_cast<MessageKind>(i);
      const std::string_view level = topicPrefix(kind);
      std::vector<std::string>& prefixes = (isSlow(kind) ? slow() : frames()).prefixes;
      for (const std::string& prefix : wanted) {
        if (prefix.size() > kMaxTopicBytes)
          throw SetupError(SetupError::Kind::usage, "a topic of " + std::to_string(prefix.size()) + " bytes");
        if (level.starts_with(prefix)) {
          prefixes.emplace_back(level);
          break;
        }
        if (prefix.starts_with(level)) prefixes.push_back(prefix);
      }
    }
    if (frames().prefixes.empty() && slow().prefixes.empty()) {
      throw SetupError(SetupError::Kind::usage,
                       "'" + wanted.front() +
                           "' is no topic; topics begin with weights/, mesh/, mask/, landmarks/, "
                           "character/ or status/");
    }
  }

  void open(Connection& c) {
    c.monitor = Socket();
    c.socket = Socket(context, ZMQ_SUB);
    prepare(c.socket);
    c.socket.set(ZMQ_RCVHWM, c.high_water_mark);
    for (const std::string& prefix : c.prefixes) c.socket.set(ZMQ_SUBSCRIBE, std::string_view(prefix));
    c.monitor = Socket::monitorOf(context, c.socket, "inproc://monitor-" + std::to_string(sockets_opened++),
                                  ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED);
    connectSocket(c.socket, endpoint);
    c.connected = c.lost = false;
  }

  void prepare(Socket& socket) const {
    setCommonOptions(socket, endpoint);
    socket.set(ZMQ_MAXMSGSIZE, static_cast<std::int64_t>(kMaxInboundBytes));
    if (!keys) return;
    socket.set(ZMQ_CURVE_SERVERKEY, std::string_view(server_key));
    socket.set(ZMQ_CURVE_PUBLICKEY, std::string_view(keys->public_key));
    socket.set(ZMQ_CURVE_SECRETKEY, std::string_view(keys->secret_key));
  }

  Connection& frames() { return connections[0]; }
  Connection& slow() { return connections[1]; }

  // ---- receiving
  // -------------------------------------------------------------------------------------------------------------------

  bool receive(ReceivedMessage& out, int timeout_ms) {
    const std::int64_t deadline = monotonicNs() + std::max(timeout_ms, 0) * kMs;
    while (true) {
      if (takeNext()) {
        deliver(out);
        return true;
      }
      watch();
      const std::int64_t now = monotonicNs();
      if (now >= deadline) return false;
      // Awake at least ten times a second, to make a lost connection anew.
      const auto wait_ms = static_cast<int>(std::min<std::int64_t>((deadline - now) / kMs + 1, 100));
      // All sockets have just been read until nothing was left, so their descriptors tell of anything new. zmq_poll
      // would ask twice.
      std::array<pollfd, 2> waiting_for{};
      nfds_t used = 0;
      for (const Connection& c : connections) {
        if (c.socket.get() != nullptr) waiting_for[used++] = {c.socket.fd(), POLLIN, 0};
      }
      if (::poll(waiting_for.data(), used, wait_ms) < 0 && errno == EINTR) return false;
    }
  }

  // Puts the next message to hand out into `held`.
  bool takeNext() {
    if (options.newest_only) {
      drain();
      if (order.empty()) return false;
      held = std::move(waiting[order.front()]);
      waiting.erase(order.front());
      order.pop_front();
      return true;
    }
    // What comes now and then goes first: a weights/ message is of use only to who knows the names.
    while (read(slow()) || read(frames())) {
      if (admitted) return true;
    }
    return false;
  }

  // All that has arrived, of each topic the newest.
  void drain() {
    while (read(slow()) || read(frames())) {
      if (!admitted) continue;
      const auto before = waiting.find(held.topic);
      if (before == waiting.end()) {
        order.push_back(held.topic);
        waiting.emplace(held.topic, std::move(held));
      } else {
        ++counters.superseded;
        held.lost_before += before->second.lost_before;
        held.new_epoch = held.new_epoch || before->second.new_epoch;
        std::swap(before->second, held);
      }
    }
  }

  // One message off the wire, whatever it is; `admitted` says whether it is one to hand out, which is then in `held`.
  bool read(Connection& c) {
    admitted = false;
    if (c.socket.get() == nullptr) return false;
    Message topic, payload, rest;
    if (!topic.receive(c.socket)) return false;
    int parts = 1;
    bool more = topic.more();
    if (more && payload.receive(c.socket)) {
      ++parts;
      more = payload.more();
    }
    while (more && rest.receive(c.socket)) {
      ++parts;
      more = rest.more();
    }
    c.backoff_ns = kReconnectMinNs;
    if (parts != 2) {
      reject(std::to_string(parts) + " frames instead of topic and payload");
      return true;
    }
    admit(topic.text(), std::move(payload));
    return true;
  }

  void reject(std::string problem) {
    ++counters.invalid;
    last_problem = std::move(problem);
  }

  void admit(std::string_view topic_text, Message&& payload) {
    const std::optional<Topic> topic = parseTopic(topic_text);
    if (!topic) return reject("unknown topic");
    held.assign(std::move(payload));
    if (Result r = inspector.check(held.payload, held.stamp); !r.ok()) return reject(r.problem);
    if (messageKind(held.payload) != topic->kind) return reject("the message is not of its topic's kind");
    held.topic.assign(topic_text);
    held.kind = topic->kind;
    held.t_receive_ns = monotonicNs();
    ++counters.received;
    if (!follow()) return;
    if (isStale()) {
      ++counters.stale;
      return;
    }
    admitted = true;
  }

  // Sequence and epoch. False: out of order.
  bool follow() {
    held.new_epoch = false;
    held.lost_before = 0;
    if (epochs.empty() || epochs.back() != held.stamp.epoch) {
      if (std::find(epochs.begin(), epochs.end(), held.stamp.epoch) != epochs.end()) {
        ++counters.out_of_order;
        return false;
      }
      if (epochs.size() == kEpochsRemembered) epochs.pop_front();
      epochs.push_back(held.stamp.epoch);
      ++counters.epochs;
      held.new_epoch = counters.epochs > 1;
      following.clear();
      least_age_ns.reset();
    }
    const auto known = following.find(held.topic);
    if (known == following.end()) {
      if (following.size() < kMaxStreams) following.emplace(held.topic, Following{held.stamp.epoch, held.stamp.seq});
      return true;
    }
    Following& f = known->second;
    if (held.stamp.seq <= f.seq) {
      ++counters.out_of_order;
      return false;
    }
    held.lost_before = held.stamp.seq - f.seq - 1;
    counters.lost += held.lost_before;
    f.seq = held.stamp.seq;
    return true;
  }

  bool isStale() {
    if (options.max_age_ms <= 0 || isSlow(held.kind)) return false;
    std::int64_t age_ns = held.t_receive_ns - held.stamp.t_publish_ns;
    if (!endpoint.loopback) {
      least_age_ns = std::min(least_age_ns.value_or(age_ns), age_ns);
      age_ns -= *least_age_ns;
    }
    return age_ns > options.max_age_ms * kMs;
  }

  void deliver(ReceivedMessage& out) {
    ++counters.delivered;
    out.topic = held.topic;
    out.kind = held.kind;
    out.name = parseTopic(held.topic)->name;
    out.payload = held.payload;
    out.stamp = held.stamp;
    out.lost_before = held.lost_before;
    out.new_epoch = held.new_epoch;
    out.t_receive_ns = held.t_receive_ns;
  }

  void watch() {
    const std::int64_t now = monotonicNs();
    for (Connection& c : connections) {
      if (c.socket.get() == nullptr) continue;
      while (const std::optional<MonitorEvent> event = nextEvent(c.monitor)) {
        if (event->event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
          c.connected = true;
          c.lost = false;
        }
        if (event->event == ZMQ_EVENT_DISCONNECTED) {
          c.connected = false;
          c.lost = true;
          c.t_retry_ns = now + c.backoff_ns;
        }
      }
      // ZeroMQ reconnects by itself after most ends, but not after all; a fresh socket always does.
      if (!c.lost || now < c.t_retry_ns) continue;
      c.backoff_ns = std::min(c.backoff_ns * 2, kReconnectMaxNs);
      ++counters.reconnects;
      open(c);
    }
  }

  // ---- asking for characters
  // ---------------------------------------------------------------------------------------------------------

  std::vector<CharacterMessage> request(std::string_view name, int timeout_ms) {
    const std::string prefix =
        name.empty() ? std::string(topicPrefix(MessageKind::character)) : makeTopic(MessageKind::character, name);
    const std::int64_t deadline = monotonicNs() + timeout_ms * kMs;
    std::int64_t patience = 250 * kMs;
    while (monotonicNs() < deadline) {
      // A fresh socket for each try: an answer that comes late is not taken for one to the next question.
      Socket socket(context, ZMQ_DEALER);
      prepare(socket);
      connectSocket(socket, endpoint.snapshot());
      socket.set(ZMQ_RCVTIMEO, static_cast<int>(std::clamp<std::int64_t>(
                                   std::min(patience, deadline - monotonicNs()) / kMs, 1, 2000)));
      Message(prefix).send(socket, ZMQ_DONTWAIT);
      if (std::vector<CharacterMessage> found = readAnswer(socket); !found.empty()) return found;
      patience = std::min<std::int64_t>(patience * 2, 2000 * kMs);
    }
    return {};
  }

  std::vector<CharacterMessage> readAnswer(const Socket& socket) {
    std::vector<CharacterMessage> found;
    Message topic;
    while (topic.receive(socket, 0) && topic.more()) {
      Message payload;
      if (!payload.receive(socket, 0)) break;
      const std::string_view text = payload.text();
      CharacterMessage message;
      if (const Result r = decode(Bytes(reinterpret_cast<const std::byte*>(text.data()), text.size()), message);
          r.ok()) {
        found.push_back(std::move(message));
      } else {
        reject(r.problem);
      }
      if (!payload.more()) break;
    }
    return found;
  }

  SubscriberOptions options;
  Endpoint endpoint;
  std::string server_key;
  std::optional<CurveKeys> keys;
  Context context;
  std::array<Connection, 2> connections;
  int sockets_opened = 0;

  Held held;
  bool admitted = false;
  std::map<std::string, Held> waiting;
  std::deque<std::string> order;

  Inspector inspector;
  std::map<std::string, Following> following;
  std::deque<std::uint64_t> epochs;
  std::optional<std::int64_t> least_age_ns;
  SubscriberCounters counters;
  std::string last_problem;
};

Subscriber::Subscriber(const SubscriberOptions& options) : state_(std::make_unique<State>(options)) {}
Subscriber::~Subscriber() = default;

bool Subscriber::receive(ReceivedMessage& out, int timeout_ms) { return state_->receive(out, timeout_ms); }

std::vector<CharacterMessage> Subscriber::requestCharacters(std::string_view name, int timeout_ms) {
  return state_->request(name, timeout_ms);
}

const SubscriberCounters& Subscriber::counters() const { return state_->counters; }
const std::string& Subscriber::lastProblem() const { return state_->last_problem; }

bool Subscriber::connected() const {
  state_->watch();
  return std::any_of(state_->connections.begin(), state_->connections.end(),
                     [](const Connection& c) { return c.connected; });
}

}  // namespace volto::protocol
