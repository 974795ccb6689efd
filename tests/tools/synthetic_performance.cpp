#include "tests/tools/synthetic_performance.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "frames/arkit_blendshapes.h"
#include "rig/control_mask.h"
#include "rig/expression_table.h"
#include "rig/fapu.h"

namespace volto::test {

namespace {

constexpr double kFocal_px = 800, kDistance_mm = 600;
using Points = std::array<std::array<double, 3>, 68>;

// 68 points of a mask, head frame, millimetres. The four jaw landmarks without a feature point lie between their
// neighbours.
Points landmarksOf(const rig::FeaturePointPositions& mask) {
  Points points{};
  std::array<int, 68> count{};
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    const auto& ibug = rig::featurePoints()[i].ibug68;
    if (ibug[0] < 0 || ibug[1] >= 0) continue;
    const auto landmark = static_cast<std::size_t>(ibug[0]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      points[landmark][axis] = mask(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(axis));
    count[landmark] = 1;
  }
  for (std::size_t landmark = 1; landmark + 1 < 68; ++landmark) {
    if (count[landmark] != 0) continue;
    for (std::size_t axis = 0; axis < 3; ++axis)
      points[landmark][axis] = 0.5 * (points[landmark - 1][axis] + points[landmark + 1][axis]);
  }
  return points;
}

double bump(double seconds, double at, double width) {
  const double t = (seconds - at) / width;
  return std::exp(-t * t);
}

}  // namespace

float syntheticJawOpen(double seconds) {
  return static_cast<float>(0.3 * (1.0 - std::cos(2 * std::numbers::pi * 1.5 * seconds)));
}

std::vector<LandmarkFrame> syntheticPerformance(const SyntheticPerformanceOptions& options) {
  const rig::FeaturePointPositions scale = rig::fapuScale(rig::measureFapu(rig::referenceMask()).fapu);
  std::vector<LandmarkFrame> frames;
  for (std::size_t f = 0; f < options.frames; ++f) {
    const double seconds = static_cast<double>(f) / options.rate;
    ArkitWeights weights{};
    weights[*arkitBlendshapeIndex("jawOpen")] = syntheticJawOpen(seconds);
    const float blink = static_cast<float>(bump(std::fmod(seconds, 2.0), 1.0, 0.08));
    weights[*arkitBlendshapeIndex("eyeBlinkLeft")] = weights[*arkitBlendshapeIndex("eyeBlinkRight")] = blink;
    const float smile = static_cast<float>(0.7 * bump(std::fmod(seconds, 3.0), 1.5, 0.4));
    weights[*arkitBlendshapeIndex("mouthSmileLeft")] = weights[*arkitBlendshapeIndex("mouthSmileRight")] = smile;
    MaskDisplacements displacement{};
    rig::ExpressionTable::standard().apply(weights, displacement);
    rig::FeaturePointPositions mask = rig::referenceMask();
    for (Eigen::Index i = 0; i < mask.rows(); ++i) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        mask(i, axis) += scale(i, axis) *
                         static_cast<double>(displacement[static_cast<std::size_t>(i)][static_cast<std::size_t>(axis)]);
      }
    }

    LandmarkFrame frame;
    frame.t_capture_ns = std::llround(seconds * 1e9);
    frame.capture_seq = f;
    frame.face_present = true;
    frame.confidence = 0.98F;
    const double yaw = options.head_turn_rad * std::sin(2 * std::numbers::pi * 0.5 * seconds);
    for (const auto& point : landmarksOf(mask)) {
      const double x = std::cos(yaw) * point[0] + std::sin(yaw) * point[2];
      const double z = -std::sin(yaw) * point[0] + std::cos(yaw) * point[2];
      const double camera_z = kDistance_mm - z;
      frame.points_px.push_back({static_cast<float>(320 + kFocal_px * x / camera_z),
                                 static_cast<float>(240 - kFocal_px * point[1] / camera_z)});
      if (options.with_3d) {
        frame.points_camera_mm.push_back(
            {static_cast<float>(x), static_cast<float>(-point[1]), static_cast<float>(camera_z)});
      }
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::string openFaceCsv(const std::vector<LandmarkFrame>& frames) {
  const bool with_3d = !frames.empty() && !frames[0].points_camera_mm.empty();
  std::string text = "frame, face_id, timestamp, confidence, success";
  for (const char* prefix : {"x_", "y_", "X_", "Y_", "Z_"}) {
    if (prefix[0] < 'a' && !with_3d) continue;
    for (int i = 0; i < 68; ++i) text += ", " + (prefix + std::to_string(i));
  }
  text += "\n";
  char cell[64];
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const LandmarkFrame& frame = frames[f];
    std::snprintf(cell, sizeof cell, "%zu, 0, %.4f, %.2f, %d", f + 1, static_cast<double>(frame.t_capture_ns) * 1e-9,
                  static_cast<double>(frame.confidence), frame.face_present ? 1 : 0);
    text += cell;
    const auto append = [&](const auto& points, std::size_t axis) {
      for (std::size_t i = 0; i < 68; ++i) {
        std::snprintf(cell, sizeof cell, ", %.3f", i < points.size() ? static_cast<double>(points[i][axis]) : 0.0);
        text += cell;
      }
    };
    for (std::size_t axis = 0; axis < 2; ++axis) append(frame.points_px, axis);
    for (std::size_t axis = 0; with_3d && axis < 3; ++axis) append(frame.points_camera_mm, axis);
    text += "\n";
  }
  return text;
}

std::string liveLinkCsv(std::size_t rows) {
  std::string text = "Timecode,BlendShapeCount";
  for (const std::string_view name : kArkitBlendshapeNames) (text += ',') += name;
  text += ",HeadYaw,HeadPitch,HeadRoll,LeftEyeYaw,LeftEyePitch,LeftEyeRoll,RightEyeYaw,RightEyePitch,RightEyeRoll\n";
  char cell[64];
  for (std::size_t row = 0; row < rows; ++row) {
    std::snprintf(cell, sizeof cell, "10:00:%02zu:%02zu.000,61", row / 60, row % 60);
    text += cell;
    for (const std::string_view name : kArkitBlendshapeNames) {
      const double value = name == "jawOpen"     ? static_cast<double>(row) / static_cast<double>(rows)
                           : name == "tongueOut" ? 0.5
                                                 : 0.0;
      std::snprintf(cell, sizeof cell, ",%.10f", value);
      text += cell;
    }
    text += ",0.1,-0.05,0.02,0,0,0,0,0,0\n";
  }
  return text;
}

}  // namespace volto::test
