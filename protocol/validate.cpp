#include "protocol/validate.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "protocol/topics.h"

namespace volto::protocol {
namespace {

// Beyond this a weight is no weight (a character's own shapes may be overdriven or signed).
constexpr float kMaxWeight = 16.0F;

std::string count(std::size_t n, const char* what) { return std::to_string(n) + " " + what; }

Result confidenceOf(float confidence) {
  if (!(confidence >= 0.0F && confidence <= 1.0F)) return Result::bad("confidence is not in 0..1");
  return {};
}

Result stateOf(TrackingState state) {
  if (static_cast<unsigned>(state) > static_cast<unsigned>(TrackingState::easing))
    return Result::bad("unknown tracking state");
  return {};
}

Result rotationOf(const std::array<float, 4>& rotation, const char* what) {
  float norm = 0.0F;
  for (const float v : rotation) norm += v * v;
  if (!(norm > 0.98F && norm < 1.02F)) return Result::bad(std::string(what) + " is not a unit quaternion");
  return {};
}

Result headOf(const HeadPose& head) {
  const std::array<float, 6> rest{head.yaw_rad,           head.pitch_rad,         head.roll_rad,
                                  head.translation_mm[0], head.translation_mm[1], head.translation_mm[2]};
  if (!allFinite(rest)) return Result::bad("head pose is not finite");
  return rotationOf(head.rotation, "head rotation");
}

Result gazeOf(const Gaze& gaze) {
  const std::array<float, 5> values{gaze.left.yaw_rad, gaze.left.pitch_rad, gaze.right.yaw_rad, gaze.right.pitch_rad,
                                    gaze.confidence};
  if (!allFinite(values)) return Result::bad("gaze is not finite");
  return {};
}

Result captureOf(std::int64_t t_capture_ns) {
  if (t_capture_ns < 0) return Result::bad("capture time is negative");
  return {};
}

Result weightsOf(std::span<const float> weights, const char* what) {
  for (const float w : weights) {
    if (!(w >= -kMaxWeight && w <= kMaxWeight))
      return Result::bad(std::string(what) + " is not a finite number in -16..16");
  }
  return {};
}

bool isPlainText(std::string_view text, std::size_t limit) {
  return text.size() <= limit && std::all_of(text.begin(), text.end(),
                                             [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7F; });
}

// The first check that fails.
template <typename... Checks>
Result firstProblem(Checks... checks) {
  Result verdict;
  (void)((verdict = checks(), verdict.ok()) && ...);
  return verdict;
}

}  // namespace

bool allFinite(std::span<const float> values) {
  // Without a branch per value, so that the compiler makes it 8 or 16 at a time: adding one to an exponent of all ones
  // carries into the sign.
  std::uint32_t carried = 0;
  for (const float value : values) carried |= (std::bit_cast<std::uint32_t>(value) & 0x7FFFFFFFU) + 0x00800000U;
  return (carried & 0x80000000U) == 0;
}

bool allFinite(std::span<const std::array<float, 2>> values) {
  return values.empty() || allFinite(std::span<const float>(values.front().data(), values.size() * 2));
}

bool allFinite(std::span<const std::array<float, 3>> values) {
  return values.empty() || allFinite(std::span<const float>(values.front().data(), values.size() * 3));
}

Result validate(const Stamp& stamp) {
  if (stamp.seq == 0 || stamp.seq == std::numeric_limits<std::uint64_t>::max())
    return Result::bad("sequence number out of range");
  if (stamp.t_capture_ns < 0 || stamp.t_publish_ns < 0) return Result::bad("negative time");
  return {};
}

Result validate(const LandmarkFrame& frame) {
  const std::size_t expected = landmarkCount(frame.layout);
  if (expected == 0) return Result::bad("unknown landmark layout " + std::to_string(static_cast<int>(frame.layout)));
  if (Result r = captureOf(frame.t_capture_ns); !r) return r;
  if (Result r = confidenceOf(frame.confidence); !r) return r;
  constexpr int kMaxSidePx = 65'535;
  if (frame.image_width_px < 0 || frame.image_width_px > kMaxSidePx || frame.image_height_px < 0 ||
      frame.image_height_px > kMaxSidePx) {
    return Result::bad("image size out of range");
  }
  if (!(frame.focal_length_px >= 0.0 && frame.focal_length_px < 1e7)) return Result::bad("focal length out of range");
  if (!frame.face_present) return {};
  if (frame.points_px.size() != expected) {
    return Result::bad(count(frame.points_px.size(), "points, but its layout has ") + std::to_string(expected));
  }
  if (!frame.points_camera_mm.empty() && frame.points_camera_mm.size() != expected) {
    return Result::bad(count(frame.points_camera_mm.size(), "3D points, but its layout has ") +
                       std::to_string(expected));
  }
  if (!frame.point_confidence.empty() && frame.point_confidence.size() != expected) {
    return Result::bad(count(frame.point_confidence.size(), "point confidences, but its layout has ") +
                       std::to_string(expected));
  }
  if (!allFinite(frame.points_px) || !allFinite(frame.points_camera_mm) || !allFinite(frame.point_confidence)) {
    return Result::bad("a landmark is not finite");
  }
  for (const Pupil& pupil : frame.pupils) {
    if (!std::isfinite(pupil.x_px) || !std::isfinite(pupil.y_px)) return Result::bad("a pupil is not finite");
    if (Result r = confidenceOf(pupil.confidence); !r) return r;
  }
  return {};
}

Result validate(const MaskFrame& frame) {
  if (!allFinite(frame.displacement_fapu)) return Result::bad("a displacement is not finite");
  if (!allFinite(frame.point_confidence)) return Result::bad("a point confidence is not finite");
  return firstProblem([&] { return captureOf(frame.t_capture_ns); }, [&] { return stateOf(frame.state); },
                      [&] { return confidenceOf(frame.confidence); }, [&] { return headOf(frame.head); },
                      [&] { return gazeOf(frame.gaze); },
                      [&] { return weightsOf(frame.arkit_weights, "an ARKit weight"); });
}

Result validateWeights(const AvatarFrame& frame) {
  if (frame.weights.size() > kMaxBlendshapes) return Result::bad(count(frame.weights.size(), "weights: too many"));
  if (frame.observed.size() != frame.weights.size()) {
    return Result::bad(count(frame.weights.size(), "weights, but ") + count(frame.observed.size(), "observed flags"));
  }
  if (std::any_of(frame.observed.begin(), frame.observed.end(), [](std::uint8_t v) { return v > 1; })) {
    return Result::bad("an observed flag is neither 0 nor 1");
  }
  return firstProblem([&] { return captureOf(frame.t_capture_ns); }, [&] { return stateOf(frame.state); },
                      [&] { return confidenceOf(frame.confidence); }, [&] { return headOf(frame.head); },
                      [&] { return gazeOf(frame.gaze); }, [&] { return weightsOf(frame.weights, "a weight"); });
}

Result validateMesh(const AvatarFrame& frame, std::size_t vertex_count) {
  if (vertex_count == 0 || vertex_count > kMaxVertices) {
    return Result::bad(count(vertex_count, "vertices; a mesh message holds 1 to ") + std::to_string(kMaxVertices));
  }
  return firstProblem([&] { return captureOf(frame.t_capture_ns); }, [&] { return stateOf(frame.state); },
                      [&] { return confidenceOf(frame.confidence); }, [&] { return headOf(frame.head); },
                      [&] { return gazeOf(frame.gaze); });
}

Result validate(const Character& c) {
  if (!isTopicName(c.name)) return Result::bad("the character's name cannot be part of a topic");
  if (c.blendshape_names.size() > kMaxBlendshapes)
    return Result::bad(count(c.blendshape_names.size(), "blendshapes: too many"));
  for (const std::string& name : c.blendshape_names) {
    if (name.empty() || !isPlainText(name, kMaxNameBytes))
      return Result::bad("a blendshape's name is empty, too long or not plain text");
  }
  const std::size_t vertices = c.neutral.size();
  const std::size_t triangles = c.triangles.size();
  if (vertices > kMaxVertices)
    return Result::bad(count(vertices, "vertices: the limit is ") + std::to_string(kMaxVertices));
  if (triangles > kMaxTriangles)
    return Result::bad(count(triangles, "triangles: the limit is ") + std::to_string(kMaxTriangles));
  if (c.has_mesh && vertices == 0) return Result::bad("publishes a mesh but has no vertices");
  if (!allFinite(c.neutral)) return Result::bad("a neutral vertex is not finite");
  for (const auto& triangle : c.triangles) {
    for (const std::uint32_t v : triangle) {
      if (v >= vertices)
        return Result::bad("triangle corner " + std::to_string(v) + " of " + count(vertices, "vertices"));
    }
  }
  if (c.materials.size() > kMaxMaterials) return Result::bad(count(c.materials.size(), "materials: too many"));
  for (const Character::Material& m : c.materials) {
    if (!isPlainText(m.name, kMaxNameBytes) || !allFinite(m.colour))
      return Result::bad("a material's name or colour is bad");
  }
  if (!c.triangle_material.empty() && c.triangle_material.size() != triangles)
    return Result::bad("triangle materials do not match");
  for (const std::uint16_t m : c.triangle_material) {
    if (m >= c.materials.size())
      return Result::bad("triangle material " + std::to_string(m) + " of " + std::to_string(c.materials.size()));
  }
  if (!c.corner_texcoords.empty() && c.corner_texcoords.size() != triangles * 3)
    return Result::bad("texture coordinates do not match");
  if (!allFinite(c.corner_texcoords)) return Result::bad("a texture coordinate is not finite");
  if (c.polygon_start.empty() != c.corner_vertices.empty())
    return Result::bad("polygons without corners, or corners without polygons");
  if (!c.polygon_start.empty()) {
    if (c.polygon_start.front() != 0 || c.polygon_start.back() != c.corner_vertices.size() ||
        !std::is_sorted(c.polygon_start.begin(), c.polygon_start.end())) {
      return Result::bad("polygon starts do not match the corners");
    }
    for (const std::uint32_t v : c.corner_vertices) {
      if (v >= vertices)
        return Result::bad("polygon corner " + std::to_string(v) + " of " + count(vertices, "vertices"));
    }
  }
  if (!allFinite(c.left_eye_centre) || !allFinite(c.right_eye_centre))
    return Result::bad("an eye centre is not finite");
  if (!(c.units_per_mm >= 0.0 && c.units_per_mm < 1e12)) return Result::bad("units per millimetre out of range");
  return rotationOf(c.mesh_from_head, "mesh_from_head");
}

Result validate(const StatusReport& r) {
  if (static_cast<unsigned>(r.state) > static_cast<unsigned>(PipelineState::stopping))
    return Result::bad("unknown pipeline state");
  if (!isPlainText(r.source, kMaxTextBytes) || !isPlainText(r.recording_error, kMaxTextBytes)) {
    return Result::bad("a text is too long or not plain");
  }
  if (r.stages.size() > kMaxStages) return Result::bad(count(r.stages.size(), "stages: too many"));
  for (const StageLatency& s : r.stages) {
    if (!isPlainText(s.name, kMaxNameBytes) || !std::isfinite(s.p50_us) || !std::isfinite(s.p99_us)) {
      return Result::bad("a stage's name or latency is bad");
    }
  }
  return {};
}

}  // namespace volto::protocol
