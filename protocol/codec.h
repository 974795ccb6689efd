// Messages to bytes and back: the only place that knows FlatBuffers.
//
// Encoder: thread-bound, reuses its memory: no allocation per frame once it has seen the largest. decode...: reentrant;
// bytes may come from anyone: the Verifier runs on aligned memory with limits first, then the identifier, then what the
// bytes mean (counts exact, numbers finite, enums known). Nothing of `out` is promised when the Result is not ok.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "protocol/errors.h"
#include "protocol/messages.h"

namespace volto::protocol {

using Bytes = std::span<const std::byte>;

class Encoder {
 public:
  explicit Encoder(std::size_t expected_bytes = 1024);
  ~Encoder();
  Encoder(Encoder&&) noexcept;
  Encoder& operator=(Encoder&&) noexcept;

  // Each replaces what bytes() was. capture_seq and t_capture_ns of the frame are used, not those of the stamp.
  // A frame that may not go on the wire (wrong count, not finite, too large) is refused and bytes() is empty.
  Result encode(const Stamp& stamp, const LandmarkFrame& frame);
  Result encode(const Stamp& stamp, const MaskFrame& frame);
  Result encodeWeights(const Stamp& stamp, std::uint64_t character_id, const AvatarFrame& frame);
  Result encodeMesh(const Stamp& stamp, std::uint64_t character_id, const AvatarFrame& frame);
  Result encode(const Stamp& stamp, const Character& character);
  Result encode(const Stamp& stamp, const StatusReport& report);

  // Mesh without a copy: write the #V vertices where they will be sent from, then finish with the rest of the frame
  // (frame.vertices is not read). The span is valid until finishMesh.
  std::span<std::array<float, 3>> beginMesh(std::size_t vertex_count);
  Result finishMesh(const Stamp& stamp, std::uint64_t character_id, const AvatarFrame& frame);

  Bytes bytes() const;  // valid until the next call
  // Writes times and sequence into the message in place, as late as possible.
  void restamp(std::uint64_t seq, std::int64_t t_publish_ns, std::int64_t t_realtime_ns);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Result decode(Bytes bytes, LandmarkMessage& out);
Result decode(Bytes bytes, MaskMessage& out);
Result decodeWeights(Bytes bytes, AvatarMessage& out);
Result decodeMesh(Bytes bytes, AvatarMessage& out);
Result decode(Bytes bytes, CharacterMessage& out);
Result decode(Bytes bytes, StatusMessage& out);

// Which message the identifier says these bytes are; nothing is verified. Nothing for fewer than 8 bytes or an unknown
// identifier.
std::optional<MessageKind> messageKind(Bytes bytes);

// The stamp alone, of any message; runs the whole Verifier (so the bytes are well formed) but not the semantic checks.
Result decodeStamp(Bytes bytes, Stamp& out);

// All that decode would check, for those who pass bytes on without looking at the frame (Subscriber, takes).
// Thread-bound; reuses memory.
class Inspector {
 public:
  Result check(Bytes bytes, Stamp& stamp);

 private:
  Result checkMesh(Bytes bytes, Stamp& stamp);

  LandmarkMessage landmarks_;
  MaskMessage mask_;
  AvatarMessage avatar_;
  CharacterMessage character_;
  StatusMessage status_;
};

// The same for one message.
Result checkMessage(Bytes bytes, Stamp& stamp);

}  // namespace volto::protocol
