#include "protocol/publisher.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <poll.h>
#include <random>
#include <set>
#include <sys/eventfd.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "protocol/clock.h"
#include "protocol/codec.h"
#include "protocol/latency_window.h"
#include "protocol/sockets.h"
#include "protocol/topics.h"

namespace volto::protocol {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStatusPeriodNs = 500 * kMs;
constexpr std::int64_t kCharacterPeriodNs = 5000 * kMs;
constexpr std::int64_t kCharacterMinGapNs = 500 * kMs;  // at most twice a second, however many join
constexpr std::size_t kQueueDepth = 8;                  // WhenFull::wait: frames that wait, per topic
constexpr std::size_t kCopyBelowBytes = 4096;           // smaller messages are copied: cheaper than counting references
constexpr std::size_t kMaxSubscriptions = 4096;         // distinct prefixes that we keep track of
constexpr std::int64_t kMaxSubscriptionBytes = 256;     // what a subscriber may send us
constexpr std::int64_t kMaxHandshakeBytes = 1024;       // with CURVE: its handshake is longer than that
constexpr int kRequestsPerSecond = 4;                   // snapshot socket, per peer
constexpr std::size_t kMaxPeers = 256;

// A message in memory that is lent to ZeroMQ and comes back when its last subscriber has been served.
class Pool;
struct Buffer {
  Encoder encoder;
  Pool* pool = nullptr;
};

// Thread-safe: buffers come back from ZeroMQ's own threads.
class Pool {
 public:
  std::unique_ptr<Buffer> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!free_.empty()) {
        std::unique_ptr<Buffer> buffer = std::move(free_.back());
        free_.pop_back();
        return buffer;
      }
    }
    auto buffer = std::make_unique<Buffer>();
    buffer->pool = this;
    return buffer;
  }
  void give(std::unique_ptr<Buffer> buffer) {
    const std::lock_guard lock(mutex_);
    if (free_.size() < kKept) free_.push_back(std::move(buffer));
  }

 private:
  static constexpr std::size_t kKept = 16;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Buffer>> free_;
};

void giveBack(void* /*data*/, void* hint) {
  auto* buffer = static_cast<Buffer*>(hint);
  buffer->pool->give(std::unique_ptr<Buffer>(buffer));
}

struct Stream {
  std::string topic;
  MessageKind kind;
  std::uint64_t seq = 0;    // of the publishing thread
  std::size_t waiting = 0;  // in the queue; under the queue's mutex
};

struct Item {
  Stream* stream;
  std::unique_ptr<Buffer> buffer;
  std::int64_t t_pushed_ns;
};

struct CharacterEntry {
  std::uint64_t id = 0;
  std::size_t blendshapes = 0, vertices = 0;
  Encoder encoder;  // of the publishing thread
};

struct CharacterSlot {
  std::string name;
  Stream* character = nullptr;
  Stream* weights = nullptr;
  Stream* mesh = nullptr;
  std::shared_ptr<CharacterEntry> entry;
  bool wants_mesh = false;
  bool due = true;
  std::int64_t t_sent_ns = 0;
};

struct Peer {
  std::int64_t window_start_ns = 0;
  int requests = 0;
};

}  // namespace

struct Publisher::State {
  explicit State(const PublisherOptions& how)
      : options(how),
        endpoint(parseEndpoint(options.endpoint.empty() ? std::string(kDefaultEndpoint) : options.endpoint)),
        lock(endpoint) {
    readKeys();
    epoch = (static_cast<std::uint64_t>(std::random_device{}()) << 32U) | std::random_device{}();
    source_landmarks = addStream(MessageKind::landmarks, options.source);
    source_mask = addStream(MessageKind::mask, options.source);
    status = addStream(MessageKind::status, {});
    wake_fd = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (wake_fd < 0) throw SetupError(SetupError::Kind::failed, "no eventfd: too many open files?");
    try {
      openSockets();
    } catch (...) {
      ::close(wake_fd);
      throw;
    }
    thread = std::thread([this] { run(); });
  }

  ~State() {
    {
      const std::lock_guard guard(mutex);
      stopping = true;
    }
    wakeUp();
    thread.join();
    ::close(wake_fd);
  }

  // ---- setting up
  // --------------------------------------------------------------------------------------------------------------

  void readKeys() {
    const bool has_keys = !options.curve_key_file.empty();
    const bool has_list = !options.curve_allow_file.empty();
    if (!endpoint.loopback && !(has_keys && has_list)) {
      throw SetupError(SetupError::Kind::usage,
                       endpoint.address() +
                           ": would be reachable from other machines; that wants CURVE keys and a "
                           "list of the subscribers that may connect, or use 127.0.0.1");
    }
    if (has_keys != has_list)
      throw SetupError(SetupError::Kind::usage, "CURVE wants both a key file and an allow-list");
    if (!has_keys) return;
    keys = readCurveKeys(options.curve_key_file);
    allowed = readCurveAllowList(options.curve_allow_file);
  }

  Stream* addStream(MessageKind kind, std::string_view name) {
    streams.push_back(std::make_unique<Stream>(Stream{makeTopic(kind, name), kind}));
    return streams.back().get();
  }

  void openSockets() {
    if (keys) {
      // Before the first peer can knock.
      zap = Socket(context, ZMQ_REP);
      zap.set(ZMQ_LINGER, 0);
      if (zmq_bind(zap.get(), "inproc://zeromq.zap.01") != 0)
        throw SetupError(SetupError::Kind::failed, "the access handler cannot start");
    }
    // A free pair of neighbouring ports may take several tries.
    const bool any_port = endpoint.transport == Endpoint::Transport::tcp && endpoint.port == 0;
    for (int tries = any_port ? 20 : 1;; --tries) {
      openPair();
      try {
        bindSocket(frames, endpoint);
        Endpoint bound = endpoint;
        if (any_port) {
          const std::string address = frames.lastEndpoint();
          bound.port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
          if (bound.port == 65535) continue;
        }
        bindSocket(snapshots, bound.snapshot());
        endpoint = bound;
        return;
      } catch (const SetupError&) {
        if (tries <= 1) throw;
      }
    }
  }

  void openPair() {
    snapshots = Socket(context, ZMQ_ROUTER);
    monitor = Socket();
    frames = Socket(context, ZMQ_XPUB);
    for (Socket* socket : {&frames, &snapshots}) {
      setCommonOptions(*socket, endpoint);
      socket->set(ZMQ_MAXMSGSIZE, keys ? kMaxHandshakeBytes : kMaxSubscriptionBytes);
      socket->set(ZMQ_SNDHWM, options.send_high_water_mark);
      if (!keys) continue;
      socket->set(ZMQ_CURVE_SERVER, 1);
      socket->set(ZMQ_CURVE_SECRETKEY, std::string_view(keys->secret_key));
      socket->set(ZMQ_ZAP_DOMAIN, kZapDomain);
    }
    frames.set(ZMQ_LINGER, 250);
    // Every subscription and every end of one, not only the first: late joiners are served and wantsMesh is right.
    frames.set(ZMQ_XPUB_VERBOSER, 1);
    if (options.when_full == WhenFull::lossless) {
      frames.set(ZMQ_XPUB_NODROP, 1);
      frames.set(ZMQ_SNDTIMEO, 1000);
    }
    monitor = Socket::monitorOf(context, frames, "inproc://monitor-" + std::to_string(pairs_opened++),
                                ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED);
  }

  // ---- any thread
  // ----------------------------------------------------------------------------------------------------------------

  void wakeUp() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake_fd, &one, sizeof(one));
  }

  Stamp freshStamp() const {
    Stamp stamp;
    stamp.epoch = epoch;
    stamp.seq = 1;  // the publishing thread puts the real one
    return stamp;
  }

  void refuse() {
    const std::lock_guard guard(mutex);
    ++counters.refused;
  }

  template <typename Encode>
  void push(Stream& stream, Encode encode) {
    std::unique_ptr<Buffer> buffer = pool.take();
    if (const Result r = encode(buffer->encoder); !r.ok()) {
      pool.give(std::move(buffer));
      refuse();
      return;
    }
    const std::int64_t now = monotonicNs();
    {
      std::unique_lock guard(mutex);
      if (options.when_full == WhenFull::newest_wins) {
        if (stream.waiting > 0) {
          const auto item =
              std::find_if(queue.begin(), queue.end(), [&](const Item& i) { return i.stream == &stream; });
          std::swap(item->buffer, buffer);
          item->t_pushed_ns = now;
          ++counters.replaced;
          guard.unlock();
          pool.give(std::move(buffer));
          return;
        }
      } else {
        room.wait(guard, [&] { return stream.waiting < kQueueDepth || stopping; });
      }
      queue.push_back({&stream, std::move(buffer), now});
      ++stream.waiting;
      ++pushed;
    }
    wakeUp();
  }

  bool wantsTopic(std::string_view topic) const {
    return std::any_of(subscriptions.begin(), subscriptions.end(),
                       [&](const auto& s) { return subscriptionMatches(s.first, topic); });
  }

  bool wantsKind(MessageKind kind) const {
    const std::string_view prefix = topicPrefix(kind);
    return std::any_of(subscriptions.begin(), subscriptions.end(), [&](const auto& s) {
      return subscriptionMatches(s.first, prefix) || s.first.starts_with(prefix);
    });
  }

  // ---- the publishing thread
  // -----------------------------------------------------------------------------------------------------

  void run() {
    std::int64_t next_status = monotonicNs();
    while (true) {
      // Frames first, all else after them. Reading comes last, so that the descriptors tell of anything new: see
      // Socket::fd.
      if (!sendQueue()) {
        sendStatus(true);
        return;
      }
      const std::int64_t now = monotonicNs();
      if (now >= next_status) {
        sendStatus(false);
        next_status = now + kStatusPeriodNs;
      }
      const std::int64_t next_character = sendDueCharacters();
      readMonitor();
      answerAccess();
      const bool all_answered = answerRequests();
      const bool all_read = readSubscriptions() && all_answered;
      const std::int64_t wait_ns = all_read ? std::min(next_status, next_character) - monotonicNs() : 0;
      waitForWork(static_cast<int>(std::clamp<std::int64_t>((wait_ns + kMs - 1) / kMs, 0, 500)));
    }
  }

  void waitForWork(int timeout_ms) {
    std::array<pollfd, 5> items{{{wake_fd, POLLIN, 0},
                                 {frames.fd(), POLLIN, 0},
                                 {snapshots.fd(), POLLIN, 0},
                                 {monitor.fd(), POLLIN, 0},
                                 {zap.fd(), POLLIN, 0}}};
    ::poll(items.data(), items.size(), timeout_ms);  // a descriptor of -1 is passed over
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = ::read(wake_fd, &count, sizeof(count));
  }

  // False when told to stop and nothing is left.
  bool sendQueue() {
    bool stop = false;
    {
      const std::lock_guard guard(mutex);
      std::swap(queue, sending);
      for (const Item& item : sending) item.stream->waiting = 0;
      stop = stopping;
    }
    if (!sending.empty()) room.notify_all();
    for (Item& item : sending) {
      sendBuffer(*item.stream, std::move(item.buffer));
      latency.add(monotonicNs() - item.t_pushed_ns);
    }
    if (!sending.empty()) {
      const std::lock_guard guard(mutex);
      taken += sending.size();
      idle.notify_all();
      if (stop && !queue.empty()) stop = false;
    }
    sending.clear();
    return !stop;
  }

  void sendBuffer(Stream& stream, std::unique_ptr<Buffer> buffer) {
    buffer->encoder.restamp(++stream.seq, monotonicNs(), realtimeNs());
    const Bytes bytes = buffer->encoder.bytes();
    zmq_msg_t payload;
    if (bytes.size() < kCopyBelowBytes) {
      zmq_msg_init_size(&payload, bytes.size());
      std::memcpy(zmq_msg_data(&payload), bytes.data(), bytes.size());
      pool.give(std::move(buffer));
    } else {
      auto* data = const_cast<std::byte*>(bytes.data());
      zmq_msg_init_data(&payload, data, bytes.size(), giveBack, buffer.release());
    }
    sendPayload(stream, payload, bytes.size());
  }

  void sendEncoded(Stream& stream, Encoder& encoder) {
    encoder.restamp(++stream.seq, monotonicNs(), realtimeNs());
    zmq_msg_t payload;
    zmq_msg_init_size(&payload, encoder.bytes().size());
    std::memcpy(zmq_msg_data(&payload), encoder.bytes().data(), encoder.bytes().size());
    sendPayload(stream, payload, encoder.bytes().size());
  }

  // Takes the payload over.
  void sendPayload(Stream& stream, zmq_msg_t& payload, std::size_t size) {
    bool sent = sendTopic(stream);
    if (!sent && options.when_full == WhenFull::lossless) {
      // One subscriber has not read for a second: from here on the frame is dropped for those that are full.
      frames.set(ZMQ_XPUB_NODROP, 0);
      sent = sendTopic(stream);
    }
    sent = sent && zmq_msg_send(&payload, frames.get(), 0) >= 0;
    if (options.when_full == WhenFull::lossless) frames.set(ZMQ_XPUB_NODROP, 1);
    if (!sent) zmq_msg_close(&payload);
    const std::lock_guard guard(mutex);
    if (sent) {
      ++counters.sent;
      counters.bytes += size;
    } else {
      ++counters.send_failures;
    }
  }

  bool sendTopic(const Stream& stream) { return Message(stream.topic).send(frames, ZMQ_SNDMORE); }

  void sendStatus(bool last) {
    StatusReport r;
    {
      const std::lock_guard guard(mutex);
      r = report;
      r.messages_sent = counters.sent;
      r.bytes_sent = counters.bytes;
      r.send_failures = counters.send_failures + counters.refused;
      r.clients = counters.clients;
      r.dropped_queue = counters.replaced;
      r.bad_messages += counters.bad_requests + counters.denied;
      r.frames_out = frames_out;
    }
    if (last) r.state = PipelineState::stopping;
    if (r.source.empty()) r.source = options.source;
    if (r.stages.size() < kMaxStages) {
      r.stages.push_back({"publish", latency.count(), static_cast<double>(latency.quantileNs(0.5)) / 1e3,
                          static_cast<double>(latency.quantileNs(0.99)) / 1e3});
    }
    if (!status_encoder.encode(freshStamp(), r).ok()) {
      // What the pipeline says of itself may not go out (a text too long): then at least that we live.
      StatusReport bare;
      bare.state = r.state;
      bare.clients = r.clients;
      if (!status_encoder.encode(freshStamp(), bare).ok()) return;
    }
    sendEncoded(*status, status_encoder);
  }

  // Returns when the next one is due.
  std::int64_t sendDueCharacters() {
    std::int64_t next = monotonicNs() + kCharacterPeriodNs;
    for (std::size_t i = 0;; ++i) {
      std::shared_ptr<CharacterEntry> entry;
      Stream* stream = nullptr;
      {
        const std::lock_guard guard(mutex);
        if (i >= characters.size()) return next;
        CharacterSlot& slot = characters[i];
        const std::int64_t now = monotonicNs();
        const bool first = slot.t_sent_ns == 0;
        const std::int64_t at = slot.t_sent_ns + (slot.due ? kCharacterMinGapNs : kCharacterPeriodNs);
        if (!first && now < at) {
          next = std::min(next, at);
          continue;
        }
        slot.due = false;
        slot.t_sent_ns = now;
        entry = slot.entry;
        stream = slot.character;
      }
      sendEncoded(*stream, entry->encoder);
    }
  }

  // False when there is more.
  bool readSubscriptions() {
    Message message;
    bool changed = false;
    bool all_read = false;
    for (int i = 0; i < 1000; ++i) {
      if (!message.receive(frames)) {
        all_read = true;
        break;
      }
      const std::string_view text = message.text();
      if (text.empty() || text.size() > static_cast<std::size_t>(kMaxHandshakeBytes) || (text[0] != 0 && text[0] != 1))
        continue;
      const std::string prefix(text.substr(1));
      const std::lock_guard guard(mutex);
      const auto known = subscriptions.find(prefix);
      if (text[0] == 1) {
        if (known != subscriptions.end()) {
          ++known->second;
        } else if (subscriptions.size() < kMaxSubscriptions) {
          subscriptions.emplace(prefix, 1);
        }
        for (CharacterSlot& slot : characters) {
          if (subscriptionMatches(prefix, slot.character->topic)) slot.due = true;
        }
      } else if (known != subscriptions.end() && --known->second == 0) {
        subscriptions.erase(known);
      }
      changed = true;
    }
    if (!changed) return all_read;
    const std::lock_guard guard(mutex);
    for (CharacterSlot& slot : characters) {
      slot.wants_mesh = wantsTopic(slot.mesh->topic);
      all_read = all_read && !slot.due;  // a late joiner is served before we sleep
    }
    subscribed.notify_all();
    return all_read;
  }

  void readMonitor() {
    bool changed = false;
    while (const std::optional<MonitorEvent> event = nextEvent(monitor)) {
      changed = true;
      if (event->event == ZMQ_EVENT_ACCEPTED) connections.insert(event->value);
      if (event->event == ZMQ_EVENT_DISCONNECTED) connections.erase(event->value);
    }
    if (!changed) return;
    const std::lock_guard guard(mutex);
    counters.clients = static_cast<std::uint32_t>(connections.size());
  }

  // RFC 27 (ZAP): says yes to keys on the list, no to all else.
  void answerAccess() {
    if (!keys) return;
    while (true) {
      std::vector<std::string> request;
      Message part;
      if (!part.receive(zap)) return;
      request.emplace_back(part.text());
      while (part.more() && part.receive(zap)) request.emplace_back(part.text());
      bool granted = false;
      if (request.size() == 7 && request[0] == "1.0" && request[2] == kZapDomain && request[5] == "CURVE" &&
          request[6].size() == 32) {
        std::array<char, 41> key{};
        zmq_z85_encode(key.data(), reinterpret_cast<const std::uint8_t*>(request[6].data()), 32);
        granted = std::binary_search(allowed.begin(), allowed.end(), std::string(key.data()));
      }
      if (!granted) {
        const std::lock_guard guard(mutex);
        ++counters.denied;
      }
      const std::array<std::string_view, 6> reply{"1.0",
                                                  request.size() > 1 ? request[1] : std::string_view{},
                                                  granted ? "200" : "400",
                                                  granted ? "OK" : "this key is not on the list",
                                                  "",
                                                  ""};
      for (std::size_t i = 0; i < reply.size(); ++i)
        Message(reply[i]).send(zap, i + 1 < reply.size() ? ZMQ_SNDMORE : 0);
    }
  }

  // "character/" or "character/NAME/" comes in, pairs of topic and payload go out.
  // False when there is more.
  bool answerRequests() {
    for (int i = 0; i < 1000; ++i) {
      Message peer;
      if (!peer.receive(snapshots)) return true;
      std::vector<std::string> parts;
      Message part;
      bool more = peer.more();
      while (more && part.receive(snapshots)) {
        if (parts.size() < 3) parts.emplace_back(part.text());
        more = part.more();
      }
      const bool delimiter = parts.size() == 2 && parts[0].empty();  // a REQ socket puts one
      if (delimiter) parts.erase(parts.begin());
      const bool sensible = parts.size() == 1 && parts[0].starts_with(topicPrefix(MessageKind::character));
      if (!sensible || !withinRate(std::string(peer.text()))) {
        const std::lock_guard guard(mutex);
        ++counters.bad_requests;
        continue;
      }
      answer(peer, delimiter, parts[0]);
    }
    return false;
  }

  bool withinRate(const std::string& peer) {
    const std::int64_t now = monotonicNs();
    if (peers.size() >= kMaxPeers)
      std::erase_if(peers, [&](const auto& p) { return now - p.second.window_start_ns > 1000 * kMs; });
    if (peers.size() >= kMaxPeers && !peers.contains(peer)) return false;
    Peer& p = peers[peer];
    if (now - p.window_start_ns > 1000 * kMs) p = {now, 0};
    return ++p.requests <= kRequestsPerSecond;
  }

  void answer(Message& peer, bool delimiter, const std::string& prefix) {
    std::vector<std::pair<Stream*, std::shared_ptr<CharacterEntry>>> matching;
    {
      const std::lock_guard guard(mutex);
      for (const CharacterSlot& slot : characters) {
        if (subscriptionMatches(prefix, slot.character->topic)) matching.emplace_back(slot.character, slot.entry);
      }
      counters.snapshots += matching.size();
    }
    // Never waits: a peer that went away, or does not read, gets nothing.
    if (!peer.send(snapshots, ZMQ_SNDMORE | ZMQ_DONTWAIT)) return;
    if (delimiter) Message("").send(snapshots, ZMQ_SNDMORE | ZMQ_DONTWAIT);
    for (auto& [stream, entry] : matching) {
      // An answer is no publication: it repeats the number of the last one.
      entry->encoder.restamp(std::max<std::uint64_t>(stream->seq, 1), monotonicNs(), realtimeNs());
      const Bytes bytes = entry->encoder.bytes();
      Message(stream->topic).send(snapshots, ZMQ_SNDMORE | ZMQ_DONTWAIT);
      Message(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()))
          .send(snapshots, ZMQ_SNDMORE | ZMQ_DONTWAIT);
    }
    Message("").send(snapshots, ZMQ_DONTWAIT);
  }

  PublisherOptions options;
  Endpoint endpoint;
  EndpointLock lock;
  std::optional<CurveKeys> keys;
  std::vector<std::string> allowed;
  std::uint64_t epoch = 0;
  int wake_fd = -1;
  Pool pool;  // outlives the context: ZeroMQ may hold messages until it ends
  Context context;

  int pairs_opened = 0;

  // Of the publishing thread, once it runs.
  Socket frames, snapshots, monitor, zap;
  std::vector<Item> sending;
  std::set<std::uint32_t> connections;
  std::map<std::string, Peer> peers;
  LatencyWindow latency;
  Encoder status_encoder;
  Stream* status = nullptr;

  Stream* source_landmarks = nullptr;
  Stream* source_mask = nullptr;

  mutable std::mutex mutex;  // guards all below
  std::vector<std::unique_ptr<Stream>> streams;
  std::condition_variable room, idle;
  mutable std::condition_variable subscribed;
  std::vector<Item> queue;
  std::uint64_t pushed = 0, taken = 0, frames_out = 0;
  std::vector<CharacterSlot> characters;
  std::map<std::string, std::uint32_t, std::less<>> subscriptions;
  StatusReport report;
  PublisherCounters counters;
  bool stopping = false;

  std::thread thread;
};

Publisher::Publisher(const PublisherOptions& options) : state_(std::make_unique<State>(options)) {}
Publisher::~Publisher() = default;

std::size_t Publisher::setCharacter(const Character& character) {
  auto entry = std::make_shared<CharacterEntry>();
  if (const Result r = entry->encoder.encode(state_->freshStamp(), character); !r.ok())
    throw SetupError(SetupError::Kind::bad_data, r.problem);
  entry->id = characterId(character);
  entry->blendshapes = character.blendshape_names.size();
  entry->vertices = character.neutral.size();
  std::size_t number = 0;
  {
    const std::lock_guard guard(state_->mutex);
    std::vector<CharacterSlot>& slots = state_->characters;
    while (number < slots.size() && slots[number].name != character.name) ++number;
    if (number == slots.size()) {
      CharacterSlot slot;
      slot.name = character.name;
      slot.character = state_->addStream(MessageKind::character, character.name);
      slot.weights = state_->addStream(MessageKind::weights, character.name);
      slot.mesh = state_->addStream(MessageKind::mesh, character.name);
      slot.wants_mesh = state_->wantsTopic(slot.mesh->topic);
      slots.push_back(std::move(slot));
    }
    slots[number].entry = std::move(entry);
    slots[number].due = true;
  }
  state_->wakeUp();
  return number;
}

void Publisher::push(const AvatarFrame& frame, std::size_t character) {
  State& s = *state_;
  Stream* weights = nullptr;
  Stream* mesh = nullptr;
  std::uint64_t id = 0;
  {
    const std::lock_guard guard(s.mutex);
    if (character >= s.characters.size() || frame.weights.size() != s.characters[character].entry->blendshapes ||
        (!frame.vertices.empty() && frame.vertices.size() != s.characters[character].entry->vertices)) {
      ++s.counters.refused;
      return;
    }
    const CharacterSlot& slot = s.characters[character];
    id = slot.entry->id;
    weights = slot.weights;
    if (!frame.vertices.empty() && (slot.wants_mesh || s.options.mesh_without_subscribers)) mesh = slot.mesh;
    ++s.frames_out;
  }
  const Stamp stamp = s.freshStamp();
  s.push(*weights, [&](Encoder& e) { return e.encodeWeights(stamp, id, frame); });
  if (mesh != nullptr) s.push(*mesh, [&](Encoder& e) { return e.encodeMesh(stamp, id, frame); });
}

void Publisher::push(const MaskFrame& frame) {
  state_->push(*state_->source_mask, [&](Encoder& e) { return e.encode(state_->freshStamp(), frame); });
}

void Publisher::push(const LandmarkFrame& frame) {
  state_->push(*state_->source_landmarks, [&](Encoder& e) { return e.encode(state_->freshStamp(), frame); });
}

bool Publisher::wantsMesh(std::size_t character) const {
  const std::lock_guard guard(state_->mutex);
  if (character >= state_->characters.size()) return false;
  return state_->characters[character].wants_mesh || state_->options.mesh_without_subscribers;
}

bool Publisher::wants(MessageKind kind) const {
  const std::lock_guard guard(state_->mutex);
  return state_->wantsKind(kind);
}

bool Publisher::waitForSubscriber(MessageKind kind, int timeout_ms) const {
  std::unique_lock guard(state_->mutex);
  return state_->subscribed.wait_for(guard, std::chrono::milliseconds(timeout_ms),
                                     [&] { return state_->wantsKind(kind); });
}

void Publisher::setReport(const StatusReport& report) {
  const std::lock_guard guard(state_->mutex);
  state_->report = report;
}

void Publisher::flush() {
  std::unique_lock guard(state_->mutex);
  const std::uint64_t target = state_->pushed;
  state_->idle.wait(guard, [&] { return state_->taken >= target; });
}

PublisherCounters Publisher::counters() const {
  const std::lock_guard guard(state_->mutex);
  return state_->counters;
}

std::uint64_t Publisher::epoch() const { return state_->epoch; }

std::string Publisher::endpoint() const { return state_->endpoint.address(); }

}  // namespace volto::protocol
