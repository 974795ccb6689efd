#include "protocol/publisher_state.h"

namespace volto::protocol {
namespace {

constexpr int kRequestsPerSecond = 4;  // snapshot socket, per peer
constexpr std::size_t kMaxPeers = 256;

}  // namespace

void Publisher::State::answerAccess() {
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
    for (std::size_t i = 0; i < reply.size(); ++i) Message(reply[i]).send(zap, i + 1 < reply.size() ? ZMQ_SNDMORE : 0);
  }
}

bool Publisher::State::answerRequests() {
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

bool Publisher::State::withinRate(const std::string& peer) {
  const std::int64_t now = monotonicNs();
  if (peers.size() >= kMaxPeers)
    std::erase_if(peers, [&](const auto& p) { return now - p.second.window_start_ns > 1000 * kMs; });
  if (peers.size() >= kMaxPeers && !peers.contains(peer)) return false;
  Peer& p = peers[peer];
  if (now - p.window_start_ns > 1000 * kMs) p = {now, 0};
  return ++p.requests <= kRequestsPerSecond;
}

void Publisher::State::answer(Message& peer, bool delimiter, const std::string& prefix) {
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

}  // namespace volto::protocol
