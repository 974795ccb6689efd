// Expressions carried by the control mask: the examples' displacement at the mask's points, in FAPU of the source,
// times FAPU of the target, and from there to every vertex by the target's own regions of influence. Queiroz, Braun,
// Musse, section V, equations 1 and 2.
#pragma once

#include <vector>

#include "rig/rig.h"
#include "transfer/mask_places.h"

namespace volto::transfer {

// How much longer a displacement is on the target than on the source at a place of the mask, along the head's axes: the
// ratio of their FAPU, steadied by that of the whole faces where the two are as near as points are exact.
Eigen::Vector3d fapuRatio(const rig::Rig& source, const rig::Rig& target, const MaskPlace& place);

// Const calls from several threads are fine. Borrows `source` and `target`.
class MaskTransfer {
 public:
  // Each drives with its refined mask where it has one (rig/refined_mask.h). The two need not be subdivided alike: the
  // source's motion is read off at the places of the target's points. On meshes of the same topology it is read off at
  // the very vertices.
  MaskTransfer(const rig::Rig& source, const rig::Rig& target);

  std::size_t targetPointCount() const { return mask_.pointCount(); }

  // #M by 3: how the points of the target's mask move, its frame and unit.
  rig::VertexPositions pointDisplacements(const rig::VertexPositions& example) const;

  // One per vertex of the target: how much longer a displacement is on it, along the head's axes, as the points that
  // move it have it; the ratio of the eye separations where none does.
  std::vector<Eigen::Vector3d> vertexRatios() const;

  // `example`: #V by 3 of the source. Result: #V by 3 of the target, its frame and unit; contacts are not looked at.
  rig::VertexPositions transfer(const rig::VertexPositions& example) const;

 private:
  const rig::Rig& source_;
  const rig::Rig& target_;
  rig::RefinedMask mask_;  // of the target
  struct Reading {
    std::array<std::uint32_t, 3> vertex{};  // of the source
    std::array<double, 3> weight{};
    Eigen::Vector3d ratio = Eigen::Vector3d::Ones();                   // of FAPU, along the head's axes
    Eigen::Matrix3d target_from_source = Eigen::Matrix3d::Identity();  // turn and FAPU
  };
  std::vector<Reading> readings_;  // one per point of the target's mask
};

}  // namespace volto::transfer
