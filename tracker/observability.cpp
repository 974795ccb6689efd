#include "tracker/observability.h"

#include "rig/fapu.h"
#include "tracker/mean_face.h"

namespace volto::tracker {

ShapeVector visibleShare(const MeasuredPoints& points, const rig::ExpressionTable& table, bool with_depth) {
  const rig::FeaturePointPositions scale = rig::fapuScale(rig::measureFapu(meanFace()).fapu);
  const auto energy = [&](int shape, int feature, int axes) {
    double sum = 0;
    for (int c = 0; c < axes; ++c) {
      const double d = table.basis()(3 * feature + c, shape) * scale(feature, c);
      sum += d * d;
    }
    return sum;
  };
  ShapeVector share = ShapeVector::Zero();
  for (int k = 0; k < kShapes; ++k) {
    double all = 0, seen = 0;
    for (int i = 0; i < static_cast<int>(kFeaturePointCount); ++i) all += energy(k, i, 3);
    for (const int feature : points.feature) seen += energy(k, feature, with_depth ? 3 : 2);
    if (all > 0) share[k] = seen / all;
  }
  return share;
}

ArkitObserved observableShapes(const MeasuredPoints& points, const rig::ExpressionTable& table, bool with_depth) {
  const ShapeVector share = visibleShare(points, table, with_depth);
  ArkitObserved observed;
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const std::string_view name = kArkitBlendshapeNames[k];
    const bool eyeball = name.starts_with("eyeLookIn") || name.starts_with("eyeLookOut");
    observed[k] = table.movesMask(k) && !eyeball && share[static_cast<Eigen::Index>(k)] >= kLeastVisibleShare;
  }
  return observed;
}

}  // namespace volto::tracker
