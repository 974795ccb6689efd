// Frames for tests: every field has a value of its own, so that nothing can be mixed up unseen.
#pragma once

#include <cmath>
#include <string>

#include "protocol/messages.h"

namespace volto::protocol::test {

inline HeadPose sampleHead(float yaw) {
  HeadPose head;
  head.rotation = {0.0F, std::sin(yaw / 2), 0.0F, std::cos(yaw / 2)};
  head.yaw_rad = yaw;
  head.pitch_rad = 0.02F;
  head.roll_rad = -0.03F;
  head.translation_mm = {11.0F, -12.0F, 613.0F};
  head.observed = true;
  return head;
}

inline Gaze sampleGaze() { return {{0.11F, 0.12F}, {0.13F, 0.14F}, 0.75F}; }

inline LandmarkFrame sampleLandmarks(std::uint64_t number = 1) {
  LandmarkFrame frame;
  frame.t_capture_ns = static_cast<std::int64_t>(number) * 16'666'667;
  frame.capture_seq = number;
  frame.face_present = true;
  frame.confidence = 0.97F;
  frame.image_width_px = 1280;
  frame.image_height_px = 720;
  frame.focal_length_px = 1100.5;
  for (int i = 0; i < 68; ++i) {
    const auto n = static_cast<float>(i);
    frame.points_px.push_back({500.0F + n, 300.25F - n + static_cast<float>(number)});
    frame.points_camera_mm.push_back({n, -n, 600.0F + n});
    frame.point_confidence.push_back(n / 68.0F);
  }
  frame.pupils[0] = {510.5F, 280.25F, 0.75F};
  frame.pupils[1] = {600.5F, 281.0F, 0.0F};
  return frame;
}

inline MaskFrame sampleMask(std::uint64_t number = 1) {
  MaskFrame frame;
  frame.t_capture_ns = static_cast<std::int64_t>(number) * 16'666'667;
  frame.capture_seq = number;
  frame.state = TrackingState::holding;
  frame.confidence = 0.5F;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    const auto n = static_cast<float>(i);
    frame.displacement_fapu[i] = {n * 0.01F, -n * 0.02F, n * 0.03F};
    frame.point_confidence[i] = n / 84.0F;
  }
  for (std::size_t i = 0; i < kArkitBlendshapeCount; ++i) {
    frame.arkit_weights[i] = static_cast<float>(i) / 52.0F;
    frame.arkit_observed[i] = i % 3 != 0;
  }
  frame.head = sampleHead(0.3F);
  frame.gaze = sampleGaze();
  return frame;
}

inline Character sampleCharacter(std::size_t vertices = 5, const std::string& name = "anna") {
  Character c;
  c.name = name;
  for (const std::string_view shape : kArkitBlendshapeNames) c.blendshape_names.emplace_back(shape);
  for (std::size_t i = 0; i < vertices; ++i) {
    const auto n = static_cast<float>(i);
    c.neutral.push_back({std::sin(n), std::cos(n), n * 0.001F});
  }
  for (std::uint32_t i = 0; i + 2 < vertices; ++i) c.triangles.push_back({i, i + 1, i + 2});
  c.materials = {{"skin", {0.8F, 0.6F, 0.5F}}, {"eyes", {0.9F, 0.9F, 1.0F}}};
  c.triangle_material.assign(c.triangles.size(), 0);
  if (!c.triangle_material.empty()) c.triangle_material.back() = 1;
  c.corner_texcoords.assign(c.triangles.size() * 3, {0.25F, 0.75F});
  if (vertices >= 4) {
    c.corner_vertices = {0, 1, 2, 3};
    c.polygon_start = {0, 4};
  }
  c.left_eye_centre = {32.0F, 40.0F, 20.0F};
  c.right_eye_centre = {-32.0F, 40.0F, 20.0F};
  c.units_per_mm = 0.1;
  c.has_mesh = vertices > 0;
  c.has_gaze = true;
  return c;
}

inline AvatarFrame sampleAvatar(std::uint64_t number = 1, std::size_t vertices = 0) {
  AvatarFrame frame;
  frame.t_capture_ns = static_cast<std::int64_t>(number) * 16'666'667;
  frame.capture_seq = number;
  frame.state = TrackingState::tracking;
  frame.confidence = 0.875F;
  frame.head = sampleHead(-0.2F);
  frame.gaze = sampleGaze();
  for (std::size_t i = 0; i < kArkitBlendshapeCount; ++i) {
    frame.weights.push_back(static_cast<float>(i) / 64.0F);
    frame.observed.push_back(i == 51 ? 0 : 1);
  }
  for (std::size_t i = 0; i < vertices; ++i) {
    const auto n = static_cast<float>(i);
    frame.vertices.push_back({n, n + 0.25F, static_cast<float>(number)});
  }
  return frame;
}

inline StatusReport sampleStatus() {
  StatusReport r;
  r.state = PipelineState::stalled;
  r.source = "camera:/dev/video0";
  r.frames_in = 1001;
  r.frames_out = 1002;
  r.dropped_driver = 1003;
  r.dropped_decode = 1004;
  r.dropped_late = 1005;
  r.dropped_queue = 1006;
  r.deadline_misses = 1007;
  r.reconnects = 1008;
  r.bad_messages = 1009;
  r.send_failures = 1010;
  r.messages_sent = 1011;
  r.bytes_sent = 1012;
  r.clients = 13;
  r.recording = true;
  r.recorded_messages = 1014;
  r.dropped_recording = 1015;
  r.recording_error = "disk full";
  r.stages = {{"tracker", 1001, 310.5, 900.25}, {"retarget", 1000, 80.0, 120.0}};
  return r;
}

inline Stamp sampleStamp(std::uint64_t seq = 7) {
  Stamp stamp;
  stamp.epoch = 0x0123456789ABCDEFULL;
  stamp.seq = seq;
  stamp.t_publish_ns = 2'000'000'000;
  stamp.t_realtime_ns = 1'700'000'000'000'000'000;
  return stamp;
}

}  // namespace volto::protocol::test
