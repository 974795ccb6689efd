// The messages of the wire as plain structs; protocol/README.md gives their bytes, protocol/codec.h turns one into the
// other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "frames/avatar_frame.h"
#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"

namespace volto::protocol {

// do not change the values: a take's index of kinds may be stored by others.
enum class MessageKind : std::uint8_t { landmarks = 0, mask = 1, weights = 2, mesh = 3, character = 4, status = 5 };
inline constexpr std::size_t kMessageKindCount = 6;

// Limits. A message beyond them is neither sent nor accepted.
inline constexpr std::size_t kMaxFrameBytes = 4U << 20U;       // landmarks, mask, weights, mesh, status
inline constexpr std::size_t kMaxCharacterBytes = 15U << 20U;  // character: sent now and then, not at frame rate
inline constexpr std::size_t kMaxInboundBytes = 16U << 20U;    // what a subscriber lets its peer send
inline constexpr std::size_t kMaxVertices = 200'000;
inline constexpr std::size_t kMaxTriangles = 400'000;
inline constexpr std::size_t kMaxBlendshapes = 1024;
inline constexpr std::size_t kMaxMaterials = 1024;
inline constexpr std::size_t kMaxStages = 64;
inline constexpr std::size_t kMaxNameBytes = 128;
inline constexpr std::size_t kMaxTextBytes = 1024;  // recording_error and the like

// In front of every message.
struct Stamp {
  std::uint64_t epoch = 0;  // drawn at random at each start of a publisher: a new one means "forget what you knew"
  std::uint64_t seq = 0;    // per topic, 1, 2, 3 ...: a gap is messages lost between the publisher and you
  std::uint64_t capture_seq = 0;  // as the capture stage counted; a gap is frames lost before the publisher
  std::int64_t t_capture_ns = 0;  // monotonic clock; 0 in messages that belong to no captured frame (character, status)
  std::int64_t t_publish_ns = 0;  // monotonic clock, just before the message goes to the sockets
  std::int64_t t_realtime_ns = 0;  // wall clock at publishing, since 1970; for display only
};

struct LandmarkMessage {
  Stamp stamp;
  LandmarkFrame frame;
};

struct MaskMessage {
  Stamp stamp;
  MaskFrame frame;
};

// A weights/ message has everything but the vertices, a mesh/ message has state, head and vertices. decodeWeights and
// decodeMesh each write only their own part, so that one AvatarMessage can take both.
struct AvatarMessage {
  Stamp stamp;
  std::uint64_t character_id = 0;  // of the Character whose names and vertices these are
  AvatarFrame frame;
};

// What a renderer must know of a character before it can draw a mesh/ or name the values of a weights/ message.
struct Character {
  std::string name;                           // a topic level: see isTopicName
  std::vector<std::string> blendshape_names;  // AvatarFrame::weights are in this order
  std::vector<std::array<float, 3>> neutral;  // #V by 3, the character's own unit and frame; empty: weights only
  std::vector<std::array<std::uint32_t, 3>>
      triangles;  // #T by 3, 0-based vertex indices, counter-clockwise from outside
  struct Material {
    std::string name;
    std::array<float, 3> colour{0.8F, 0.8F, 0.8F};  // linear RGB 0..1
  };
  std::vector<Material> materials;
  std::vector<std::uint16_t> triangle_material;        // empty, or #T: index into materials
  std::vector<std::array<float, 2>> corner_texcoords;  // empty, or 3 per triangle, (0, 0) at the bottom left
  std::vector<std::uint32_t> corner_vertices;     // the artist's polygons, or empty: corners one after the other ...
  std::vector<std::uint32_t> polygon_start;       // ... #P + 1: polygon p is corners [start[p], start[p + 1])
  std::array<float, 3> left_eye_centre{0, 0, 0};  // same frame as neutral; the eyeball turns about it
  std::array<float, 3> right_eye_centre{0, 0, 0};
  // Rotation x, y, z, w from the head frame (+x subject's left, +y up, +z out of the face) to the frame of neutral.
  std::array<float, 4> mesh_from_head{0, 0, 0, 1};
  double units_per_mm = 0.0;  // 0: unknown
  bool has_mesh = false;      // mesh/NAME/ is published to those who subscribe
  bool has_gaze = false;      // the eyes of the mesh are separate and can be turned by gaze
};

// 64-bit content hash of everything in a Character: the same character gives the same id, run after run. FNV-1a, see
// README.md.
std::uint64_t characterId(const Character& character);

struct CharacterMessage {
  Stamp stamp;
  std::uint64_t character_id = 0;
  Character character;
};

// do not change the values: they are on the wire.
enum class PipelineState : std::uint8_t {
  starting = 0,
  running = 1,    // frames arrive
  no_signal = 2,  // no camera, or the source ended
  stalled = 3,    // the source is there but gives no frames
  paused = 4,
  stopping = 5
};

struct StageLatency {
  std::string name;  // "tracker", "retarget", "publish", ...
  std::uint64_t count = 0;
  double p50_us = 0.0;
  double p99_us = 0.0;
};

// Twice a second, whatever happens: silence is never mistaken for "no face". Counters run from the start of the
// publisher.
struct StatusReport {
  PipelineState state = PipelineState::starting;
  std::string source;                // what is being captured: "camera:/dev/video0", a file's name
  std::uint64_t frames_in = 0;       // from the source
  std::uint64_t frames_out = 0;      // to the sockets
  std::uint64_t dropped_driver = 0;  // lost before we saw them
  std::uint64_t dropped_decode = 0;  // could not be decoded
  std::uint64_t dropped_late = 0;    // replaced by a newer frame between stages (newest wins)
  std::uint64_t dropped_queue = 0;   // lost at the publisher's hand-over
  std::uint64_t deadline_misses = 0;
  std::uint64_t reconnects = 0;    // of the source
  std::uint64_t bad_messages = 0;  // from outside, refused
  std::uint64_t send_failures = 0;
  std::uint64_t messages_sent = 0;  // counted once, however many subscribers
  std::uint64_t bytes_sent = 0;
  std::uint32_t clients = 0;  // connections to the publisher now
  bool recording = false;
  std::uint64_t recorded_messages = 0;
  std::uint64_t dropped_recording = 0;
  std::string recording_error;  // empty: none
  std::vector<StageLatency> stages;
};

struct StatusMessage {
  Stamp stamp;
  StatusReport report;
};

}  // namespace volto::protocol
