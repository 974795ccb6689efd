#include "protocol/codec.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

#include <flatbuffers/flatbuffers.h>

#include "character_generated.h"
#include "landmarks_generated.h"
#include "mask_generated.h"
#include "mesh_generated.h"
#include "protocol/topics.h"
#include "protocol/validate.h"
#include "status_generated.h"
#include "weights_generated.h"

namespace volto::protocol {
namespace {

namespace fb = flatbuffers;
static_assert(std::endian::native == std::endian::little,
              "arrays are copied to and from the wire as they lie in memory");
static_assert(sizeof(wire::Vec2) == sizeof(std::array<float, 2>) &&
              sizeof(wire::Vec3) == sizeof(std::array<float, 3>) &&
              sizeof(wire::Triangle) == sizeof(std::array<std::uint32_t, 3>) && sizeof(wire::Stamp) == 48);

using Buffer = fb::FlatBufferBuilder;

constexpr std::size_t kMinMessageBytes = 8;  // root offset and identifier

std::size_t sizeLimit(MessageKind kind) { return kind == MessageKind::character ? kMaxCharacterBytes : kMaxFrameBytes; }

Result prefixed(MessageKind kind, const Result& result) {
  return result.ok() ? Result{} : Result::bad(std::string(kindName(kind)) + " message: " + result.problem);
}

// ---- structs
// -----------------------------------------------------------------------------------------------------------------

wire::Stamp toWire(const Stamp& s, std::uint64_t capture_seq, std::int64_t t_capture_ns) {
  return {s.epoch, s.seq, capture_seq, t_capture_ns, s.t_publish_ns, s.t_realtime_ns};
}

Stamp fromWire(const wire::Stamp& s) {
  return {s.epoch(), s.seq(), s.capture_seq(), s.t_capture_ns(), s.t_publish_ns(), s.t_realtime_ns()};
}

wire::Vec3 toWire(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<float, 3> fromWire(const wire::Vec3& v) { return {v.x(), v.y(), v.z()}; }
wire::Quaternion toWire(const std::array<float, 4>& q) { return {q[0], q[1], q[2], q[3]}; }
std::array<float, 4> fromWire(const wire::Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }

wire::HeadPose toWire(const HeadPose& h) {
  return {toWire(h.rotation), h.yaw_rad, h.pitch_rad, h.roll_rad, toWire(h.translation_mm), h.observed};
}

HeadPose fromWire(const wire::HeadPose& h) {
  return {fromWire(h.rotation()), h.yaw_rad(), h.pitch_rad(), h.roll_rad(), fromWire(h.translation_mm()), h.observed()};
}

wire::Gaze toWire(const Gaze& g) {
  return {g.left.yaw_rad, g.left.pitch_rad, g.right.yaw_rad, g.right.pitch_rad, g.confidence};
}

Gaze fromWire(const wire::Gaze& g) {
  return {{g.left_yaw_rad(), g.left_pitch_rad()}, {g.right_yaw_rad(), g.right_pitch_rad()}, g.confidence()};
}

// ---- vectors: a memcpy each way
// -------------------------------------------------------------------------------------------------

template <typename Wire, typename Plain>
fb::Offset<fb::Vector<const Wire*>> structsToWire(Buffer& buffer, const Plain& values) {
  if (values.empty()) return 0;
  return buffer.CreateVectorOfStructs(reinterpret_cast<const Wire*>(values.data()), values.size());
}

template <typename Scalar>
fb::Offset<fb::Vector<Scalar>> scalarsToWire(Buffer& buffer, std::span<const Scalar> values) {
  if (values.empty()) return 0;
  return buffer.CreateVector(values.data(), values.size());
}

template <typename Plain, typename Vector>
void copyAll(const Vector* from, std::vector<Plain>& to) {
  to.resize(from == nullptr ? 0 : from->size());
  if (!to.empty()) std::memcpy(to.data(), from->Data(), to.size() * sizeof(Plain));
}

template <typename Plain, std::size_t N, typename Vector>
bool copyExactly(const Vector* from, std::array<Plain, N>& to) {
  if (from->size() != N) return false;
  std::memcpy(to.data(), from->Data(), sizeof(to));
  return true;
}

// At most one byte more than the limit, which is enough for validate to refuse it: many offsets may point at one long
// string.
std::string textFrom(const fb::String* text, std::size_t limit) {
  return text == nullptr ? std::string() : std::string(text->c_str(), std::min<std::size_t>(text->size(), limit + 1));
}

// ---- bytes from outside
// ----------------------------------------------------------------------------------------------------------

template <typename Table>
struct TableOf;
template <>
struct TableOf<wire::Landmarks> {
  static constexpr MessageKind kind = MessageKind::landmarks;
};
template <>
struct TableOf<wire::Mask> {
  static constexpr MessageKind kind = MessageKind::mask;
};
template <>
struct TableOf<wire::Weights> {
  static constexpr MessageKind kind = MessageKind::weights;
};
template <>
struct TableOf<wire::Mesh> {
  static constexpr MessageKind kind = MessageKind::mesh;
};
template <>
struct TableOf<wire::Character> {
  static constexpr MessageKind kind = MessageKind::character;
};
template <>
struct TableOf<wire::Status> {
  static constexpr MessageKind kind = MessageKind::status;
};

constexpr std::array<const char*, kMessageKindCount> kIdentifiers{"VLMK", "VMSK", "VWGT", "VMSH", "VCHR", "VSTA"};

const char* identifier(MessageKind kind) { return kIdentifiers[static_cast<std::size_t>(kind)]; }

// The bytes on an 8-byte boundary, which is what reading them in place wants: copied only if they are not (ZeroMQ hands
// out any address).
class Aligned {
 public:
  explicit Aligned(Bytes bytes) : bytes_(bytes) {
    if (reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(std::uint64_t) == 0) return;
    copy_.resize((bytes.size() + 7) / 8);
    std::memcpy(copy_.data(), bytes.data(), bytes.size());
    bytes_ = {reinterpret_cast<const std::byte*>(copy_.data()), bytes.size()};
  }
  const std::uint8_t* data() const { return reinterpret_cast<const std::uint8_t*>(bytes_.data()); }
  std::size_t size() const { return bytes_.size(); }

 private:
  Bytes bytes_;
  std::vector<std::uint64_t> copy_;
};

template <typename Table>
Result verify(const Aligned& bytes) {
  const MessageKind kind = TableOf<Table>::kind;
  if (bytes.size() < kMinMessageBytes)
    return prefixed(kind, Result::bad(std::to_string(bytes.size()) + " bytes are too few"));
  if (bytes.size() > sizeLimit(kind))
    return prefixed(kind, Result::bad(std::to_string(bytes.size()) + " bytes are too many"));
  if (!fb::BufferHasIdentifier(bytes.data(), identifier(kind))) {
    return prefixed(kind, Result::bad(std::string("the identifier is not ") + identifier(kind)));
  }
  fb::Verifier::Options options;
  options.max_depth = 16;
  options.max_tables = 4096;
  fb::Verifier verifier(bytes.data(), bytes.size(), options);
  if (!verifier.VerifyBuffer<Table>(identifier(kind)))
    return prefixed(kind, Result::bad("the FlatBuffers Verifier refuses the bytes"));
  return {};
}

// Verifies, then lets `read` copy the table out; what it returns is the verdict.
template <typename Table, typename Read>
Result readTable(Bytes bytes, Stamp& stamp, Read read) {
  const Aligned aligned(bytes);
  if (Result r = verify<Table>(aligned); !r) return r;
  const Table& table = *fb::GetRoot<Table>(aligned.data());
  stamp = fromWire(*table.stamp());
  if (Result r = validate(stamp); !r) return prefixed(TableOf<Table>::kind, r);
  return prefixed(TableOf<Table>::kind, read(table));
}

template <typename Table>
void readPose(const Table& table, const Stamp& stamp, AvatarFrame& frame) {
  frame.t_capture_ns = stamp.t_capture_ns;
  frame.capture_seq = stamp.capture_seq;
  frame.state = static_cast<TrackingState>(table.state());
  frame.confidence = table.confidence();
  frame.head = fromWire(*table.head());
  frame.gaze = fromWire(*table.gaze());
}

}  // namespace

// ---- Encoder
// ---------------------------------------------------------------------------------------------------------------------

struct Encoder::State {
  explicit State(std::size_t expected_bytes) : buffer(expected_bytes) {}

  Buffer buffer;
  bool finished = false;
  fb::Offset<fb::Vector<const wire::Vec3*>> mesh_vertices;
  std::size_t mesh_count = 0;
  std::vector<fb::Offset<fb::String>> strings;

  void clear() {
    buffer.Clear();
    finished = false;
    mesh_count = 0;
  }

  template <typename Table>
  Result finish(fb::Offset<Table> root) {
    const MessageKind kind = TableOf<Table>::kind;
    buffer.Finish(root, identifier(kind));
    if (buffer.GetSize() > sizeLimit(kind)) {
      const std::string problem =
          std::to_string(buffer.GetSize()) + " bytes; the limit is " + std::to_string(sizeLimit(kind));
      clear();
      return prefixed(kind, Result::bad(problem));
    }
    finished = true;
    return {};
  }
};

Encoder::Encoder(std::size_t expected_bytes) : state_(std::make_unique<State>(expected_bytes)) {}
Encoder::~Encoder() = default;
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;

Bytes Encoder::bytes() const {
  if (!state_->finished) return {};
  return {reinterpret_cast<const std::byte*>(state_->buffer.GetBufferPointer()), state_->buffer.GetSize()};
}

void Encoder::restamp(std::uint64_t seq, std::int64_t t_publish_ns, std::int64_t t_realtime_ns) {
  if (!state_->finished) return;
  // Every table has its stamp as field 0, so any of the types finds it.
  auto* stamp = const_cast<wire::Stamp*>(fb::GetRoot<wire::Status>(state_->buffer.GetBufferPointer())->stamp());
  *stamp = wire::Stamp(stamp->epoch(), seq, stamp->capture_seq(), stamp->t_capture_ns(), t_publish_ns, t_realtime_ns);
}

Result Encoder::encode(const Stamp& stamp, const LandmarkFrame& frame) {
  State& s = *state_;
  s.clear();
  if (Result r = validate(frame); !r) return prefixed(MessageKind::landmarks, r);
  const bool points = frame.face_present;
  const auto px = points ? structsToWire<wire::Vec2>(s.buffer, frame.points_px) : 0;
  const auto mm = points ? structsToWire<wire::Vec3>(s.buffer, frame.points_camera_mm) : 0;
  const auto confidence = points ? scalarsToWire<float>(s.buffer, frame.point_confidence) : 0;
  const bool sees_pupils = points && (frame.pupils[0].confidence > 0 || frame.pupils[1].confidence > 0);
  const auto pupils = sees_pupils ? structsToWire<wire::Pupil>(s.buffer, frame.pupils) : 0;
  const wire::Stamp wire_stamp = toWire(stamp, frame.capture_seq, frame.t_capture_ns);
  return s.finish(wire::CreateLandmarks(s.buffer, &wire_stamp, static_cast<wire::LandmarkLayout>(frame.layout),
                                        frame.face_present, frame.confidence, frame.image_width_px,
                                        frame.image_height_px, frame.focal_length_px, px, mm, confidence, pupils));
}

Result Encoder::encode(const Stamp& stamp, const MaskFrame& frame) {
  State& s = *state_;
  s.clear();
  if (Result r = validate(frame); !r) return prefixed(MessageKind::mask, r);
  std::array<std::uint8_t, kArkitBlendshapeCount> observed{};
  for (std::size_t i = 0; i < observed.size(); ++i) observed[i] = frame.arkit_observed[i] ? 1 : 0;
  const auto displacement = structsToWire<wire::Vec3>(s.buffer, frame.displacement_fapu);
  const auto confidence = scalarsToWire<float>(s.buffer, frame.point_confidence);
  const auto weights = scalarsToWire<float>(s.buffer, frame.arkit_weights);
  const auto flags = scalarsToWire<std::uint8_t>(s.buffer, observed);
  const wire::Stamp wire_stamp = toWire(stamp, frame.capture_seq, frame.t_capture_ns);
  const wire::HeadPose head = toWire(frame.head);
  const wire::Gaze gaze = toWire(frame.gaze);
  return s.finish(wire::CreateMask(s.buffer, &wire_stamp, static_cast<wire::TrackingState>(frame.state),
                                   frame.confidence, displacement, confidence, &head, &gaze, weights, flags));
}

Result Encoder::encodeWeights(const Stamp& stamp, std::uint64_t character_id, const AvatarFrame& frame) {
  State& s = *state_;
  s.clear();
  if (Result r = validateWeights(frame); !r) return prefixed(MessageKind::weights, r);
  // A character without blendshapes still has a vector, of length 0.
  const auto weights = s.buffer.CreateVector(frame.weights);
  const auto observed = s.buffer.CreateVector(frame.observed);
  const wire::Stamp wire_stamp = toWire(stamp, frame.capture_seq, frame.t_capture_ns);
  const wire::HeadPose head = toWire(frame.head);
  const wire::Gaze gaze = toWire(frame.gaze);
  return s.finish(wire::CreateWeights(s.buffer, &wire_stamp, character_id,
                                      static_cast<wire::TrackingState>(frame.state), frame.confidence, &head, &gaze,
                                      weights, observed));
}

std::span<std::array<float, 3>> Encoder::beginMesh(std::size_t vertex_count) {
  State& s = *state_;
  s.clear();
  if (vertex_count == 0 || vertex_count > kMaxVertices) return {};
  std::uint8_t* vertices = nullptr;
  // Three floats a vertex, so that FlatBuffers aligns by 4; then the length is put right: the vector's elements are
  // Vec3.
  const auto offset = s.buffer.CreateUninitializedVector(vertex_count * 3, sizeof(float), &vertices);
  fb::WriteScalar(vertices - sizeof(fb::uoffset_t), static_cast<fb::uoffset_t>(vertex_count));
  s.mesh_vertices = fb::Offset<fb::Vector<const wire::Vec3*>>(offset);
  s.mesh_count = vertex_count;
  return {reinterpret_cast<std::array<float, 3>*>(vertices), vertex_count};
}

Result Encoder::finishMesh(const Stamp& stamp, std::uint64_t character_id, const AvatarFrame& frame) {
  State& s = *state_;
  if (Result r = validateMesh(frame, s.mesh_count); !r) {
    s.clear();
    return prefixed(MessageKind::mesh, r);
  }
  const wire::Stamp wire_stamp = toWire(stamp, frame.capture_seq, frame.t_capture_ns);
  const wire::HeadPose head = toWire(frame.head);
  const wire::Gaze gaze = toWire(frame.gaze);
  return s.finish(wire::CreateMesh(s.buffer, &wire_stamp, character_id, static_cast<wire::TrackingState>(frame.state),
                                   frame.confidence, &head, &gaze, s.mesh_vertices));
}

Result Encoder::encodeMesh(const Stamp& stamp, std::uint64_t character_id, const AvatarFrame& frame) {
  const std::span<std::array<float, 3>> vertices = beginMesh(frame.vertices.size());
  if (!vertices.empty()) std::memcpy(vertices.data(), frame.vertices.data(), vertices.size_bytes());
  return finishMesh(stamp, character_id, frame);
}

Result Encoder::encode(const Stamp& stamp, const Character& c) {
  State& s = *state_;
  s.clear();
  if (Result r = validate(c); !r) return prefixed(MessageKind::character, r);
  Buffer& b = s.buffer;
  const auto name = b.CreateString(c.name);
  s.strings.clear();
  for (const std::string& shape : c.blendshape_names) s.strings.push_back(b.CreateString(shape));
  const auto names = b.CreateVector(s.strings);
  std::vector<fb::Offset<wire::Material>> materials;
  for (const Character::Material& m : c.materials) {
    const wire::Vec3 colour = toWire(m.colour);
    materials.push_back(wire::CreateMaterial(b, b.CreateString(m.name), &colour));
  }
  const auto material_list = materials.empty() ? 0 : b.CreateVector(materials);
  const auto neutral = structsToWire<wire::Vec3>(b, c.neutral);
  const auto triangles = structsToWire<wire::Triangle>(b, c.triangles);
  const auto triangle_material = scalarsToWire<std::uint16_t>(b, c.triangle_material);
  const auto texcoords = structsToWire<wire::Vec2>(b, c.corner_texcoords);
  const auto corners = scalarsToWire<std::uint32_t>(b, c.corner_vertices);
  const auto polygons = scalarsToWire<std::uint32_t>(b, c.polygon_start);
  const wire::Stamp wire_stamp = toWire(stamp, stamp.capture_seq, stamp.t_capture_ns);
  const wire::Vec3 left = toWire(c.left_eye_centre);
  const wire::Vec3 right = toWire(c.right_eye_centre);
  const wire::Quaternion mesh_from_head = toWire(c.mesh_from_head);
  return s.finish(wire::CreateCharacter(b, &wire_stamp, characterId(c), name, names, neutral, triangles, material_list,
                                        triangle_material, texcoords, corners, polygons, &left, &right, &mesh_from_head,
                                        c.units_per_mm, c.has_mesh, c.has_gaze));
}

Result Encoder::encode(const Stamp& stamp, const StatusReport& r) {
  State& s = *state_;
  s.clear();
  if (Result verdict = validate(r); !verdict) return prefixed(MessageKind::status, verdict);
  Buffer& b = s.buffer;
  std::vector<fb::Offset<wire::StageLatency>> stages;
  for (const StageLatency& stage : r.stages) {
    stages.push_back(wire::CreateStageLatency(b, b.CreateString(stage.name), stage.count, stage.p50_us, stage.p99_us));
  }
  const auto stage_list = stages.empty() ? 0 : b.CreateVector(stages);
  const auto source = b.CreateString(r.source);
  const auto recording_error = b.CreateString(r.recording_error);
  const wire::Stamp wire_stamp = toWire(stamp, stamp.capture_seq, stamp.t_capture_ns);
  return s.finish(wire::CreateStatus(b, &wire_stamp, static_cast<wire::PipelineState>(r.state), source, r.frames_in,
                                     r.frames_out, r.dropped_driver, r.dropped_decode, r.dropped_late, r.dropped_queue,
                                     r.deadline_misses, r.reconnects, r.bad_messages, r.send_failures, r.messages_sent,
                                     r.bytes_sent, r.clients, r.recording, r.recorded_messages, r.dropped_recording,
                                     recording_error, stage_list));
}

// ---- decode
// ----------------------------------------------------------------------------------------------------------------------

Result decode(Bytes bytes, LandmarkMessage& out) {
  return readTable<wire::Landmarks>(bytes, out.stamp, [&](const wire::Landmarks& t) {
    LandmarkFrame& f = out.frame;
    f.t_capture_ns = out.stamp.t_capture_ns;
    f.capture_seq = out.stamp.capture_seq;
    f.layout = static_cast<LandmarkLayout>(t.layout());
    f.face_present = t.face_present();
    f.confidence = t.confidence();
    f.image_width_px = t.image_width_px();
    f.image_height_px = t.image_height_px();
    f.focal_length_px = t.focal_length_px();
    copyAll(t.points_px(), f.points_px);
    copyAll(t.points_camera_mm(), f.points_camera_mm);
    copyAll(t.point_confidence(), f.point_confidence);
    f.pupils = {};
    if (t.pupils() != nullptr && !copyExactly(t.pupils(), f.pupils))
      return Result::bad(std::to_string(t.pupils()->size()) + " pupils; a face has two");
    if (!f.face_present && !(f.points_px.empty() && f.points_camera_mm.empty() && f.point_confidence.empty())) {
      return Result::bad("points without a face");
    }
    return validate(f);
  });
}

Result decode(Bytes bytes, MaskMessage& out) {
  return readTable<wire::Mask>(bytes, out.stamp, [&](const wire::Mask& t) {
    MaskFrame& f = out.frame;
    f.t_capture_ns = out.stamp.t_capture_ns;
    f.capture_seq = out.stamp.capture_seq;
    f.state = static_cast<TrackingState>(t.state());
    f.confidence = t.confidence();
    f.head = fromWire(*t.head());
    f.gaze = fromWire(*t.gaze());
    std::array<std::uint8_t, kArkitBlendshapeCount> observed{};
    if (!copyExactly(t.displacement_fapu(), f.displacement_fapu) ||
        !copyExactly(t.point_confidence(), f.point_confidence)) {
      return Result::bad(std::to_string(t.displacement_fapu()->size()) + " displacements and " +
                         std::to_string(t.point_confidence()->size()) + " confidences; the mask has 84 points");
    }
    if (!copyExactly(t.arkit_weights(), f.arkit_weights) || !copyExactly(t.arkit_observed(), observed)) {
      return Result::bad(std::to_string(t.arkit_weights()->size()) + " ARKit weights and " +
                         std::to_string(t.arkit_observed()->size()) + " flags; there are 52");
    }
    for (std::size_t i = 0; i < observed.size(); ++i) {
      if (observed[i] > 1) return Result::bad("an observed flag is neither 0 nor 1");
      f.arkit_observed[i] = observed[i] == 1;
    }
    return validate(f);
  });
}

Result decodeWeights(Bytes bytes, AvatarMessage& out) {
  return readTable<wire::Weights>(bytes, out.stamp, [&](const wire::Weights& t) {
    out.character_id = t.character_id();
    readPose(t, out.stamp, out.frame);
    if (t.weights()->size() > kMaxBlendshapes || t.observed()->size() > kMaxBlendshapes)
      return Result::bad("too many weights");
    copyAll(t.weights(), out.frame.weights);
    copyAll(t.observed(), out.frame.observed);
    return validateWeights(out.frame);
  });
}

Result decodeMesh(Bytes bytes, AvatarMessage& out) {
  return readTable<wire::Mesh>(bytes, out.stamp, [&](const wire::Mesh& t) {
    out.character_id = t.character_id();
    readPose(t, out.stamp, out.frame);
    if (Result r = validateMesh(out.frame, t.vertices()->size()); !r) return r;
    copyAll(t.vertices(), out.frame.vertices);
    return allFinite(out.frame.vertices) ? Result{} : Result::bad("a vertex is not finite");
  });
}

Result decode(Bytes bytes, CharacterMessage& out) {
  return readTable<wire::Character>(bytes, out.stamp, [&](const wire::Character& t) {
    Character& c = out.character;
    out.character_id = t.character_id();
    c.name = textFrom(t.name(), kMaxNameBytes);
    c.blendshape_names.clear();
    if (t.blendshape_names()->size() > kMaxBlendshapes) return Result::bad("too many blendshapes");
    for (const fb::String* name : *t.blendshape_names()) c.blendshape_names.push_back(textFrom(name, kMaxNameBytes));
    c.materials.clear();
    if (t.materials() != nullptr) {
      if (t.materials()->size() > kMaxMaterials) return Result::bad("too many materials");
      for (const wire::Material* m : *t.materials()) {
        const wire::Vec3 grey(0.8F, 0.8F, 0.8F);
        c.materials.push_back(
            {textFrom(m->name(), kMaxNameBytes), fromWire(m->colour() == nullptr ? grey : *m->colour())});
      }
    }
    copyAll(t.neutral(), c.neutral);
    copyAll(t.triangles(), c.triangles);
    copyAll(t.triangle_material(), c.triangle_material);
    copyAll(t.corner_texcoords(), c.corner_texcoords);
    copyAll(t.corner_vertices(), c.corner_vertices);
    copyAll(t.polygon_start(), c.polygon_start);
    const wire::Vec3 origin(0, 0, 0);
    c.left_eye_centre = fromWire(t.left_eye_centre() == nullptr ? origin : *t.left_eye_centre());
    c.right_eye_centre = fromWire(t.right_eye_centre() == nullptr ? origin : *t.right_eye_centre());
    const wire::Quaternion identity(0, 0, 0, 1);
    c.mesh_from_head = fromWire(t.mesh_from_head() == nullptr ? identity : *t.mesh_from_head());
    c.units_per_mm = t.units_per_mm();
    c.has_mesh = t.has_mesh();
    c.has_gaze = t.has_gaze();
    if (Result r = validate(c); !r) return r;
    return out.character_id == characterId(c) ? Result{} : Result::bad("character_id is not the hash of the content");
  });
}

Result decode(Bytes bytes, StatusMessage& out) {
  return readTable<wire::Status>(bytes, out.stamp, [&](const wire::Status& t) {
    StatusReport& r = out.report;
    r.state = static_cast<PipelineState>(t.state());
    r.source = textFrom(t.source(), kMaxTextBytes);
    r.frames_in = t.frames_in();
    r.frames_out = t.frames_out();
    r.dropped_driver = t.dropped_driver();
    r.dropped_decode = t.dropped_decode();
    r.dropped_late = t.dropped_late();
    r.dropped_queue = t.dropped_queue();
    r.deadline_misses = t.deadline_misses();
    r.reconnects = t.reconnects();
    r.bad_messages = t.bad_messages();
    r.send_failures = t.send_failures();
    r.messages_sent = t.messages_sent();
    r.bytes_sent = t.bytes_sent();
    r.clients = t.clients();
    r.recording = t.recording();
    r.recorded_messages = t.recorded_messages();
    r.dropped_recording = t.dropped_recording();
    r.recording_error = textFrom(t.recording_error(), kMaxTextBytes);
    r.stages.clear();
    if (t.stages() != nullptr) {
      if (t.stages()->size() > kMaxStages) return Result::bad("too many stages");
      for (const wire::StageLatency* s : *t.stages())
        r.stages.push_back({textFrom(s->name(), kMaxNameBytes), s->count(), s->p50_us(), s->p99_us()});
    }
    return validate(r);
  });
}

std::optional<MessageKind> messageKind(Bytes bytes) {
  if (bytes.size() < kMinMessageBytes) return std::nullopt;
  for (std::size_t kind = 0; kind < kMessageKindCount; ++kind) {
    if (std::memcmp(bytes.data() + 4, kIdentifiers[kind], 4) == 0) return static_cast<MessageKind>(kind);
  }
  return std::nullopt;
}

Result decodeStamp(Bytes bytes, Stamp& out) {
  const std::optional<MessageKind> kind = messageKind(bytes);
  if (!kind) return Result::bad("not a message: unknown identifier");
  const auto nothingMore = [](const auto&) { return Result{}; };
  switch (*kind) {
    case MessageKind::landmarks:
      return readTable<wire::Landmarks>(bytes, out, nothingMore);
    case MessageKind::mask:
      return readTable<wire::Mask>(bytes, out, nothingMore);
    case MessageKind::weights:
      return readTable<wire::Weights>(bytes, out, nothingMore);
    case MessageKind::mesh:
      return readTable<wire::Mesh>(bytes, out, nothingMore);
    case MessageKind::character:
      return readTable<wire::Character>(bytes, out, nothingMore);
    case MessageKind::status:
      return readTable<wire::Status>(bytes, out, nothingMore);
  }
  return Result::bad("not a message: unknown identifier");
}

Result Inspector::checkMesh(Bytes bytes, Stamp& stamp) {
  return readTable<wire::Mesh>(bytes, stamp, [&](const wire::Mesh& t) {
    readPose(t, stamp, avatar_.frame);
    const std::size_t count = t.vertices()->size();
    if (Result r = validateMesh(avatar_.frame, count); !r) return r;
    const std::span<const float> values(reinterpret_cast<const float*>(t.vertices()->Data()), count * 3);
    return allFinite(values) ? Result{} : Result::bad("a vertex is not finite");
  });
}

Result Inspector::check(Bytes bytes, Stamp& stamp) {
  const std::optional<MessageKind> kind = messageKind(bytes);
  if (!kind) return Result::bad("not a message: unknown identifier");
  const auto verdict = [&](const Result& r, const Stamp& found) {
    stamp = found;
    return r;
  };
  switch (*kind) {
    case MessageKind::landmarks:
      return verdict(decode(bytes, landmarks_), landmarks_.stamp);
    case MessageKind::mask:
      return verdict(decode(bytes, mask_), mask_.stamp);
    case MessageKind::weights:
      return verdict(decodeWeights(bytes, avatar_), avatar_.stamp);
    case MessageKind::mesh:
      return verdict(decodeMesh(bytes, avatar_), avatar_.stamp);
    case MessageKind::character:
      return verdict(decode(bytes, character_), character_.stamp);
    case MessageKind::status:
      return verdict(decode(bytes, status_), status_.stamp);
  }
  return Result::bad("not a message: unknown identifier");
}

Result checkMessage(Bytes bytes, Stamp& stamp) { return Inspector().check(bytes, stamp); }

// ---- character id
// ----------------------------------------------------------------------------------------------------------------

namespace {

// FNV-1a, 64 bits (Fowler, Noll, Vo). Every array is preceded by its length, so that no two characters share a byte
// sequence.
class Hash {
 public:
  template <typename T>
  Hash& array(std::span<const T> values) {
    const auto length = static_cast<std::uint64_t>(values.size());
    bytes(&length, sizeof(length));
    bytes(values.data(), values.size_bytes());
    return *this;
  }
  Hash& text(std::string_view value) { return array(std::span<const char>(value.data(), value.size())); }
  template <typename T>
  Hash& value(const T& v) {
    bytes(&v, sizeof(v));
    return *this;
  }
  std::uint64_t get() const { return hash_; }

 private:
  void bytes(const void* data, std::size_t size) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) hash_ = (hash_ ^ p[i]) * 0x100000001B3ULL;
  }
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

template <typename T>
std::span<const T> all(const std::vector<T>& values) {
  return values;
}

}  // namespace

std::uint64_t characterId(const Character& c) {
  Hash hash;
  hash.text(c.name).value(static_cast<std::uint64_t>(c.blendshape_names.size()));
  for (const std::string& name : c.blendshape_names) hash.text(name);
  hash.array(all(c.neutral)).array(all(c.triangles)).value(static_cast<std::uint64_t>(c.materials.size()));
  for (const Character::Material& m : c.materials) hash.text(m.name).value(m.colour);
  hash.array(all(c.triangle_material))
      .array(all(c.corner_texcoords))
      .array(all(c.corner_vertices))
      .array(all(c.polygon_start));
  hash.value(c.left_eye_centre).value(c.right_eye_centre).value(c.mesh_from_head).value(c.units_per_mm);
  hash.value(static_cast<std::uint8_t>(c.has_mesh)).value(static_cast<std::uint8_t>(c.has_gaze));
  return hash.get();
}

}  // namespace volto::protocol
