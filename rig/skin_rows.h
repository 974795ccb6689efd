// From displacements of a mask's points to the skin: every mask triangle's RBF, blended, made fair across the borders
// of the regions, and led to rest beyond the mask.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "rig/association.h"
#include "rig/sparse_rows.h"
#include "rig/t_vertices.h"

namespace volto::rig {

// What all masks on one skin share. Borrows all of it.
struct SkinProblem {
  const Mesh& mesh;
  const Skin& skin;
  const SkinAssociation& association;
  const SkinPoints& feature_points;  // 84
  double eye_separation;             // mesh unit
  double blend_width;                // RigOptions
  const RegionEdits& edits;
  const std::vector<TVertex>& t_vertices;
  const std::vector<SkinTie>& lining;  // rig/lining.h
};

// A mask on the skin: the control mask itself, or a refined one.
struct MaskOnSkin {
  MaskGeometry geometry;
  std::vector<SkinPoint> points;                       // #M
  std::vector<std::int32_t> triangle;                  // #V: of geometry, -1 where the vertex has no ray
  std::vector<std::array<double, 3>> barycentric;      // #V
};
MaskOnSkin controlMaskOnSkin(const SkinProblem& problem, MaskGeometry geometry);

// Rows of the vertices that move.
struct SkinRows {
  std::vector<std::int32_t> row_of_vertex;  // #V: index into rows, -1 for a vertex that stays where it is
  SparseRows rows;                          // weights over the mask's points

  bool moves(std::uint32_t v) const { return row_of_vertex[v] >= 0; }
  void set(std::uint32_t v, RowBuilder& row) {
    row_of_vertex[v] = static_cast<std::int32_t>(rows.size());
    row.finish(rows);
  }
};

// 1. Each vertex on the mask takes the RBFs of the triangles around its triangle's points, weighted so that the weights
//    change continuously from triangle to triangle and only RBFs that hold a point have a say at that point.
// 2. The rows x of all vertices minimise the squared Laplacian of x over the skin, plus the squared distance to the
//    rows of step 1, with the mask's points held exactly and vertices beyond the fade at zero. What has no ray
//    (nostrils, the inside of the lips, the skin around the mask) so continues its surroundings smoothly, under tension
//    (skin_equations.h), and a lining goes with the skin in front of it. The Laplacian knows constants, so rows still sum to 1. blend_width: over what part of a mask
//    triangle's size the second term gives way to the first.
// 3. Lips and lids: what the opposite side would contribute is taken out, gradually from that side's own points to
//    here.
// 4. Beyond the mask's outline all fades, by distance along the skin, to nothing where the skin stays.
class SkinInterpolation {
 public:
  // Does step 1 and factors the equations of step 2.
  SkinInterpolation(const SkinProblem& problem, const MaskOnSkin& mask);
  ~SkinInterpolation();

  // Steps 2 to 4 for every point of the mask: the operator's rows.
  SkinRows rows() const;
  // Steps 1, 2 and 4 for given displacements of the points (#M by C): #V by C, zero for what does not move.
  Columns displace(const Columns& points) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::rig
