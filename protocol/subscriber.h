// Subscriber: the receiving end, with the loop that every client needs (drain to the newest, drop the stale, count the
// lost, notice a restart).
//
// Thread-bound. Frames come on one connection and character/ and status/ on a second one, so that a flood of frames
// never pushes a character out of the queue.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/codec.h"
#include "protocol/topics.h"

namespace volto::protocol {

struct SubscriberOptions {
  std::string endpoint;  // see endpoint.h; empty: kDefaultEndpoint
  // Prefixes of topics: "weights/", "mesh/anna/", "status/". Empty: everything.
  std::vector<std::string> topics;
  // true: of frames that wait, only the newest of each topic is handed out (what a renderer wants). false: all of them,
  // in order.
  bool newest_only = false;
  // Frames published longer ago than this are dropped and counted; 0: never. 250 suits a renderer. From another machine
  // (whose clock is another) age is counted from the fastest message seen.
  int max_age_ms = 0;
  // Messages that wait on our side. A recorder wants many, a renderer few.
  int receive_high_water_mark = 4;

  // For a publisher with CURVE: its public key file and our key file.
  std::string curve_server_public_key_file;
  std::string curve_key_file;
};

struct SubscriberCounters {
  std::uint64_t received = 0;      // well-formed messages that arrived
  std::uint64_t delivered = 0;     // of these, handed out
  std::uint64_t lost = 0;          // gaps in seq
  std::uint64_t superseded = 0;    // newest_only: a newer one was there
  std::uint64_t stale = 0;         // older than max_age_ms
  std::uint64_t invalid = 0;       // refused: not two frames, unknown topic, Verifier, semantic checks
  std::uint64_t out_of_order = 0;  // seq that does not advance, or of an epoch that is over
  std::uint64_t epochs = 0;        // publishers seen, 1 for the first
  std::uint64_t reconnects = 0;    // sockets made anew after a disconnect
};

// Valid until the next call of receive.
struct ReceivedMessage {
  std::string_view topic;
  MessageKind kind = MessageKind::status;
  std::string_view name;  // of the topic
  Bytes payload;          // 8-byte aligned, has passed checkMessage: decode(payload, ...) succeeds
  Stamp stamp;
  std::uint64_t lost_before = 0;  // messages of this topic lost just before this one
  bool new_epoch = false;         // the publisher started anew: reset filters, forget characters
  std::int64_t t_receive_ns = 0;  // monotonic
};

class Subscriber {
 public:
  // Connects; it need not exist yet. Throws SetupError (usage, configuration).
  explicit Subscriber(const SubscriberOptions& options);
  ~Subscriber();
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  // Waits at most timeout_ms (0: not at all) for the next message. Reconnects by itself, for ever. Returns false on
  // timeout and when a signal interrupted the wait.
  bool receive(ReceivedMessage& out, int timeout_ms);

  // Asks for the characters whose topic begins with "character/NAME" (NAME may be empty: all), with retries until
  // timeout_ms. Not needed by a subscriber to character/: it is sent them. Returns those that answered and are well
  // formed.
  std::vector<CharacterMessage> requestCharacters(std::string_view name = {}, int timeout_ms = 2000);

  const SubscriberCounters& counters() const;
  // Why the last message was refused; empty if none was.
  const std::string& lastProblem() const;
  bool connected() const;  // to a publisher, now

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::protocol
