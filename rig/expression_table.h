// The expression table: for each of the 52 ARKit blendshapes, the displacement of all 84 feature points in FAPU units,
// so that one table serves every face.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>

#include "frames/arkit_blendshapes.h"
#include "frames/mask_frame.h"
#include "rig/feature_points.h"

namespace volto::rig {

class ExpressionTable {
 public:
  // 252 by 52: column k is shape k; row 3 * i + axis is that axis of feature point i, FAPU units, head frame.
  using Basis = Eigen::Matrix<double, static_cast<int>(3 * kFeaturePointCount), static_cast<int>(kArkitBlendshapeCount)>;

  // The table shipped with Volto, compiled into the library.
  static const ExpressionTable& standard();
  // Reads the data file's format (rig/assets/expression_table.csv says how). Throws rig::InputError (rig/errors.h), naming line and column.
  static ExpressionTable parse(std::string_view text, const std::string& name_for_errors);

  const Basis& basis() const { return basis_; }
  // False for a shape that moves no feature point (tongueOut, eye turns without lid motion): the mask cannot show it.
  bool movesMask(std::size_t shape) const { return moves_mask_[shape]; }
  const std::string& source(std::size_t shape) const { return source_[shape]; }  // where the numbers come from

  // Sum of weights times columns, no allocation. Weights need not be in 0..1.
  void apply(const ArkitWeights& weights, MaskDisplacements& out_fapu) const;

 private:
  Basis basis_ = Basis::Zero();
  std::array<bool, kArkitBlendshapeCount> moves_mask_{};
  std::array<std::string, kArkitBlendshapeCount> source_;
};

}  // namespace volto::rig
