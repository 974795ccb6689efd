#include "protocol/publisher.h"

#include <chrono>

#include "protocol/publisher_state.h"

namespace volto::protocol {

void Publisher::State::refuse() {
  const std::lock_guard guard(mutex);
  ++counters.refused;
}

bool Publisher::State::wantsTopic(std::string_view topic) const {
  return std::any_of(subscriptions.begin(), subscriptions.end(),
                     [&](const auto& s) { return subscriptionMatches(s.first, topic); });
}

bool Publisher::State::wantsKind(MessageKind kind) const {
  const std::string_view prefix = topicPrefix(kind);
  return std::any_of(subscriptions.begin(), subscriptions.end(), [&](const auto& s) {
    return subscriptionMatches(s.first, prefix) || s.first.starts_with(prefix);
  });
}

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

bool Publisher::State::enqueue(const AvatarFrame& frame, std::size_t character) {
  Stream* weights = nullptr;
  Stream* mesh = nullptr;
  std::uint64_t id = 0;
  {
    const std::lock_guard guard(mutex);
    if (character >= characters.size() || frame.weights.size() != characters[character].entry->blendshapes ||
        (!frame.vertices.empty() && frame.vertices.size() != characters[character].entry->vertices)) {
      ++counters.refused;
      return false;
    }
    const CharacterSlot& slot = characters[character];
    id = slot.entry->id;
    weights = slot.weights;
    if (!frame.vertices.empty() && (slot.wants_mesh || options.mesh_without_subscribers)) mesh = slot.mesh;
    ++frames_out;
  }
  const Stamp stamp = freshStamp();
  bool wake = enqueue(*weights, [&](Encoder& e) { return e.encodeWeights(stamp, id, frame); });
  if (mesh != nullptr) wake |= enqueue(*mesh, [&](Encoder& e) { return e.encodeMesh(stamp, id, frame); });
  return wake;
}

void Publisher::push(const AvatarFrame& frame, std::size_t character) {
  if (state_->enqueue(frame, character)) state_->wakeUp();
}

void Publisher::push(const MaskFrame& frame) {
  State& s = *state_;
  if (s.enqueue(*s.source_mask, [&](Encoder& e) { return e.encode(s.freshStamp(), frame); })) s.wakeUp();
}

void Publisher::push(const LandmarkFrame& frame) {
  State& s = *state_;
  if (s.enqueue(*s.source_landmarks, [&](Encoder& e) { return e.encode(s.freshStamp(), frame); })) s.wakeUp();
}

void Publisher::send(const LandmarkFrame& landmarks, const MaskFrame& mask, const AvatarFrame& avatar,
                     std::size_t character) {
  State& s = *state_;
  s.enqueue(*s.source_landmarks, [&](Encoder& e) { return e.encode(s.freshStamp(), landmarks); });
  s.enqueue(*s.source_mask, [&](Encoder& e) { return e.encode(s.freshStamp(), mask); });
  s.enqueue(avatar, character);
  const std::lock_guard guard(s.sockets);
  s.sendQueue();
  // Sending may have swallowed what the socket's descriptor told of: somebody subscribed. The publishing thread reads
  // it.
  if ((s.frames.events() & ZMQ_POLLIN) != 0) s.wakeUp();
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
