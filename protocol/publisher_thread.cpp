#include <chrono>
#include <cstring>
#include <poll.h>

#include "protocol/publisher_state.h"

namespace volto::protocol {
namespace {

constexpr std::int64_t kStatusPeriodNs = 500 * kMs;
constexpr std::int64_t kCharacterPeriodNs = 5000 * kMs;
constexpr std::int64_t kCharacterMinGapNs = 500 * kMs;  // at most twice a second, however many join
constexpr std::size_t kCopyBelowBytes = 4096;           // smaller messages are copied: cheaper than counting references
constexpr std::size_t kMaxSubscriptions = 4096;         // distinct prefixes that we keep track of

}  // namespace

std::optional<int> Publisher::State::work(std::int64_t& next_status) {
  // Frames first, all else after them. Reading comes last, so that the descriptors tell of anything new: see
  // Socket::fd.
  if (!sendQueue()) {
    sendStatus(true);
    return std::nullopt;
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
  return static_cast<int>(std::clamp<std::int64_t>((wait_ns + kMs - 1) / kMs, 0, 500));
}

void Publisher::State::run() {
  std::int64_t next_status = monotonicNs();
  std::array<pollfd, 5> items{};
  {
    const std::lock_guard guard(sockets);
    items = {{{wake_fd, POLLIN, 0},
              {frames.fd(), POLLIN, 0},
              {snapshots.fd(), POLLIN, 0},
              {monitor.fd(), POLLIN, 0},
              {zap.fd(), POLLIN, 0}}};
  }
  while (true) {
    std::optional<int> wait_ms;
    {
      const std::lock_guard guard(sockets);
      wait_ms = work(next_status);
    }
    if (!wait_ms) return;
    ::poll(items.data(), items.size(), *wait_ms);  // a descriptor of -1 is passed over
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = ::read(wake_fd, &count, sizeof(count));
  }
}

bool Publisher::State::sendQueue() {
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

void Publisher::State::sendBuffer(Stream& stream, std::unique_ptr<Buffer> buffer) {
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

void Publisher::State::sendEncoded(Stream& stream, Encoder& encoder) {
  encoder.restamp(++stream.seq, monotonicNs(), realtimeNs());
  zmq_msg_t payload;
  zmq_msg_init_size(&payload, encoder.bytes().size());
  std::memcpy(zmq_msg_data(&payload), encoder.bytes().data(), encoder.bytes().size());
  sendPayload(stream, payload, encoder.bytes().size());
}

void Publisher::State::sendPayload(Stream& stream, zmq_msg_t& payload, std::size_t size) {
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

void Publisher::State::sendStatus(bool last) {
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

std::int64_t Publisher::State::sendDueCharacters() {
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

bool Publisher::State::readSubscriptions() {
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

void Publisher::State::readMonitor() {
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

}  // namespace volto::protocol
