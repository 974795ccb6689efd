#include "retarget/packed_corrections.h"

#include <algorithm>
#include <cmath>

#include "rig/pose.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "retarget/packed_corrections.cpp"
#include "hwy/foreach_target.h"  // must come before highway.h
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace volto::retarget {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void addHere(const PackedCorrection& correction, float weight, Vertex* positions) {
  const hn::ScalableTag<float> d;
  const hn::Rebind<std::int16_t, decltype(d)> narrow;
  const hn::Rebind<std::int32_t, decltype(d)> wide;
  const std::size_t lanes = hn::Lanes(d);
  const float by = weight * correction.unit;
  const auto factor = hn::Set(d, by);
  const std::int16_t* step = correction.steps.data();
  for (const PackedCorrection::Run run : correction.runs) {
    float* const to = positions[run.first].data();
    const std::size_t count = 3 * static_cast<std::size_t>(run.count);
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
      const auto moved = hn::ConvertTo(d, hn::PromoteTo(wide, hn::LoadU(narrow, step + i)));
      hn::StoreU(hn::MulAdd(moved, factor, hn::LoadU(d, to + i)), d, to + i);
    }
    for (; i < count; ++i) to[i] += by * static_cast<float>(step[i]);
    step += count;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace volto::retarget
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volto::retarget {

HWY_EXPORT(addHere);

namespace {

constexpr float kFixedPointMax = 32767.0F;
constexpr std::uint32_t kBridged = 4;  // vertices that do not move cost less than another run

}  // namespace

PackedCorrection pack(const rig::SparseDisplacement& correction) {
  PackedCorrection out;
  float largest = 0;
  for (const auto& displacement : correction.displacement)
    for (const float x : displacement) largest = std::max(largest, std::abs(x));
  if (largest == 0) return out;
  out.unit = largest / kFixedPointMax;
  for (std::size_t i = 0; i < correction.vertex.size(); ++i) {
    const std::uint32_t vertex = correction.vertex[i];  // they ascend
    const std::uint32_t end = out.runs.empty() ? 0 : out.runs.back().first + out.runs.back().count;
    if (out.runs.empty() || vertex > end + kBridged) {
      out.runs.push_back({vertex, 1});
    } else {
      out.steps.insert(out.steps.end(), 3 * static_cast<std::size_t>(vertex - end), std::int16_t{0});
      out.runs.back().count += vertex - end + 1;
    }
    for (const float x : correction.displacement[i])
      out.steps.push_back(
          static_cast<std::int16_t>(std::clamp(std::round(x / out.unit), -kFixedPointMax, kFixedPointMax)));
  }
  return out;
}

void add(const PackedCorrection& correction, float weight, Vertex* positions) {
  HWY_DYNAMIC_DISPATCH(addHere)(correction, weight, positions);
}

PackedCorrections::PackedCorrections(const rig::Rig& rig) {
  for (const rig::Blendshape& shape : rig.blendshapes) shapes_.push_back(pack(shape.correction));
  for (const rig::Combination& combination : rig.combinations) {
    combinations_.push_back(pack(combination.correction));
    rules_.push_back({combination.name, combination.rule, combination.drivers, {}});
  }
}

void PackedCorrections::addTo(std::span<const float> weights, std::span<Vertex> positions) const {
  const auto addOne = [&](const PackedCorrection& correction, float weight) {
    if (std::abs(weight) > rig::kNoWeight && !correction.runs.empty()) add(correction, weight, positions.data());
  };
  for (std::size_t k = 0; k < shapes_.size(); ++k) addOne(shapes_[k], weights[k]);
  for (std::size_t k = 0; k < rules_.size(); ++k) addOne(combinations_[k], rig::weightOf(rules_[k], weights));
}

}  // namespace volto::retarget
#endif  // HWY_ONCE
