#include "retarget/eyes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace volto::retarget {
namespace {

using Matrix3 = std::array<std::array<double, 3>, 3>;

double safeAngle(float angle_rad) {
  constexpr double kQuarterTurn = std::numbers::pi / 2.0;
  return std::isfinite(angle_rad) ? std::clamp(static_cast<double>(angle_rad), -kQuarterTurn, kQuarterTurn) : 0.0;
}

// a * b * a^T
Matrix3 conjugate(const Matrix3& a, const Matrix3& b) {
  Matrix3 ab{}, out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) ab[i][j] += a[i][k] * b[k][j];
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) out[i][j] += ab[i][k] * a[j][k];
    }
  }
  return out;
}

}  // namespace

Matrix3 headFromEye(const Gaze::Eye& gaze) {
  const double yaw = safeAngle(gaze.yaw_rad), pitch = safeAngle(gaze.pitch_rad);
  const double cy = std::cos(yaw), sy = std::sin(yaw), cp = std::cos(pitch), sp = std::sin(pitch);
  // About y by yaw, after about x by -pitch.
  return {{{cy, -sy * sp, sy * cp}, {0.0, cp, sp}, {-sy, -cy * sp, cy * cp}}};
}

Eyes::Eyes(const rig::Rig& rig) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      mesh_from_head_[i][j] = rig.mesh_from_head(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  for (const rig::RigidPart& part : rig.rigid_parts) {
    const bool left = part.follows == rig::RigidPart::Follows::left_eye;
    if (!left && part.follows != rig::RigidPart::Follows::right_eye) continue;
    Turn turn{left, part.vertices, {}};
    turn.from_centre.reserve(part.vertices.size());
    for (const std::uint32_t vertex : part.vertices) {
      if (vertex >= rig.neutral.vertexCount()) {
        throw std::invalid_argument("rigid part " + part.name + " names vertex " + std::to_string(vertex) +
                                    ", the mesh has " + std::to_string(rig.neutral.vertexCount()));
      }
      Vertex arm{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        arm[axis] =
            static_cast<float>(rig.neutral.positions(vertex, static_cast<Eigen::Index>(axis)) - part.centre[axis]);
      }
      turn.from_centre.push_back(arm);
    }
    turns_.push_back(std::move(turn));
  }
}

void Eyes::turn(const Gaze& gaze, std::span<Vertex> out) const {
  if (turns_.empty() || !(gaze.confidence > 0.0F)) return;
  for (const bool left : {true, false}) {
    const Gaze::Eye& eye = left ? gaze.left : gaze.right;
    if (safeAngle(eye.yaw_rad) == 0.0 && safeAngle(eye.pitch_rad) == 0.0) continue;
    const Matrix3 rotation = conjugate(mesh_from_head_, headFromEye(eye));
    std::array<std::array<float, 3>, 3> change;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) change[i][j] = static_cast<float>(rotation[i][j] - (i == j ? 1.0 : 0.0));
    }
    for (const Turn& turn : turns_) {
      if (turn.left != left) continue;
      for (std::size_t i = 0; i < turn.vertices.size(); ++i) {
        Vertex& position = out[turn.vertices[i]];
        const Vertex& arm = turn.from_centre[i];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          position[axis] += change[axis][0] * arm[0] + change[axis][1] * arm[1] + change[axis][2] * arm[2];
        }
      }
    }
  }
}

}  // namespace volto::retarget
