// Any bytes, taken for a message: refused, or well formed and the same again after another trip over the wire.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "protocol/codec.h"

using namespace volto::protocol;

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(reinterpret_cast<const std::byte*>(data), size);
  Stamp stamp;
  const bool good = checkMessage(bytes, stamp).ok();
  // Who passes on and who reads must not disagree.
  LandmarkMessage landmarks;
  MaskMessage mask;
  AvatarMessage weights, mesh;
  CharacterMessage character;
  StatusMessage status;
  const bool is_landmarks = decode(bytes, landmarks).ok();
  const bool is_mask = decode(bytes, mask).ok();
  const bool is_weights = decodeWeights(bytes, weights).ok();
  const bool is_mesh = decodeMesh(bytes, mesh).ok();
  const bool is_character = decode(bytes, character).ok();
  const bool is_status = decode(bytes, status).ok();
  require(is_landmarks + is_mask + is_weights + is_mesh + is_character + is_status == (good ? 1 : 0));
  if (!good) return 0;
  Encoder encoder;
  if (is_landmarks)
    require(encoder.encode(landmarks.stamp, landmarks.frame).ok() && decode(encoder.bytes(), landmarks).ok());
  if (is_mask) require(encoder.encode(mask.stamp, mask.frame).ok() && decode(encoder.bytes(), mask).ok());
  if (is_weights) {
    require(encoder.encodeWeights(weights.stamp, weights.character_id, weights.frame).ok() &&
            decodeWeights(encoder.bytes(), weights).ok());
  }
  if (is_mesh)
    require(encoder.encodeMesh(mesh.stamp, mesh.character_id, mesh.frame).ok() &&
            decodeMesh(encoder.bytes(), mesh).ok());
  if (is_character)
    require(encoder.encode(character.stamp, character.character).ok() && decode(encoder.bytes(), character).ok());
  if (is_status) require(encoder.encode(status.stamp, status.report).ok() && decode(encoder.bytes(), status).ok());
  return 0;
}
