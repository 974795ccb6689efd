#include "retarget/mask_scale.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "rig/fapu.h"

namespace volto::retarget {
namespace {

// No face moves a point by a thousand units; more is damage, and could overflow.
constexpr float kLargestDisplacementFapu = 1000.0F;

}  // namespace

MaskScale::MaskScale(const rig::Rig& rig) {
  const rig::FeaturePointPositions scale = rig::fapuScale(rig.fapu.fapu);
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double m = rig.mesh_from_head(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(axis)) *
                         scale(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(axis));
        if (!std::isfinite(m)) throw std::invalid_argument("the rig's FAPU or frame is not finite");
        mesh_from_fapu_[p][row][axis] = static_cast<float>(m);
      }
    }
  }
}

void MaskScale::apply(const MaskDisplacements& displacement_fapu, MeshMaskDisplacement& out) const {
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    std::array<float, 3> fapu = displacement_fapu[p];
    for (float& value : fapu) {
      value = std::isfinite(value) ? std::clamp(value, -kLargestDisplacementFapu, kLargestDisplacementFapu) : 0.0F;
    }
    for (std::size_t row = 0; row < 3; ++row) {
      const auto& m = mesh_from_fapu_[p][row];
      out[p][row] = m[0] * fapu[0] + m[1] * fapu[1] + m[2] * fapu[2];
    }
  }
}

}  // namespace volto::retarget
