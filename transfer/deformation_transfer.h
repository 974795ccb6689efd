// Deformation transfer: the target's triangles are deformed as the source's were (Sumner and Popovic 2004), in the form
// of one Poisson system (Botsch et al. 2006): minimise over the target's positions x
//   sum over triangles t   area_t |gradient_t(x) - R S_s(t) R^T|^2
// + sum over vertices v    anchor area_v |x_v - (X_v + D_v)|^2
// + sum over slit pairs p  stiffness_p |(x_u - x_l) - G_p|^2
// S_s is the deformation gradient of the corresponding source triangle, R the rotation from the source's frame to the
// target's, D the source's displacement carried over (FAPU), G the gap between two lips or lids. The anchor keeps what
// gradients alone leave open (where the face is), the pairs (after Saito 2013's virtual triangles) keep contacts: a lid
// that closes on the source closes on the target. The matrix depends on the target alone and is factored once.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rig/mesh.h"
#include "transfer/surface.h"

namespace volto::transfer {

// What of the source stands for what of the target.
struct Correspondence {
  static constexpr std::int32_t kNone = -1;
  std::vector<std::int32_t>
      source_triangle;  // one per triangle of rig::triangulate(target): index into rig::triangulate(source), or kNone
  // One per target triangle, or none: where on the source it takes its deformation, between the means around the
  // source's vertices; without weights: from source_triangle. For meshes of unlike density: triangle by triangle, a
  // fine target would show the facets of a coarse source.
  std::vector<SurfacePoint> source_place;
  std::vector<SurfacePoint>
      source_point;  // one per target vertex; all weights zero: none, the vertex is anchored where it is
  // How firmly each target vertex is held where its displacement puts it, as a share of the anchor: 0 follows its
  // neighbours alone. One per target vertex, or none: all 1.
  std::vector<double> anchor_share;
  Eigen::Matrix3d target_from_source = Eigen::Matrix3d::Identity();  // rotation R
  // How much longer a displacement is on the target, along the axes of the head; one row per target vertex, or a single
  // one for all.
  std::vector<Eigen::Vector3d> displacement_scale;
  Eigen::Matrix3d target_from_head = Eigen::Matrix3d::Identity();  // rotation: whose axes the scale is along
};

// Same vertices and polygons in the same order: everything stands for itself.
Correspondence sameTopology(const rig::Mesh& mesh);

// Two points of the target that face each other across the mouth or an eye, and the same two on the source.
struct SlitPair {
  SurfacePoint target_upper, target_lower;
  SurfacePoint source_upper, source_lower;
  double gap_scale = 1;  // target's gap / source's gap at rest: a gap of zero on the source is zero on the target
};

struct DeformationTransferOptions {
  // Relative to 1 / (eye separation)^2. More: closer to the source's displacements; less: closer to the source's
  // bending.
  double anchor = 0.4;
  // Of vertices that nothing on the source stands for.
  double hold = 40;
  double slit_stiffness = 4;  // relative to the edges around
  int threads = 0;            // 0: every core
};

class DeformationTransfer {
 public:
  // `same_as`: rig/weld.h, the target's seams closed; empty: none. `eye_separation` of the target, its unit. Throws
  // std::invalid_argument when sizes do not fit together.
  DeformationTransfer(const rig::VertexPositions& source_neutral,
                      std::span<const std::array<std::uint32_t, 3>> source_triangles,
                      const rig::VertexPositions& target_neutral,
                      std::span<const std::array<std::uint32_t, 3>> target_triangles,
                      std::span<const std::uint32_t> same_as, Correspondence correspondence,
                      std::vector<SlitPair> pairs, double eye_separation,
                      const DeformationTransferOptions& options = {});
  ~DeformationTransfer();
  DeformationTransfer(DeformationTransfer&&) noexcept;
  DeformationTransfer& operator=(DeformationTransfer&&) noexcept;

  // One target mesh per source mesh; each #V of the source. An example equal to the source's neutral gives the target's
  // neutral to rounding. Same bits whatever the number of threads.
  std::vector<rig::VertexPositions> transfer(std::span<const rig::VertexPositions> examples) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::transfer
