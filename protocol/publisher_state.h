// The inside of Publisher: what its callers' threads and its own thread share. Not for other folders.
//
// publisher.cpp holds what callers do, publisher_setup.cpp the sockets, publisher_thread.cpp the sending,
// publisher_requests.cpp the answers to subscribers that ask.
#pragma once

#include <algorithm>
#include <array>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include "protocol/buffer_pool.h"
#include "protocol/clock.h"
#include "protocol/codec.h"
#include "protocol/latency_window.h"
#include "protocol/publisher.h"
#include "protocol/sockets.h"
#include "protocol/topics.h"

namespace volto::protocol {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::size_t kQueueDepth = 8;             // WhenFull::wait: frames that wait, per topic
inline constexpr std::int64_t kMaxHandshakeBytes = 1024;  // with CURVE: its handshake is longer than a subscription

struct Stream {
  std::string topic;
  MessageKind kind;
  std::uint64_t seq = 0;    // under `sockets`
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
  Encoder encoder;  // under `sockets`
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

struct Publisher::State {
  // ---- setting up: publisher_setup.cpp
  explicit State(const PublisherOptions& how);
  ~State();
  void readKeys();
  Stream* addStream(MessageKind kind, std::string_view name);
  void openSockets();
  void openPair();

  // ---- any thread: publisher.cpp
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

  void refuse();

  // Into the queue; true: the publishing thread has to be woken for it.
  template <typename Encode>
  bool enqueue(Stream& stream, Encode encode) {
    std::unique_ptr<Buffer> buffer = pool.take();
    if (const Result r = encode(buffer->encoder); !r.ok()) {
      pool.give(std::move(buffer));
      refuse();
      return false;
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
          return false;
        }
      } else {
        room.wait(guard, [&] { return stream.waiting < kQueueDepth || stopping; });
      }
      queue.push_back({&stream, std::move(buffer), now});
      ++stream.waiting;
      ++pushed;
    }
    return true;
  }

  // The messages of one frame of a character; not sent yet.
  bool enqueue(const AvatarFrame& frame, std::size_t character);

  // Under the mutex.
  bool wantsTopic(std::string_view topic) const;
  bool wantsKind(MessageKind kind) const;

  // ---- whoever holds `sockets`: publisher_thread.cpp
  // False when told to stop and nothing is left.
  bool sendQueue();
  void sendBuffer(Stream& stream, std::unique_ptr<Buffer> buffer);
  void sendEncoded(Stream& stream, Encoder& encoder);
  // Takes the payload over.
  void sendPayload(Stream& stream, zmq_msg_t& payload, std::size_t size);
  bool sendTopic(const Stream& stream) { return Message(stream.topic).send(frames, ZMQ_SNDMORE); }
  void sendStatus(bool last);
  // Returns when the next one is due.
  std::int64_t sendDueCharacters();
  // False when there is more.
  bool readSubscriptions();
  void readMonitor();
  // All that there is to do. Returns how long nothing will be due, milliseconds; nothing: told to stop, and done.
  std::optional<int> work(std::int64_t& next_status);

  // ---- the publishing thread
  void run();

  // ---- answers to subscribers that ask, under `sockets`: publisher_requests.cpp
  // RFC 27 (ZAP): says yes to keys on the list, no to all else.
  void answerAccess();
  // "character/" or "character/NAME/" comes in, pairs of topic and payload go out. False when there is more.
  bool answerRequests();
  bool withinRate(const std::string& peer);
  void answer(Message& peer, bool delimiter, const std::string& prefix);

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

  // ZeroMQ's sockets belong to one thread at a time: the publishing thread while it works, or one that sends by itself.
  // Locked before `mutex`. Guards what follows, once the publishing thread runs.
  std::mutex sockets;
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

}  // namespace volto::protocol
