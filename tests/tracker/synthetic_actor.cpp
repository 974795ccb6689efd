#include "tests/tracker/synthetic_actor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rig/control_mask.h"
#include "rig/expression_table.h"
#include "rig/fapu.h"

namespace volto::test {
namespace {

constexpr double kFocal_px = 700;

}  // namespace

SyntheticActor::SyntheticActor(unsigned seed, double noise_px) : noise_px_(noise_px), random_(seed) {
  // Broader, with a longer chin, eyes set a little wider and lips a little apart: somebody else than the reference.
  neutral_mm_ = rig::referenceMask();
  for (Eigen::Index i = 0; i < neutral_mm_.rows(); ++i) {
    auto p = neutral_mm_.row(i);
    p.x() *= 1.04;
    if (p.y() < -60) p.y() *= 1.03;
    p.z() *= 0.97;
  }
  const std::size_t lower_lip_middle = *rig::featurePointIndex("2.3");
  neutral_mm_(static_cast<Eigen::Index>(lower_lip_middle), 1) -= 0.5;
  scale_mm_ = rig::fapuScale(rig::measureFapu(neutral_mm_).fapu);
}

LandmarkFrame SyntheticActor::frame(double time_s, const ArkitWeights& weights, const HeadMotion& head, bool with_3d) {
  MaskDisplacements moved{};
  rig::ExpressionTable::standard().apply(weights, moved);
  constexpr double kRadians = std::numbers::pi / 180;
  const double y = head.yaw_deg * kRadians, p = head.pitch_deg * kRadians, r = head.roll_deg * kRadians;
  Eigen::Matrix3d turn, nod, lean;
  turn << std::cos(y), 0, std::sin(y), 0, 1, 0, -std::sin(y), 0, std::cos(y);
  nod << 1, 0, 0, 0, std::cos(p), -std::sin(p), 0, std::sin(p), std::cos(p);
  lean << std::cos(r), -std::sin(r), 0, std::sin(r), std::cos(r), 0, 0, 0, 1;
  const Eigen::Matrix3d rotation = turn * nod * lean;

  LandmarkFrame out;
  out.t_capture_ns = std::llround(time_s * 1e9);
  out.capture_seq = static_cast<std::uint64_t>(std::llround(time_s * 1000));
  out.layout = LandmarkLayout::ibug68;
  out.face_present = true;
  out.confidence = 0.9F;
  out.image_width_px = 640;
  out.image_height_px = 480;
  out.focal_length_px = kFocal_px;
  out.points_px.assign(68, {0, 0});
  std::vector<std::array<float, 3>> camera(68, {0, 0, 0});
  std::normal_distribution<double> noise(0.0, 1.0);
  const auto points = rig::featurePoints();
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    if (points[i].ibug68[0] < 0 || points[i].ibug68[1] >= 0) continue;
    Eigen::Vector3d at = neutral_mm_.row(static_cast<Eigen::Index>(i)).transpose();
    for (int c = 0; c < 3; ++c)
      at[c] += moved[i][static_cast<std::size_t>(c)] * scale_mm_(static_cast<Eigen::Index>(i), c);
    const Eigen::Vector3d turned = rotation * at;
    const Eigen::Vector3d in_camera = head.at_mm + Eigen::Vector3d(turned.x(), -turned.y(), -turned.z());
    const auto k = static_cast<std::size_t>(points[i].ibug68[0]);
    camera[k] = {static_cast<float>(in_camera.x()), static_cast<float>(in_camera.y()),
                 static_cast<float>(in_camera.z())};
    out.points_px[k] = {
        static_cast<float>(320 + kFocal_px * in_camera.x() / in_camera.z() + noise_px_ * noise(random_)),
        static_cast<float>(240 + kFocal_px * in_camera.y() / in_camera.z() + noise_px_ * noise(random_))};
  }
  for (const std::size_t k : {2U, 5U, 11U, 14U})  // points of the jaw line that no feature point lies on
    for (std::size_t c = 0; c < 2; ++c)
      out.points_px[k][c] = 0.5F * (out.points_px[k - 1][c] + out.points_px[k + 1][c]);
  if (with_3d) out.points_camera_mm = camera;
  return out;
}

LandmarkFrame SyntheticActor::frame66(double time_s, const ArkitWeights& weights, const HeadMotion& head) {
  const LandmarkFrame full = frame(time_s, weights, head);
  LandmarkFrame out = full;
  out.layout = LandmarkLayout::openseeface66;
  out.points_px.resize(48);  // the same up to the mouth
  for (std::size_t k = 49; k <= 53; ++k) out.points_px.push_back(full.points_px[k]);
  for (std::size_t k = 55; k <= 59; ++k) out.points_px.push_back(full.points_px[k]);
  out.points_px.push_back(full.points_px[48]);
  for (std::size_t k = 61; k <= 63; ++k) out.points_px.push_back(full.points_px[k]);
  out.points_px.push_back(full.points_px[54]);
  for (std::size_t k = 65; k <= 67; ++k) out.points_px.push_back(full.points_px[k]);
  return out;
}

ArkitWeights expression(std::initializer_list<std::pair<const char*, float>> shapes) {
  ArkitWeights weights{};
  for (const auto& [name, value] : shapes) weights[arkitBlendshapeIndex(name).value()] = value;
  return weights;
}

float weightOf(const MaskFrame& mask, const char* shape) {
  return mask.arkit_weights[arkitBlendshapeIndex(shape).value()];
}

ArkitWeights livelyTalk(double t) {
  const auto wave = [t](double hz, double phase) {
    return static_cast<float>(std::max(0.0, std::sin(2 * std::numbers::pi * (hz * t + phase))));
  };
  const bool talking = std::fmod(t, 4.0) < 2.8;
  const double blink = std::fmod(t + 0.7, 2.3);
  const float closed = blink < 0.2 ? static_cast<float>(std::sin(std::numbers::pi * blink / 0.2)) : 0.0F;
  const float smile = 0.7F * wave(0.13, 0.6);
  const float brows = 0.6F * wave(0.21, 0.3) * wave(0.05, 0);
  return expression({{"jawOpen", talking ? 0.3F * wave(2.1, 0.1) : 0.0F},
                     {"mouthFunnel", talking ? 0.3F * wave(0.9, 0.4) : 0.0F},
                     {"mouthSmileLeft", smile},
                     {"mouthSmileRight", smile},
                     {"eyeBlinkLeft", closed},
                     {"eyeBlinkRight", closed},
                     {"browInnerUp", brows},
                     {"browOuterUpLeft", brows},
                     {"browOuterUpRight", brows}});
}

HeadMotion livelyHead(double t) {
  HeadMotion head;
  head.yaw_deg = 12 * std::sin(0.9 * t);
  head.pitch_deg = 6 * std::sin(1.3 * t + 1);
  head.roll_deg = 4 * std::sin(0.7 * t + 2);
  head.at_mm = {15 * std::sin(0.5 * t), 8 * std::sin(0.8 * t), 650 + 20 * std::sin(0.4 * t)};
  return head;
}

bool allFinite(const MaskFrame& mask) {
  bool finite = std::isfinite(mask.confidence) && std::isfinite(mask.head.yaw_rad) &&
                std::isfinite(mask.head.pitch_rad) && std::isfinite(mask.head.roll_rad);
  for (const auto& d : mask.displacement_fapu)
    for (const float v : d) finite = finite && std::isfinite(v);
  for (const float v : mask.arkit_weights) finite = finite && std::isfinite(v) && v >= 0 && v <= 1;
  for (const float v : mask.point_confidence) finite = finite && v >= 0 && v <= 1;
  for (const float v : mask.head.rotation) finite = finite && std::isfinite(v);
  for (const float v : mask.head.translation_mm) finite = finite && std::isfinite(v);
  return finite;
}

}  // namespace volto::test
