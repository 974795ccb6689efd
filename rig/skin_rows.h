// The operator's rows for the skin: every mask triangle's RBF, blended, made fair across the borders of the regions,
// and led to rest beyond the mask.
#pragma once

#include <array>
#include <vector>

#include "rig/association.h"

namespace volto::rig {

using OperatorRow = std::array<double, kFeaturePointCount>;

// Rows of the vertices that move.
struct SkinRows {
  std::vector<std::int32_t> row_of_vertex;  // #V: index into rows, -1 for a vertex that stays where it is
  std::vector<OperatorRow> rows;

  const OperatorRow* find(std::uint32_t v) const {
    return row_of_vertex[v] < 0 ? nullptr : &rows[static_cast<std::size_t>(row_of_vertex[v])];
  }
};

// 1. Each vertex on the mask takes the RBFs of the triangles around its triangle's points, weighted so that
// the weights
//    change continuously from triangle to triangle and only RBFs that hold a feature point have a say at that point.
// 2. The rows x of all vertices minimise the squared Laplacian of x over the skin, plus the squared distance to the
// rows of step 1,
//    with feature points held exactly and vertices beyond the fade at zero. What has no ray (nostrils, the inside of
//    the lips, the skin around the mask) so continues its surroundings smoothly. The Laplacian knows constants, so rows
//    still sum to 1. blend_width: over what part of a mask triangle's size the second term gives way to the first.
// 3. Lips and lids: what the opposite side would contribute is taken out, gradually from that side's own points to
// here.
SkinRows skinRows(const Mesh& mesh, const Skin& skin, const SkinAssociation& association,
                  const FeaturePointPositions& points, const SkinPoints& on_skin, double eye_separation,
                  double blend_width);

// Weights near zero go, smoothly (below 1e-3 entirely, above 4e-3 not at all), and what remains keeps the row's sum.
void dropSmallWeights(OperatorRow& row);

}  // namespace volto::rig
