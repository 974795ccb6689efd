// Publisher: frames to any number of subscribers, never slowed down by one of them.
//
// Threads: push..., setReport, wantsMesh and counters are thread-safe and never wait for the network (in WhenFull::wait
// they may wait for the publishing thread). push encodes in the caller's thread into pooled memory; one thread of the
// publisher's own stamps seq and t_publish_ns, sends, answers late joiners and speaks status/ twice a second. send does
// what push does and that thread's part too, which saves waking it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "protocol/messages.h"

namespace volto::protocol {

// What push does when the publishing thread has not yet taken the frame before.
enum class WhenFull {
  newest_wins,  // live: the waiting frame of that topic is replaced and counted
  wait,  // replay: every frame is sent; push waits for room. A subscriber that is slower than that still loses frames
  lossless  // tests and offline use: also waits up to 1 s for the slowest subscriber (XPUB_NODROP), then drops for it
};

struct PublisherOptions {
  std::string endpoint;            // see endpoint.h; empty: kDefaultEndpoint
  std::string source = "unnamed";  // NAME of mask/NAME/ and landmarks/NAME/
  WhenFull when_full = WhenFull::newest_wins;

  // Only for addresses that are not loopback: both, or the constructor refuses.
  std::string curve_key_file;
  std::string curve_allow_file;

  // Affects memory: messages kept for each subscriber that does not read. Limit per stalled subscriber: this x size of
  // a message. Two frames of everything: one is sent at a stretch, while the one before may still be on its way.
  int send_high_water_mark = 8;
  bool mesh_without_subscribers = false;  // encode mesh/ even if nobody listens (for measuring)
};

struct PublisherCounters {
  std::uint64_t sent = 0;  // messages, counted once however many subscribers
  std::uint64_t bytes = 0;
  std::uint64_t replaced = 0;  // newest_wins: replaced before they were sent
  std::uint64_t refused = 0;   // may not go on the wire: wrong count, not finite, too large
  std::uint64_t send_failures = 0;
  std::uint64_t snapshots = 0;     // characters sent on request
  std::uint64_t bad_requests = 0;  // refused at the snapshot socket, or over its rate limit
  std::uint64_t denied = 0;        // connections without a listed key
  std::uint32_t clients = 0;       // connected now
};

class Publisher {
 public:
  // Binds. Throws SetupError: usage (bad endpoint, public address without keys), unavailable (in use; says by which
  // process where it can), configuration (keys).
  explicit Publisher(const PublisherOptions& options);
  // Sends what is still waiting (at most a quarter of a second), says goodbye with a last status/ (stopping) and joins.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  // Makes a character known: published now, to each late joiner, and every 5 s. Returns its number for push. A
  // character of the same name replaces the former one under the same number. Throws SetupError (bad_data) for one that
  // may not go on the wire.
  std::size_t setCharacter(const Character& character);

  // Each is one message (AvatarFrame: weights/, and mesh/ when it has vertices and somebody wants them).
  // An AvatarFrame must have the counts of its character; what does not fit is refused and counted.
  void push(const AvatarFrame& frame, std::size_t character = 0);
  void push(const MaskFrame& frame);
  void push(const LandmarkFrame& frame);

  // One frame of everything, as push, in the order of the arguments; gone to the sockets when it returns. May wait for
  // what the publishing thread is sending just now.
  void send(const LandmarkFrame& landmarks, const MaskFrame& mask, const AvatarFrame& avatar,
            std::size_t character = 0);

  // Somebody subscribes to mesh/ of this character: worth computing.
  bool wantsMesh(std::size_t character = 0) const;
  // Somebody subscribes to a topic of this kind.
  bool wants(MessageKind kind) const;
  // Waits until somebody subscribes to a topic of this kind; false after timeout_ms.
  bool waitForSubscriber(MessageKind kind, int timeout_ms) const;

  // What the pipeline knows of itself; goes out with the next status/. The publisher fills in its own part (frames_out,
  // sent, clients ...).
  void setReport(const StatusReport& report);

  // Waits until all that was pushed has gone to the sockets.
  void flush();

  PublisherCounters counters() const;
  std::uint64_t epoch() const;
  // The address with the real port, ready for a subscriber.
  std::string endpoint() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::protocol
