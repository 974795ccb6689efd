// From FAPU units to one character: a displacement times the character's own unit of that point and axis (Queiroz,
// equation 2), turned from the head frame into the mesh's.
#pragma once

#include <array>

#include "frames/mask_frame.h"
#include "retarget/deformer.h"
#include "rig/rig.h"

namespace volto::retarget {

// Thread-safe after construction. Borrows nothing.
class MaskScale {
 public:
  // Takes rig.fapu and rig.mesh_from_head. Throws std::invalid_argument when they are not finite.
  explicit MaskScale(const rig::Rig& rig);

  // out: mesh unit, mesh frame, always finite. A displacement that is not finite counts as none.
  void apply(const MaskDisplacements& displacement_fapu, MeshMaskDisplacement& out) const;

 private:
  std::array<std::array<std::array<float, 3>, 3>, kFeaturePointCount> mesh_from_fapu_;  // per point, row by row
};

}  // namespace volto::retarget
