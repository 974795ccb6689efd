#include "capture/v4l2/pixel_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "capture/v4l2/pixel_kernel.cpp"
#include "hwy/foreach_target.h"  // must come before highway.h
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace volto::capture::v4l2 {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
// No vectors: pixel_conversion's own loop does it all.
std::size_t yuyvRowHere(const std::uint8_t*, std::size_t, const YuvMatrix&, std::uint8_t*) { return 0; }
std::size_t nv12RowHere(const std::uint8_t*, const std::uint8_t*, std::size_t, const YuvMatrix&, std::uint8_t*) {
  return 0;
}
std::size_t greyRowHere(const std::uint8_t*, std::size_t, std::uint8_t*) { return 0; }
#else

namespace hn = hwy::HWY_NAMESPACE;

// Sixteen pixels are the fewest that every processor has lanes for, and what cameras' widths are multiples of.
constexpr std::size_t kPixels = 16;
using Bytes = hn::FixedTag<std::uint8_t, kPixels>;
using Half = hn::FixedTag<std::uint8_t, kPixels / 2>;
using Words = hn::FixedTag<std::uint16_t, kPixels / 2>;
using Signed = hn::FixedTag<std::int16_t, kPixels / 2>;

// The matrix in sixty-fourths. Products are taken as the upper half of 32 bits; the factor of blue is too large for
// that and is halved.
struct Factors {
  hn::Vec<Words> luma;
  hn::Vec<Signed> offset, v_to_red, u_to_green, v_to_green, u_to_blue_half;
  explicit Factors(const YuvMatrix& m)
      : luma(hn::Set(Words(), static_cast<std::uint16_t>(m.y_scale * 16384 / 257))),
        offset(hn::Set(Signed(), static_cast<std::int16_t>(32 - m.y_scale * m.y_offset / 4))),
        v_to_red(hn::Set(Signed(), static_cast<std::int16_t>(m.v_to_red * 64))),
        u_to_green(hn::Set(Signed(), static_cast<std::int16_t>(m.u_to_green * 64))),
        v_to_green(hn::Set(Signed(), static_cast<std::int16_t>(m.v_to_green * 64))),
        u_to_blue_half(hn::Set(Signed(), static_cast<std::int16_t>(m.u_to_blue * 32))) {}
};

struct Colours {
  hn::Vec<Half> blue, green, red;
};

// Eight pixels.
inline Colours convert(hn::Vec<Half> y, hn::Vec<Half> u, hn::Vec<Half> v, const Factors& f) {
  const Words words;
  const Signed words_signed;
  const auto wide = hn::PromoteTo(words, y);
  const auto luma =
      hn::Add(hn::BitCast(words_signed, hn::MulHigh(hn::Or(wide, hn::ShiftLeft<8>(wide)), f.luma)), f.offset);
  const auto middle = hn::Set(words_signed, std::int16_t{128});
  const auto du = hn::ShiftLeft<8>(hn::Sub(hn::PromoteTo(words_signed, u), middle));
  const auto dv = hn::ShiftLeft<8>(hn::Sub(hn::PromoteTo(words_signed, v), middle));
  const auto blue = hn::SaturatedAdd(luma, hn::ShiftLeft<1>(hn::MulHigh(du, f.u_to_blue_half)));
  const auto green = hn::Sub(hn::Sub(luma, hn::MulHigh(du, f.u_to_green)), hn::MulHigh(dv, f.v_to_green));
  const auto red = hn::SaturatedAdd(luma, hn::MulHigh(dv, f.v_to_red));
  const Half half;
  return {hn::DemoteTo(half, hn::ShiftRight<6>(blue)), hn::DemoteTo(half, hn::ShiftRight<6>(green)),
          hn::DemoteTo(half, hn::ShiftRight<6>(red))};
}

// Sixteen pixels; `uv` holds eight pairs, each for two pixels.
inline void convertAndStore(hn::Vec<Bytes> y, hn::Vec<Bytes> uv, const Factors& f, std::uint8_t* bgr) {
  const Bytes bytes;
  const Half half;
  const Words pairs;
  const auto pair = hn::BitCast(pairs, uv);
  const auto low = hn::Set(pairs, std::uint16_t{0x00FF});
  const auto u = hn::BitCast(bytes, hn::Or(hn::And(pair, low), hn::ShiftLeft<8>(pair)));
  const auto v = hn::BitCast(bytes, hn::Or(hn::ShiftRight<8>(pair), hn::AndNot(low, pair)));
  const Colours first = convert(hn::LowerHalf(half, y), hn::LowerHalf(half, u), hn::LowerHalf(half, v), f);
  const Colours second = convert(hn::UpperHalf(half, y), hn::UpperHalf(half, u), hn::UpperHalf(half, v), f);
  hn::StoreInterleaved3(hn::Combine(bytes, second.blue, first.blue), hn::Combine(bytes, second.green, first.green),
                        hn::Combine(bytes, second.red, first.red), bytes, bgr);
}

std::size_t yuyvRowHere(const std::uint8_t* yuyv, std::size_t width, const YuvMatrix& matrix, std::uint8_t* bgr) {
  const Factors factors(matrix);
  std::size_t x = 0;
  for (; x + kPixels <= width; x += kPixels) {
    hn::Vec<Bytes> y, uv;
    hn::LoadInterleaved2(Bytes(), yuyv + 2 * x, y, uv);
    convertAndStore(y, uv, factors, bgr + 3 * x);
  }
  return x;
}

std::size_t nv12RowHere(const std::uint8_t* y, const std::uint8_t* uv, std::size_t width, const YuvMatrix& matrix,
                        std::uint8_t* bgr) {
  const Factors factors(matrix);
  std::size_t x = 0;
  for (; x + kPixels <= width; x += kPixels)
    convertAndStore(hn::LoadU(Bytes(), y + x), hn::LoadU(Bytes(), uv + x), factors, bgr + 3 * x);
  return x;
}

std::size_t greyRowHere(const std::uint8_t* grey, std::size_t width, std::uint8_t* bgr) {
  std::size_t x = 0;
  for (; x + kPixels <= width; x += kPixels) {
    const auto y = hn::LoadU(Bytes(), grey + x);
    hn::StoreInterleaved3(y, y, y, Bytes(), bgr + 3 * x);
  }
  return x;
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace volto::capture::v4l2
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volto::capture::v4l2 {

HWY_EXPORT(yuyvRowHere);
HWY_EXPORT(nv12RowHere);
HWY_EXPORT(greyRowHere);

std::size_t yuyvRow(const std::uint8_t* yuyv, std::size_t width, const YuvMatrix& matrix, std::uint8_t* bgr) {
  return HWY_DYNAMIC_DISPATCH(yuyvRowHere)(yuyv, width, matrix, bgr);
}
std::size_t nv12Row(const std::uint8_t* y, const std::uint8_t* uv, std::size_t width, const YuvMatrix& matrix,
                    std::uint8_t* bgr) {
  return HWY_DYNAMIC_DISPATCH(nv12RowHere)(y, uv, width, matrix, bgr);
}
std::size_t greyRow(const std::uint8_t* grey, std::size_t width, std::uint8_t* bgr) {
  return HWY_DYNAMIC_DISPATCH(greyRowHere)(grey, width, bgr);
}

}  // namespace volto::capture::v4l2
#endif  // HWY_ONCE
