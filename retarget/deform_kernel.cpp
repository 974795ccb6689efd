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

// Where a block's positions go: straight into the mesh, three floats each, or to a scratch of four floats each, from
// where they can be read back one by one without a read that straddles two writes.
enum class Stride { packed = 3, padded = 4 };

template <Stride kStride, typename V>
inline void storePositions(V x, V y, V z, float* to) {
  const Floats d;
  if constexpr (kStride == Stride::packed) {
    hn::StoreInterleaved3(x, y, z, d, to);
  } else {
    hn::StoreInterleaved4(x, y, z, hn::Zero(d), d, to);
  }
}

// The 16 positions of one block.
template <Stride kStride>
inline void blockPositions(const DeformBlock& block, const std::uint8_t* points, const std::int16_t* weights,
                           const float* neutral, const MeshMaskDisplacement& displacement, float* positions) {
  constexpr std::size_t kFloats = static_cast<std::size_t>(kStride);
  const Floats d;
  const std::size_t lanes = hn::Lanes(d);
  const auto unit = hn::Set(d, block.weight_unit);
  std::size_t lane = 0;
  // Two vectors of vertices at a time, and even and odd control points summed apart: twelve sums that do not wait for
  // each other keep the multipliers busy, and fit into sixteen registers.
  for (; lane + 2 * lanes <= kBlockLanes; lane += 2 * lanes) {
    auto x0 = hn::Zero(d), y0 = hn::Zero(d), z0 = hn::Zero(d), x1 = hn::Zero(d), y1 = hn::Zero(d), z1 = hn::Zero(d);
    auto x2 = hn::Zero(d), y2 = hn::Zero(d), z2 = hn::Zero(d), x3 = hn::Zero(d), y3 = hn::Zero(d), z3 = hn::Zero(d);
    const std::int16_t* w = weights + lane;
    std::size_t i = 0;
    for (; i + 2 <= block.point_count; i += 2, w += 2 * kBlockLanes) {
      const float* even = displacement[points[i]].data();
      const auto w0 = loadWeights(w), w1 = loadWeights(w + lanes);
      const auto ex = hn::Set(d, even[0]);
      x0 = hn::MulAdd(w0, ex, x0);
      x1 = hn::MulAdd(w1, ex, x1);
      const auto ey = hn::Set(d, even[1]);
      y0 = hn::MulAdd(w0, ey, y0);
      y1 = hn::MulAdd(w1, ey, y1);
      const auto ez = hn::Set(d, even[2]);
      z0 = hn::MulAdd(w0, ez, z0);
      z1 = hn::MulAdd(w1, ez, z1);
      const float* odd = displacement[points[i + 1]].data();
      const auto w2 = loadWeights(w + kBlockLanes), w3 = loadWeights(w + kBlockLanes + lanes);
      const auto ox = hn::Set(d, odd[0]);
      x2 = hn::MulAdd(w2, ox, x2);
      x3 = hn::MulAdd(w3, ox, x3);
      const auto oy = hn::Set(d, odd[1]);
      y2 = hn::MulAdd(w2, oy, y2);
      y3 = hn::MulAdd(w3, oy, y3);
      const auto oz = hn::Set(d, odd[2]);
      z2 = hn::MulAdd(w2, oz, z2);
      z3 = hn::MulAdd(w3, oz, z3);
    }
    if (i < block.point_count) {
      const float* last = displacement[points[i]].data();
      const auto w0 = loadWeights(w), w1 = loadWeights(w + lanes);
      const auto lx = hn::Set(d, last[0]), ly = hn::Set(d, last[1]), lz = hn::Set(d, last[2]);
      x0 = hn::MulAdd(w0, lx, x0);
      x1 = hn::MulAdd(w1, lx, x1);
      y0 = hn::MulAdd(w0, ly, y0);
      y1 = hn::MulAdd(w1, ly, y1);
      z0 = hn::MulAdd(w0, lz, z0);
      z1 = hn::MulAdd(w1, lz, z1);
    }
    const float* n0 = neutral + lane;
    const float* n1 = n0 + lanes;
    storePositions<kStride>(hn::MulAdd(hn::Add(x0, x2), unit, hn::LoadU(d, n0)),
                            hn::MulAdd(hn::Add(y0, y2), unit, hn::LoadU(d, n0 + kBlockLanes)),
                            hn::MulAdd(hn::Add(z0, z2), unit, hn::LoadU(d, n0 + 2 * kBlockLanes)),
                            positions + kFloats * lane);
    storePositions<kStride>(hn::MulAdd(hn::Add(x1, x3), unit, hn::LoadU(d, n1)),
                            hn::MulAdd(hn::Add(y1, y3), unit, hn::LoadU(d, n1 + kBlockLanes)),
                            hn::MulAdd(hn::Add(z1, z3), unit, hn::LoadU(d, n1 + 2 * kBlockLanes)),
                            positions + kFloats * (lane + lanes));
  }
  // One vector as wide as the block (AVX-512): the same sums in the same order.
  for (; lane < kBlockLanes; lane += lanes) {
    auto x0 = hn::Zero(d), y0 = hn::Zero(d), z0 = hn::Zero(d), x2 = hn::Zero(d), y2 = hn::Zero(d), z2 = hn::Zero(d);
    const std::int16_t* w = weights + lane;
    std::size_t i = 0;
    for (; i + 2 <= block.point_count; i += 2, w += 2 * kBlockLanes) {
      const float* even = displacement[points[i]].data();
      const float* odd = displacement[points[i + 1]].data();
      const auto w0 = loadWeights(w), w2 = loadWeights(w + kBlockLanes);
      x0 = hn::MulAdd(w0, hn::Set(d, even[0]), x0);
      y0 = hn::MulAdd(w0, hn::Set(d, even[1]), y0);
      z0 = hn::MulAdd(w0, hn::Set(d, even[2]), z0);
      x2 = hn::MulAdd(w2, hn::Set(d, odd[0]), x2);
      y2 = hn::MulAdd(w2, hn::Set(d, odd[1]), y2);
      z2 = hn::MulAdd(w2, hn::Set(d, odd[2]), z2);
    }
    if (i < block.point_count) {
      const float* last = displacement[points[i]].data();
      const auto w0 = loadWeights(w);
      x0 = hn::MulAdd(w0, hn::Set(d, last[0]), x0);
      y0 = hn::MulAdd(w0, hn::Set(d, last[1]), y0);
      z0 = hn::MulAdd(w0, hn::Set(d, last[2]), z0);
    }
    const float* n = neutral + lane;
    storePositions<kStride>(hn::MulAdd(hn::Add(x0, x2), unit, hn::LoadU(d, n)),
                            hn::MulAdd(hn::Add(y0, y2), unit, hn::LoadU(d, n + kBlockLanes)),
                            hn::MulAdd(hn::Add(z0, z2), unit, hn::LoadU(d, n + 2 * kBlockLanes)),
                            positions + kFloats * lane);
  }
}

void deformBlocksHere(const PackedOperator& packed, const MeshMaskDisplacement& displacement, Vertex* out) {
  HWY_ALIGN float scratch[4 * kBlockLanes];
  const float* neutral = packed.neutral.data();
  const std::uint32_t* vertex = packed.vertex.data();
  for (const DeformBlock& block : packed.blocks) {
    const std::uint8_t* points = packed.points.data() + block.first_point;
    const std::int16_t* weights = packed.weights.data() + std::size_t{block.first_point} * kBlockLanes;
    if (block.in_order) {
      blockPositions<Stride::packed>(block, points, weights, neutral, displacement, out[vertex[0]].data());
    } else {
      blockPositions<Stride::padded>(block, points, weights, neutral, displacement, scratch);
      for (std::size_t lane = 0; lane < block.lane_count; ++lane) {
        std::memcpy(out[vertex[lane]].data(), scratch + 4 * lane, sizeof(Vertex));
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
