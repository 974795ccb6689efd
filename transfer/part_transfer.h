// What does not deform as skin does, on a target whose parts are not the source's: eyeballs, lower teeth and tongue
// turn and shift as the source's do; lashes go with the margin of their eye, brows ride on the skin under them.
#pragma once

#include <vector>

#include "rig/rig.h"
#include "transfer/lid_ring.h"
#include "transfer/surface.h"

namespace volto::transfer {

// Const calls from several threads are fine. Borrows `source` and `target`.
class PartTransfer {
 public:
  PartTransfer(const rig::Rig& source, const rig::Rig& target);

  // Moves the parts of `result` (#V of the target, its skin in place). What the source has no part for stays as it is
  // in `result`.
  void apply(const rig::VertexPositions& example, rig::VertexPositions& result) const;

 private:
  struct Turning {
    std::vector<std::uint32_t> source, target;
    std::vector<std::uint32_t> middle;  // of the target: what answers to `source`
    std::vector<double> share;          // one per vertex of the target, 0..1: of the motion
  };
  // A vertex in the frame of a triangle of skin.
  struct Rider {
    std::uint32_t vertex = 0;
    SurfacePoint on;
    Eigen::Vector3d offset;  // in the triangle's frame
  };
  const rig::Rig& source_;
  const rig::Rig& target_;
  std::vector<Turning> turning_;
  std::vector<LidRing> rings_;  // one per eye
  std::vector<Rider> riders_;
};

}  // namespace volto::transfer
