#include "rig/sparse_rows.h"

#include <algorithm>
#include <cmath>

namespace volto::rig {

void RowBuilder::dropSmall() {
  double before = 0, after = 0;
  for (const std::uint16_t p : touched_) {
    double& w = weight_[p];
    before += w;
    const double x = std::clamp((std::abs(w) - 1e-3) / 3e-3, 0.0, 1.0);
    w *= x * x * (3 - 2 * x);
    after += w;
  }
  if (before > 0 && after > 0) scale(std::min(before / after, 2.0));
}

void RowBuilder::clear() {
  for (const std::uint16_t p : touched_) {
    weight_[p] = 0;
    used_[p] = false;
  }
  touched_.clear();
}

void RowBuilder::finish(SparseRows& rows) {
  std::sort(touched_.begin(), touched_.end());
  for (const std::uint16_t p : touched_) {
    if (static_cast<float>(weight_[p]) != 0) {
      rows.point.push_back(p);
      rows.weight.push_back(static_cast<float>(weight_[p]));
    }
  }
  clear();
  rows.start.push_back(rows.point.size());
}

}  // namespace volto::rig
