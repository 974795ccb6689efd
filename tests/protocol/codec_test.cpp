#include "protocol/codec.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "protocol/topics.h"
#include "tests/protocol/samples.h"

namespace volto::protocol {
namespace {

using test::sampleAvatar;
using test::sampleCharacter;
using test::sampleLandmarks;
using test::sampleMask;
using test::sampleStamp;
using test::sampleStatus;

std::vector<std::byte> copyOf(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

// One message of each kind.
std::vector<std::vector<std::byte>> oneOfEach() {
  Encoder encoder;
  std::vector<std::vector<std::byte>> all;
  EXPECT_TRUE(encoder.encode(sampleStamp(), sampleLandmarks()).ok());
  all.push_back(copyOf(encoder.bytes()));
  EXPECT_TRUE(encoder.encode(sampleStamp(), sampleMask()).ok());
  all.push_back(copyOf(encoder.bytes()));
  EXPECT_TRUE(encoder.encodeWeights(sampleStamp(), 99, sampleAvatar()).ok());
  all.push_back(copyOf(encoder.bytes()));
  EXPECT_TRUE(encoder.encodeMesh(sampleStamp(), 99, sampleAvatar(1, 17)).ok());
  all.push_back(copyOf(encoder.bytes()));
  EXPECT_TRUE(encoder.encode(sampleStamp(), sampleCharacter()).ok());
  all.push_back(copyOf(encoder.bytes()));
  EXPECT_TRUE(encoder.encode(sampleStamp(), sampleStatus()).ok());
  all.push_back(copyOf(encoder.bytes()));
  return all;
}

void expectSameHead(const HeadPose& a, const HeadPose& b) {
  EXPECT_EQ(a.rotation, b.rotation);
  EXPECT_EQ(a.yaw_rad, b.yaw_rad);
  EXPECT_EQ(a.pitch_rad, b.pitch_rad);
  EXPECT_EQ(a.roll_rad, b.roll_rad);
  EXPECT_EQ(a.translation_mm, b.translation_mm);
  EXPECT_EQ(a.observed, b.observed);
}

void expectSameGaze(const Gaze& a, const Gaze& b) {
  EXPECT_EQ(a.left.yaw_rad, b.left.yaw_rad);
  EXPECT_EQ(a.left.pitch_rad, b.left.pitch_rad);
  EXPECT_EQ(a.right.yaw_rad, b.right.yaw_rad);
  EXPECT_EQ(a.right.pitch_rad, b.right.pitch_rad);
  EXPECT_EQ(a.confidence, b.confidence);
}

TEST(CodecTest, LandmarksComeBackAsTheyWent) {
  const LandmarkFrame sent = sampleLandmarks(5);
  Encoder encoder;
  ASSERT_TRUE(encoder.encode(sampleStamp(), sent).ok());
  LandmarkMessage got;
  const Result r = decode(encoder.bytes(), got);
  ASSERT_TRUE(r.ok()) << r.problem;
  EXPECT_EQ(got.stamp.epoch, 0x0123456789ABCDEFULL);
  EXPECT_EQ(got.stamp.seq, 7U);
  EXPECT_EQ(got.stamp.capture_seq, 5U);
  EXPECT_EQ(got.stamp.t_capture_ns, sent.t_capture_ns);
  EXPECT_EQ(got.stamp.t_publish_ns, 2'000'000'000);
  EXPECT_EQ(got.stamp.t_realtime_ns, 1'700'000'000'000'000'000);
  EXPECT_EQ(got.frame.t_capture_ns, sent.t_capture_ns);
  EXPECT_EQ(got.frame.capture_seq, sent.capture_seq);
  EXPECT_EQ(got.frame.layout, sent.layout);
  EXPECT_TRUE(got.frame.face_present);
  EXPECT_EQ(got.frame.confidence, sent.confidence);
  EXPECT_EQ(got.frame.image_width_px, 1280);
  EXPECT_EQ(got.frame.image_height_px, 720);
  EXPECT_EQ(got.frame.focal_length_px, 1100.5);
  EXPECT_EQ(got.frame.points_px, sent.points_px);
  EXPECT_EQ(got.frame.points_camera_mm, sent.points_camera_mm);
  EXPECT_EQ(got.frame.point_confidence, sent.point_confidence);
  for (std::size_t eye = 0; eye < 2; ++eye) {
    EXPECT_EQ(got.frame.pupils[eye].x_px, sent.pupils[eye].x_px);
    EXPECT_EQ(got.frame.pupils[eye].y_px, sent.pupils[eye].y_px);
    EXPECT_EQ(got.frame.pupils[eye].confidence, sent.pupils[eye].confidence);
  }
}

TEST(CodecTest, EveryLayoutComesBack) {
  for (const LandmarkLayout layout :
       {LandmarkLayout::ibug68, LandmarkLayout::openseeface66, LandmarkLayout::mediapipe478}) {
    LandmarkFrame sent = sampleLandmarks();
    sent.layout = layout;
    sent.points_px.assign(landmarkCount(layout), {1.5F, 2.5F});
    sent.points_camera_mm.clear();
    sent.point_confidence.clear();
    Encoder encoder;
    ASSERT_TRUE(encoder.encode(sampleStamp(), sent).ok());
    LandmarkMessage got;
    ASSERT_TRUE(decode(encoder.bytes(), got).ok());
    EXPECT_EQ(got.frame.layout, layout);
    EXPECT_EQ(got.frame.points_px.size(), landmarkCount(layout));
    EXPECT_TRUE(got.frame.points_camera_mm.empty());
  }
}

TEST(CodecTest, WithoutAFaceNoPointsTravel) {
  LandmarkFrame sent = sampleLandmarks();
  sent.face_present = false;  // its points are stale
  Encoder encoder;
  ASSERT_TRUE(encoder.encode(sampleStamp(), sent).ok());
  LandmarkMessage got;
  got.frame = sampleLandmarks();
  ASSERT_TRUE(decode(encoder.bytes(), got).ok());
  EXPECT_FALSE(got.frame.face_present);
  EXPECT_TRUE(got.frame.points_px.empty());
}

TEST(CodecTest, MaskComesBackAsItWent) {
  const MaskFrame sent = sampleMask(3);
  Encoder encoder;
  ASSERT_TRUE(encoder.encode(sampleStamp(), sent).ok());
  MaskMessage got;
  const Result r = decode(encoder.bytes(), got);
  ASSERT_TRUE(r.ok()) << r.problem;
  EXPECT_EQ(got.frame.t_capture_ns, sent.t_capture_ns);
  EXPECT_EQ(got.frame.capture_seq, 3U);
  EXPECT_EQ(got.frame.state, TrackingState::holding);
  EXPECT_EQ(got.frame.confidence, 0.5F);
  EXPECT_EQ(got.frame.displacement_fapu, sent.displacement_fapu);
  EXPECT_EQ(got.frame.point_confidence, sent.point_confidence);
  EXPECT_EQ(got.frame.arkit_weights, sent.arkit_weights);
  EXPECT_EQ(got.frame.arkit_observed, sent.arkit_observed);
  expectSameHead(got.frame.head, sent.head);
  expectSameGaze(got.frame.gaze, sent.gaze);
}

TEST(CodecTest, WeightsAndMeshOfOneMomentMeetInOneFrame) {
  const AvatarFrame sent = sampleAvatar(9, 23);
  Encoder encoder;
  AvatarMessage got;
  ASSERT_TRUE(encoder.encodeWeights(sampleStamp(), 42, sent).ok());
  ASSERT_TRUE(decodeWeights(encoder.bytes(), got).ok());
  ASSERT_TRUE(encoder.encodeMesh(sampleStamp(), 42, sent).ok());
  ASSERT_TRUE(decodeMesh(encoder.bytes(), got).ok());
  EXPECT_EQ(got.character_id, 42U);
  EXPECT_EQ(got.frame.weights, sent.weights);
  EXPECT_EQ(got.frame.observed, sent.observed);
  EXPECT_EQ(got.frame.vertices, sent.vertices);
  EXPECT_EQ(got.frame.state, sent.state);
  EXPECT_EQ(got.frame.capture_seq, 9U);
  expectSameHead(got.frame.head, sent.head);
  expectSameGaze(got.frame.gaze, sent.gaze);
}

TEST(CodecTest, MeshWrittenInPlaceIsTheMeshThatWasCopied) {
  const AvatarFrame sent = sampleAvatar(9, 1001);
  Encoder copied, in_place;
  ASSERT_TRUE(copied.encodeMesh(sampleStamp(), 42, sent).ok());
  const std::span<std::array<float, 3>> vertices = in_place.beginMesh(sent.vertices.size());
  ASSERT_EQ(vertices.size(), sent.vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i] = sent.vertices[i];
  ASSERT_TRUE(in_place.finishMesh(sampleStamp(), 42, sent).ok());
  EXPECT_EQ(copyOf(copied.bytes()), copyOf(in_place.bytes()));
}

TEST(CodecTest, CharacterComesBackWithItsId) {
  const Character sent = sampleCharacter();
  Encoder encoder;
  ASSERT_TRUE(encoder.encode(sampleStamp(), sent).ok());
  CharacterMessage got;
  const Result r = decode(encoder.bytes(), got);
  ASSERT_TRUE(r.ok()) << r.problem;
  EXPECT_EQ(got.character_id, characterId(sent));
  EXPECT_EQ(characterId(got.character), characterId(sent));
  EXPECT_EQ(got.character.name, "anna");
  EXPECT_EQ(got.character.blendshape_names, sent.blendshape_names);
  EXPECT_EQ(got.character.neutral, sent.neutral);
  EXPECT_EQ(got.character.triangles, sent.triangles);
  ASSERT_EQ(got.character.materials.size(), 2U);
  EXPECT_EQ(got.character.materials[1].name, "eyes");
  EXPECT_EQ(got.character.materials[1].colour, sent.materials[1].colour);
  EXPECT_EQ(got.character.triangle_material, sent.triangle_material);
  EXPECT_EQ(got.character.corner_texcoords, sent.corner_texcoords);
  EXPECT_EQ(got.character.corner_vertices, sent.corner_vertices);
  EXPECT_EQ(got.character.polygon_start, sent.polygon_start);
  EXPECT_EQ(got.character.left_eye_centre, sent.left_eye_centre);
  EXPECT_EQ(got.character.right_eye_centre, sent.right_eye_centre);
  EXPECT_EQ(got.character.units_per_mm, 0.1);
  EXPECT_TRUE(got.character.has_mesh);
  EXPECT_TRUE(got.character.has_gaze);
}

TEST(CodecTest, AnyChangeOfACharacterChangesItsId) {
  const std::uint64_t id = characterId(sampleCharacter());
  EXPECT_EQ(id, characterId(sampleCharacter()));
  Character moved = sampleCharacter();
  moved.neutral[2][1] = std::nextafter(moved.neutral[2][1], 2.0F);
  Character renamed = sampleCharacter();
  renamed.blendshape_names[3] += "x";
  Character shifted = sampleCharacter();  // the same letters, cut elsewhere
  shifted.blendshape_names[0] += shifted.blendshape_names[1].front();
  shifted.blendshape_names[1].erase(0, 1);
  Character without_gaze = sampleCharacter();
  without_gaze.has_gaze = false;
  for (const Character& other : {moved, renamed, shifted, without_gaze}) EXPECT_NE(characterId(other), id);
}

TEST(CodecTest, StatusComesBackAsItWent) {
  const StatusReport sent = sampleStatus();
  Encoder encoder;
  ASSERT_TRUE(encoder.encode(sampleStamp(), sent).ok());
  StatusMessage got;
  const Result r = decode(encoder.bytes(), got);
  ASSERT_TRUE(r.ok()) << r.problem;
  const StatusReport& s = got.report;
  EXPECT_EQ(s.state, PipelineState::stalled);
  EXPECT_EQ(s.source, sent.source);
  const std::vector<std::uint64_t> counters{s.frames_in,    s.frames_out,    s.dropped_driver,  s.dropped_decode,
                                            s.dropped_late, s.dropped_queue, s.deadline_misses, s.reconnects,
                                            s.bad_messages, s.send_failures, s.messages_sent,   s.bytes_sent};
  for (std::size_t i = 0; i < counters.size(); ++i) EXPECT_EQ(counters[i], 1001 + i);
  EXPECT_EQ(s.clients, 13U);
  EXPECT_TRUE(s.recording);
  EXPECT_EQ(s.recorded_messages, 1014U);
  EXPECT_EQ(s.dropped_recording, 1015U);
  EXPECT_EQ(s.recording_error, "disk full");
  ASSERT_EQ(s.stages.size(), 2U);
  EXPECT_EQ(s.stages[0].name, "tracker");
  EXPECT_EQ(s.stages[0].count, 1001U);
  EXPECT_EQ(s.stages[0].p50_us, 310.5);
  EXPECT_EQ(s.stages[0].p99_us, 900.25);
}

TEST(CodecTest, StampIsWrittenInPlace) {
  Encoder encoder;
  ASSERT_TRUE(encoder.encodeWeights(sampleStamp(), 1, sampleAvatar(4)).ok());
  encoder.restamp(77, 5'000, 6'000);
  AvatarMessage got;
  ASSERT_TRUE(decodeWeights(encoder.bytes(), got).ok());
  EXPECT_EQ(got.stamp.seq, 77U);
  EXPECT_EQ(got.stamp.t_publish_ns, 5'000);
  EXPECT_EQ(got.stamp.t_realtime_ns, 6'000);
  EXPECT_EQ(got.stamp.capture_seq, 4U);
  EXPECT_EQ(got.stamp.epoch, 0x0123456789ABCDEFULL);
}

TEST(CodecTest, SameFrameSameBytes) {
  EXPECT_EQ(oneOfEach(), oneOfEach());
  Encoder used;
  ASSERT_TRUE(used.encodeMesh(sampleStamp(), 99, sampleAvatar(8, 500)).ok());
  ASSERT_TRUE(used.encodeWeights(sampleStamp(), 99, sampleAvatar()).ok());
  EXPECT_EQ(copyOf(used.bytes()), oneOfEach()[2]) << "what the encoder did before must not show";
}

TEST(CodecTest, BytesAtAnyAddressAreRead) {
  for (const std::vector<std::byte>& message : oneOfEach()) {
    std::vector<std::byte> shifted(message.size() + 16);
    for (std::size_t offset = 0; offset < 9; ++offset) {
      std::memcpy(shifted.data() + offset, message.data(), message.size());
      Stamp stamp;
      const Result r = checkMessage(Bytes(shifted).subspan(offset, message.size()), stamp);
      EXPECT_TRUE(r.ok()) << r.problem;
      EXPECT_EQ(stamp.seq, 7U);
    }
  }
}

// ---- frames that may not be sent
// --------------------------------------------------------------------------------------------------

TEST(CodecTest, FramesWithWrongCountsAreNotSent) {
  Encoder encoder;
  LandmarkFrame landmarks = sampleLandmarks();
  landmarks.points_px.pop_back();
  EXPECT_EQ(encoder.encode(sampleStamp(), landmarks).problem, "landmarks message: 67 points, but its layout has 68");
  EXPECT_TRUE(encoder.bytes().empty());
  landmarks = sampleLandmarks();
  landmarks.points_camera_mm.pop_back();
  EXPECT_FALSE(encoder.encode(sampleStamp(), landmarks).ok());
  AvatarFrame avatar = sampleAvatar();
  avatar.observed.pop_back();
  EXPECT_EQ(encoder.encodeWeights(sampleStamp(), 1, avatar).problem,
            "weights message: 52 weights, but 51 observed flags");
  EXPECT_FALSE(encoder.encodeMesh(sampleStamp(), 1, sampleAvatar()).ok()) << "a mesh without vertices";
  AvatarFrame huge = sampleAvatar();
  huge.vertices.resize(kMaxVertices + 1);
  EXPECT_FALSE(encoder.encodeMesh(sampleStamp(), 1, huge).ok());
}

TEST(CodecTest, WhatIsNotFiniteIsNotSent) {
  Encoder encoder;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
    LandmarkFrame landmarks = sampleLandmarks();
    landmarks.points_px[67][1] = bad;
    EXPECT_FALSE(encoder.encode(sampleStamp(), landmarks).ok());
    landmarks = sampleLandmarks();
    landmarks.confidence = bad;
    EXPECT_FALSE(encoder.encode(sampleStamp(), landmarks).ok());
    MaskFrame mask = sampleMask();
    mask.displacement_fapu[83][2] = bad;
    EXPECT_FALSE(encoder.encode(sampleStamp(), mask).ok());
    mask = sampleMask();
    mask.head.translation_mm[2] = bad;
    EXPECT_FALSE(encoder.encode(sampleStamp(), mask).ok());
    AvatarFrame avatar = sampleAvatar();
    avatar.weights[51] = bad;
    EXPECT_FALSE(encoder.encodeWeights(sampleStamp(), 1, avatar).ok());
    avatar = sampleAvatar();
    avatar.gaze.right.pitch_rad = bad;
    EXPECT_FALSE(encoder.encodeWeights(sampleStamp(), 1, avatar).ok());
    Character character = sampleCharacter();
    character.neutral[1][0] = bad;
    EXPECT_FALSE(encoder.encode(sampleStamp(), character).ok());
  }
}

TEST(CodecTest, CharacterThatDoesNotHoldTogetherIsNotSent) {
  Encoder encoder;
  Character c = sampleCharacter();
  c.triangles[1][2] = 5;
  EXPECT_EQ(encoder.encode(sampleStamp(), c).problem, "character message: triangle corner 5 of 5 vertices");
  c = sampleCharacter();
  c.name = "a/b";
  EXPECT_FALSE(encoder.encode(sampleStamp(), c).ok());
  c = sampleCharacter();
  c.triangle_material[0] = 2;
  EXPECT_FALSE(encoder.encode(sampleStamp(), c).ok());
  c = sampleCharacter();
  c.polygon_start.back() = 3;
  EXPECT_FALSE(encoder.encode(sampleStamp(), c).ok());
  c = sampleCharacter();
  c.corner_texcoords.pop_back();
  EXPECT_FALSE(encoder.encode(sampleStamp(), c).ok());
  c = sampleCharacter();
  c.mesh_from_head = {0, 0, 0, 0};
  EXPECT_FALSE(encoder.encode(sampleStamp(), c).ok());
  c = sampleCharacter();
  c.blendshape_names[7] = std::string(kMaxNameBytes + 1, 'x');
  EXPECT_FALSE(encoder.encode(sampleStamp(), c).ok());
}

// ---- bytes that may not be accepted
// -----------------------------------------------------------------------------------------------

Result checkAs(std::size_t kind, Bytes bytes) {
  LandmarkMessage landmarks;
  MaskMessage mask;
  AvatarMessage avatar;
  CharacterMessage character;
  StatusMessage status;
  switch (kind) {
    case 0:
      return decode(bytes, landmarks);
    case 1:
      return decode(bytes, mask);
    case 2:
      return decodeWeights(bytes, avatar);
    case 3:
      return decodeMesh(bytes, avatar);
    case 4:
      return decode(bytes, character);
    default:
      return decode(bytes, status);
  }
}

TEST(CodecTest, EmptyAndTinyMessagesAreRefused) {
  const std::vector<std::byte> zeros(64);
  for (std::size_t kind = 0; kind < kMessageKindCount; ++kind) {
    for (std::size_t size = 0; size <= zeros.size(); ++size) EXPECT_FALSE(checkAs(kind, Bytes(zeros).first(size)).ok());
  }
  EXPECT_EQ(checkAs(2, {}).problem, "weights message: 0 bytes are too few");
}

TEST(CodecTest, MessageOfAnotherKindIsRefused) {
  const auto all = oneOfEach();
  for (std::size_t kind = 0; kind < all.size(); ++kind) {
    for (std::size_t as = 0; as < all.size(); ++as) EXPECT_EQ(checkAs(as, all[kind]).ok(), as == kind);
    EXPECT_EQ(messageKind(all[kind]), static_cast<MessageKind>(kind));
  }
  EXPECT_EQ(checkAs(3, all[2]).problem, "mesh message: the identifier is not VMSH");
}

TEST(CodecTest, OversizeMessageIsRefusedBeforeItIsRead) {
  std::vector<std::byte> message = oneOfEach()[3];
  message.resize(kMaxFrameBytes + 1);
  EXPECT_EQ(checkAs(3, message).problem, "mesh message: 4194305 bytes are too many");
}

TEST(CodecTest, EveryCutMessageIsRefused) {
  const auto all = oneOfEach();
  for (std::size_t kind = 0; kind < all.size(); ++kind) {
    for (std::size_t size = 0; size < all[kind].size(); ++size) {
      // Zeros behind the last string are padding and say nothing.
      if (std::all_of(all[kind].begin() + static_cast<std::ptrdiff_t>(size), all[kind].end(),
                      [](std::byte b) { return b == std::byte{0}; })) {
        continue;
      }
      // From a fresh block of just that size, so that a read beyond it is seen by the address sanitizer.
      const std::vector<std::byte> cut(all[kind].begin(), all[kind].begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_FALSE(checkAs(kind, cut).ok())
          << kindName(static_cast<MessageKind>(kind)) << " cut to " << size << " bytes";
    }
  }
}

TEST(CodecTest, MutatedMessagesAreRefusedOrWellFormed) {
  const auto all = oneOfEach();
  std::mt19937 random(20'260'101);
  std::size_t refused = 0, accepted = 0;
  for (int round = 0; round < 6000; ++round) {
    const std::size_t kind = random() % all.size();
    std::vector<std::byte> mutant = all[kind];
    for (std::size_t changes = 1 + random() % 8; changes > 0; --changes) {
      // Near the front lie the offsets, where a change hurts most.
      const std::size_t range = random() % 2 == 0 ? std::min<std::size_t>(96, mutant.size()) : mutant.size();
      const std::size_t at = random() % range;
      switch (random() % 4) {
        case 0:
          mutant[at] = static_cast<std::byte>(random());
          break;
        case 1:
          mutant[at] ^= static_cast<std::byte>(1U << (random() % 8));
          break;
        case 2:
          mutant[at] = std::byte{0xFF};
          break;
        default: {
          const auto word = static_cast<std::uint32_t>(random() % 3 == 0 ? 0xFFFFFFFFU : random());
          std::memcpy(mutant.data() + at, &word, std::min(sizeof(word), mutant.size() - at));
        }
      }
    }
    Stamp stamp;
    const Result r = checkMessage(mutant, stamp);
    ++(r.ok() ? accepted : refused);
    if (r.ok()) {
      EXPECT_NE(stamp.seq, 0U);
      EXPECT_GE(stamp.t_capture_ns, 0);
    } else {
      EXPECT_FALSE(r.problem.empty());
    }
  }
  // Both happen: most changes hit a number that may be another number.
  EXPECT_GT(refused, 1000U);
  EXPECT_GT(accepted, 100U);
}

// Puts other bytes in place of the only occurrence of some.
template <typename T>
std::vector<std::byte> withReplaced(std::vector<std::byte> message, const T& from, const T& to) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* needle = reinterpret_cast<const std::byte*>(&from);
  const auto at = std::search(message.begin(), message.end(), needle, needle + sizeof(T));
  EXPECT_NE(at, message.end());
  if (at != message.end()) std::memcpy(&*at, &to, sizeof(T));
  return message;
}

TEST(CodecTest, WellFormedBytesThatMeanNothingAreRefused) {
  const auto all = oneOfEach();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(checkAs(2, withReplaced(all[2], 17.0F / 64, nan)).problem,
            "weights message: a weight is not a finite number in -16..16");
  EXPECT_EQ(checkAs(2, withReplaced(all[2], 17.0F / 64, 17.0F)).problem,
            "weights message: a weight is not a finite number in -16..16");
  EXPECT_EQ(checkAs(3, withReplaced(all[3], 16.25F, nan)).problem, "mesh message: a vertex is not finite");
  EXPECT_EQ(checkAs(0, withReplaced(all[0], 667.0F, nan)).problem, "landmarks message: a landmark is not finite");
  EXPECT_EQ(checkAs(0, withReplaced(all[0], 1280, -1)).problem, "landmarks message: image size out of range");
  EXPECT_EQ(checkAs(2, withReplaced(all[2], 0.875F, 1.5F)).problem, "weights message: confidence is not in 0..1");
  EXPECT_EQ(checkAs(2, withReplaced(all[2], std::uint64_t{7}, std::uint64_t{0})).problem,
            "weights message: sequence number out of range");
  EXPECT_EQ(checkAs(2, withReplaced(all[2], std::int64_t{2'000'000'000}, std::int64_t{-1})).problem,
            "weights message: negative time");
  EXPECT_EQ(checkAs(4, withReplaced(all[4], 40.0F, 41.0F)).problem,
            "character message: character_id is not the hash of the content");
}

TEST(CodecTest, LengthsBeyondTheMessageAreRefused) {
  // The length of the vector of 17 vertices and of the 52 weights.
  const auto all = oneOfEach();
  for (const std::uint32_t length : {18U, 1'000'000U, 0xFFFFFFFFU, 0x55555556U}) {
    EXPECT_FALSE(checkAs(3, withReplaced(all[3], std::uint32_t{17}, length)).ok());
  }
  EXPECT_FALSE(checkAs(1, withReplaced(all[1], std::uint32_t{84}, std::uint32_t{83})).ok()) << "83 points are no mask";
}

}  // namespace
}  // namespace volto::protocol
