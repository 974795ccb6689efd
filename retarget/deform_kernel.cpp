#include "retarget/deform_kernel.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "retarget/deform_kernel.cpp"
#include "hwy/foreach_target.h"  // must come before highway.h
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace volto::retarget {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kBlockLanes>;
using Weights = hn::Rebind<std::int16_t, Floats>;
using WideWeights = hn::Rebind<std::int32_t, Floats>;

inline hn::Vec<Floats> loadWeights(const std::int16_t* from) {
  return hn::ConvertTo(Floats(), hn::PromoteTo(WideWeights(), hn::LoadU(Weights(), from)));
}

// Writes 16 positions (48 floats, xyz after xyz) for one block.
inline void blockPositions(const DeformBlock& block, const std::uint8_t* points, const std::int16_t* weights,
                           const float* neutral, const MeshMaskDisplacement& displacement, float* positions) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d);
  const auto unit = hn::Set(d, block.weight_unit);
  // Two vectors at a time: enough independent sums to keep the multipliers busy on every instruction set.
  std::size_t lane = 0;
  for (; lane + 2 * lanes <= kBlockLanes; lane += 2 * lanes) {
    auto x0 = hn::Zero(d), y0 = hn::Zero(d), z0 = hn::Zero(d);
    auto x1 = hn::Zero(d), y1 = hn::Zero(d), z1 = hn::Zero(d);
    const std::int16_t* w = weights + lane;
    for (std::size_t i = 0; i < block.point_count; ++i, w += kBlockLanes) {
      const float* move = displacement[points[i]].data();
      const auto dx = hn::Set(d, move[0]), dy = hn::Set(d, move[1]), dz = hn::Set(d, move[2]);
      const auto w0 = loadWeights(w), w1 = loadWeights(w + lanes);
      x0 = hn::MulAdd(w0, dx, x0);
      y0 = hn::MulAdd(w0, dy, y0);
      z0 = hn::MulAdd(w0, dz, z0);
      x1 = hn::MulAdd(w1, dx, x1);
      y1 = hn::MulAdd(w1, dy, y1);
      z1 = hn::MulAdd(w1, dz, z1);
    }
    const float* n0 = neutral + lane;
    const float* n1 = n0 + lanes;
    hn::StoreInterleaved3(hn::MulAdd(x0, unit, hn::LoadU(d, n0)), hn::MulAdd(y0, unit, hn::LoadU(d, n0 + kBlockLanes)),
                          hn::MulAdd(z0, unit, hn::LoadU(d, n0 + 2 * kBlockLanes)), d, positions + 3 * lane);
    hn::StoreInterleaved3(hn::MulAdd(x1, unit, hn::LoadU(d, n1)), hn::MulAdd(y1, unit, hn::LoadU(d, n1 + kBlockLanes)),
                          hn::MulAdd(z1, unit, hn::LoadU(d, n1 + 2 * kBlockLanes)), d, positions + 3 * (lane + lanes));
  }
  for (; lane < kBlockLanes; lane += lanes) {
    auto x = hn::Zero(d), y = hn::Zero(d), z = hn::Zero(d);
    const std::int16_t* w = weights + lane;
    for (std::size_t i = 0; i < block.point_count; ++i, w += kBlockLanes) {
      const float* move = displacement[points[i]].data();
      const auto w0 = loadWeights(w);
      x = hn::MulAdd(w0, hn::Set(d, move[0]), x);
      y = hn::MulAdd(w0, hn::Set(d, move[1]), y);
      z = hn::MulAdd(w0, hn::Set(d, move[2]), z);
    }
    const float* n = neutral + lane;
    hn::StoreInterleaved3(hn::MulAdd(x, unit, hn::LoadU(d, n)), hn::MulAdd(y, unit, hn::LoadU(d, n + kBlockLanes)),
                          hn::MulAdd(z, unit, hn::LoadU(d, n + 2 * kBlockLanes)), d, positions + 3 * lane);
  }
}

void deformBlocksHere(const PackedOperator& packed, const MeshMaskDisplacement& displacement, Vertex* out) {
  HWY_ALIGN float scratch[3 * kBlockLanes];
  const float* neutral = packed.neutral.data();
  const std::uint32_t* vertex = packed.vertex.data();
  for (const DeformBlock& block : packed.blocks) {
    const std::uint8_t* points = packed.points.data() + block.first_point;
    const std::int16_t* weights = packed.weights.data() + std::size_t{block.first_point} * kBlockLanes;
    if (block.in_order) {
      blockPositions(block, points, weights, neutral, displacement, out[vertex[0]].data());
    } else {
      blockPositions(block, points, weights, neutral, displacement, scratch);
      for (std::size_t lane = 0; lane < block.lane_count; ++lane) {
        std::memcpy(out[vertex[lane]].data(), scratch + 3 * lane, sizeof(Vertex));
      }
    }
    neutral += 3 * kBlockLanes;
    vertex += kBlockLanes;
  }
}

const char* targetHere() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace volto::retarget
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volto::retarget {

HWY_EXPORT(deformBlocksHere);
HWY_EXPORT(targetHere);

void deformBlocks(const PackedOperator& packed, const MeshMaskDisplacement& displacement, Vertex* out) {
  HWY_DYNAMIC_DISPATCH(deformBlocksHere)(packed, displacement, out);
}

const char* deformKernelTarget() { return HWY_DYNAMIC_DISPATCH(targetHere)(); }

}  // namespace volto::retarget
#endif  // HWY_ONCE
