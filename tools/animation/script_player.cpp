#include "tools/animation/script_player.h"

#include <cmath>
#include <numbers>

#include "rig/fapu.h"
#include "tracker/head_pose.h"

namespace volto::animation {
namespace {

constexpr double kRadians = std::numbers::pi / 180;

}  // namespace

ScriptPlayer::ScriptPlayer(const rig::Rig& rig, const AnimationScript& script, double rate_hz, bool with_mesh)
    : rig_(rig),
      script_(script),
      rate_hz_(rate_hz),
      with_mesh_(with_mesh),
      frames_(1 + static_cast<std::uint64_t>(std::floor(script.durationS() * rate_hz + 1e-9))),
      deformer_(rig),
      fapu_scale_(rig::fapuScale(rig.fapu.fapu)),
      relations_(retarget::shapeRelations(rig.blendshapes, rig.combinations)) {
  for (const rig::Blendshape& shape : rig.blendshapes) {
    const auto index = arkitBlendshapeIndex(shape.name);
    arkit_.push_back(index ? static_cast<std::int32_t>(*index) : -1);
  }
  avatar_.weights.resize(rig.blendshapes.size());
  avatar_.observed.assign(rig.blendshapes.size(), 1);
  if (with_mesh) avatar_.vertices.resize(rig.neutral.vertexCount());
  for (const std::int32_t a : arkit_)
    if (a >= 0) mask_.arkit_observed.set(static_cast<std::size_t>(a));
  mask_.point_confidence.fill(1.0F);
  avatar_.state = mask_.state = TrackingState::tracking;
  avatar_.confidence = mask_.confidence = 1.0F;
}

std::int64_t ScriptPlayer::time(std::uint64_t frame) const {
  return std::llround(static_cast<double>(frame) * 1e9 / rate_hz_);
}

void ScriptPlayer::play(std::uint64_t frame) {
  const std::int64_t t_ns = time(frame);
  script_.at(static_cast<double>(t_ns) * 1e-9, moment_);
  avatar_.t_capture_ns = mask_.t_capture_ns = t_ns;
  avatar_.capture_seq = mask_.capture_seq = frame + 1;
  avatar_.weights = moment_.weights;
  relations_.drive(avatar_.weights);
  for (std::size_t k = 0; k < moment_.weights.size(); ++k)
    if (moment_.weights[k] != 0) avatar_.weights[k] = moment_.weights[k];
  tracker::setHeadPose(tracker::headRotation({moment_.head_degrees[0] * kRadians, moment_.head_degrees[1] * kRadians,
                                              moment_.head_degrees[2] * kRadians}),
                       Eigen::Vector3d::Zero(), avatar_.head);
  mask_.head = avatar_.head;
  if (with_mesh_) deformer_.deformAtWeights(avatar_.weights, avatar_.vertices);

  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < rig_.blendshapes.size(); ++k) {
      if (avatar_.weights[k] == 0) continue;
      const auto& by = rig_.blendshapes[k].mask_displacement[p];
      moved += static_cast<double>(avatar_.weights[k]) * Eigen::Vector3d(by[0], by[1], by[2]);
    }
    const Eigen::Vector3d in_head = rig_.mesh_from_head.transpose() * moved;
    for (int axis = 0; axis < 3; ++axis)
      mask_.displacement_fapu[p][static_cast<std::size_t>(axis)] =
          static_cast<float>(in_head[axis] / fapu_scale_(static_cast<Eigen::Index>(p), axis));
  }
  mask_.arkit_weights.fill(0.0F);
  for (std::size_t k = 0; k < arkit_.size(); ++k)
    if (arkit_[k] >= 0) mask_.arkit_weights[static_cast<std::size_t>(arkit_[k])] = avatar_.weights[k];
}

}  // namespace volto::animation
