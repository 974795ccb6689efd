// Lashes, tear film and whatever else grows on the margin of an eye: it goes where its place of the margin goes, and
// turns as the lid turns about the eyeball there. Both are evened out along the margin, all the way around the eye, so
// that a lash keeps its form where neighbouring pieces of a lid go different ways.
#pragma once

#include <cstdint>
#include <vector>

#include "rig/rig.h"

namespace volto::transfer {

// Const calls from several threads are fine. Borrows nothing.
class LidRing {
 public:
  // `slit`: an eye of `rig`.
  LidRing(const rig::Rig& rig, const rig::SlitContact& slit);

  // Ties the vertices of one piece to the margin. Where three in four are nearest to one lid, all of them belong to it: the
  // tips of long lashes reach past a corner of the eye.
  void add(const std::vector<std::uint32_t>& vertices);

  // Moves what was added; the lids of `positions` (#V) are in place.
  void apply(rig::VertexPositions& positions) const;

 private:
  struct Tied {
    std::uint32_t vertex = 0;
    std::uint32_t from = 0;  // between this point of the ring and the next one
    double share = 0;        // of the next one
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // from there, at rest
  };
  // The nearest place on the ring between two of its points, and its squared distance.
  double nearest(const Eigen::Vector3d& p, std::size_t first, std::size_t end, Tied& out) const;

  rig::VertexPositions neutral_;                   // of the mesh
  std::vector<rig::SlitContact::Sample> samples_;  // upper lid, then the lower one back
  std::size_t upper_ = 0;                          // how many of them are the upper lid's
  std::vector<Eigen::Vector3d> at_rest_;           // one per sample
  bool turns_ = false;                             // there is an eyeball
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  std::vector<Tied> tied_;
};

}  // namespace volto::transfer
