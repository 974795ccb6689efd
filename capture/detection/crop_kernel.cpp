#include "capture/detection/crop_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "capture/detection/crop_kernel.cpp"
#include "hwy/foreach_target.h"  // must come before highway.h
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace volto::capture {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
bool sampleInsideHere(const CropSamples&) { return false; }
int halveRowsHere(const std::uint8_t*, const std::uint8_t*, int, std::uint8_t*) { return 0; }
std::size_t addRowsHere(std::span<const std::uint8_t* const>, std::span<std::uint16_t>) { return 0; }
#else

namespace hn = hwy::HWY_NAMESPACE;

using Numbers = hn::CappedTag<std::int32_t, 8>;
using Half = hn::Half<Numbers>;
using Pairs = hn::Repartition<std::int64_t, Numbers>;
using Floats = hn::Rebind<float, Numbers>;
using NumberVec = hn::Vec<Numbers>;

// The image as a gather sees it.
struct Texels {
  const std::int32_t* base;
  NumberVec row_bytes;

  // Blue, green, red and a byte of the next pixel.
  NumberVec at(NumberVec x, NumberVec y) const { return hn::GatherOffset(Numbers(), base, offset(x, y)); }

  // A pixel and the one beside it: blue, green, red, blue; then green, red and two bytes of the next but one.
  // A gather costs by its lanes, so half as many of twice the width cost half.
  void beside(NumberVec x, NumberVec y, NumberVec& first, NumberVec& second) const {
    const auto at = offset(x, y);
    const auto* const from = reinterpret_cast<const std::int64_t*>(base);
    const auto low = hn::GatherOffset(Pairs(), from, hn::PromoteTo(Pairs(), hn::LowerHalf(Half(), at)));
    const auto high = hn::GatherOffset(Pairs(), from, hn::PromoteTo(Pairs(), hn::UpperHalf(Half(), at)));
    first = hn::ConcatEven(Numbers(), hn::BitCast(Numbers(), high), hn::BitCast(Numbers(), low));
    second = hn::ConcatOdd(Numbers(), hn::BitCast(Numbers(), high), hn::BitCast(Numbers(), low));
  }

 private:
  NumberVec offset(NumberVec x, NumberVec y) const { return hn::Add(hn::Mul(y, row_bytes), hn::Add(hn::Add(x, x), x)); }
};

template <int kShift>
hn::Vec<Floats> byteOf(NumberVec texel) {
  return hn::ConvertTo(Floats(), hn::And(hn::ShiftRight<kShift>(texel), hn::Set(Numbers(), 0xFF)));
}

struct Colours {
  hn::Vec<Floats> blue, green, red;
};

Colours bilinear(const Texels& texels, NumberVec x, NumberVec y) {
  const Floats d;
  const auto fraction = [&](NumberVec v) HWY_ATTR {
    return hn::Mul(hn::ConvertTo(d, hn::And(v, hn::Set(Numbers(), (1 << kFixedBits) - 1))),
                   hn::Set(d, 1.0F / (1 << kFixedBits)));
  };
  const auto one = hn::Set(d, 1.0F);
  const auto fx = fraction(x), fy = fraction(y);
  const auto gx = hn::Sub(one, fx), gy = hn::Sub(one, fy);
  const auto x0 = hn::ShiftRight<kFixedBits>(x), y0 = hn::ShiftRight<kFixedBits>(y);
  NumberVec above, above_right, below, below_right;
  texels.beside(x0, y0, above, above_right);
  texels.beside(x0, hn::Add(y0, hn::Set(Numbers(), 1)), below, below_right);
  const auto wa = hn::Mul(gx, gy), wb = hn::Mul(fx, gy), wc = hn::Mul(gx, fy), we = hn::Mul(fx, fy);
  const auto mix = [&](auto va, auto vb, auto vc, auto ve) HWY_ATTR {
    return hn::Add(hn::Add(hn::Add(hn::Mul(wa, va), hn::Mul(wb, vb)), hn::Mul(wc, vc)), hn::Mul(we, ve));
  };
  return {mix(byteOf<0>(above), byteOf<24>(above), byteOf<0>(below), byteOf<24>(below)),
          mix(byteOf<8>(above), byteOf<0>(above_right), byteOf<8>(below), byteOf<0>(below_right)),
          mix(byteOf<16>(above), byteOf<8>(above_right), byteOf<16>(below), byteOf<8>(below_right))};
}

// Sums of up to 64 bytes: 16 bits for each colour, blue and red in one number.
struct Sums {
  NumberVec blue_red, green;

  void add(NumberVec texel) {
    blue_red = hn::Add(blue_red, hn::And(texel, hn::Set(Numbers(), 0x00FF00FF)));
    green = hn::Add(green, hn::And(hn::ShiftRight<8>(texel), hn::Set(Numbers(), 0xFF)));
  }
  Colours colours() const {
    const Floats d;
    return {hn::ConvertTo(d, hn::And(blue_red, hn::Set(Numbers(), 0xFFFF))), hn::ConvertTo(d, green),
            hn::ConvertTo(d, hn::ShiftRight<16>(blue_red))};
  }
};

bool sampleInsideHere(const CropSamples& crop) {
  const int lanes = static_cast<int>(hn::Lanes(Numbers()));
  if (crop.width < lanes) return false;
  const ImageFromCrop& m = crop.image_from_crop;
  const int n = crop.taps;
  const double step = 1.0 / n, shift = n == 1 ? -0.5 : 0.0;
  const auto fixed = [](double v) { return static_cast<std::int32_t>(std::llround(v * (1 << kFixedBits))); };
  const auto step_x = hn::Set(Numbers(), fixed(m.a * step)), step_y = hn::Set(Numbers(), fixed(m.b * step));
  thread_local std::vector<std::int32_t> across;  // what a column adds to x, then to y; fixed point as all places here
  across.resize(2 * static_cast<std::size_t>(crop.width));
  std::int32_t* const across_x = across.data();
  std::int32_t* const across_y = across_x + crop.width;
  for (int column = 0; column < crop.width; ++column) {
    const double x0 = column + 0.5 * step;
    across_x[column] = fixed(m.a * x0);
    across_y[column] = fixed(m.b * x0);
  }
  const Texels texels{reinterpret_cast<const std::int32_t*>(crop.image->bgr.data()),
                      hn::Set(Numbers(), 3 * crop.image->width)};
  const Floats d;
  std::size_t row_start = 0;
  std::array<std::int32_t, kMostTaps> down_x, down_y;  // what each line of a row's samples adds
  for (int row = 0; row < crop.height; ++row, row_start += static_cast<std::size_t>(crop.width)) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      const double y0 = row + (static_cast<double>(i) + 0.5) * step;
      down_x[i] = fixed(m.tx + shift - m.b * y0);
      down_y[i] = fixed(m.ty + shift + m.a * y0);
    }
    for (int next = 0; next < crop.width; next += lanes) {
      const int column = std::min(next, crop.width - lanes);  // the last ones may overlap those before
      Sums sums{hn::Zero(Numbers()), hn::Zero(Numbers())};
      Colours colours{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
      for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
        auto x = hn::Add(hn::LoadU(Numbers(), across_x + column), hn::Set(Numbers(), down_x[i]));
        auto y = hn::Add(hn::LoadU(Numbers(), across_y + column), hn::Set(Numbers(), down_y[i]));
        if (n == 1) {
          colours = bilinear(texels, x, y);
          break;
        }
        for (int j = 0; j < n; ++j, x = hn::Add(x, step_x), y = hn::Add(y, step_y))
          sums.add(texels.at(hn::ShiftRight<kFixedBits>(x), hn::ShiftRight<kFixedBits>(y)));
      }
      if (n > 1) colours = sums.colours();
      const std::size_t at = row_start + static_cast<std::size_t>(column);
      const auto put = [&](std::size_t c, hn::Vec<Floats> v) HWY_ATTR {
        hn::StoreU(hn::Add(hn::Mul(v, hn::Set(d, crop.factor[c])), hn::Set(d, crop.offset[c])), d, crop.planes[c] + at);
      };
      put(0, colours.blue), put(1, colours.green), put(2, colours.red);
    }
  }
  return true;
}

// How many of them it has made.
std::size_t addRowsHere(std::span<const std::uint8_t* const> rows, std::span<std::uint16_t> sums) {
  const hn::CappedTag<std::uint16_t, 16> words;
  const hn::Rebind<std::uint8_t, decltype(words)> bytes;
  const std::size_t lanes = hn::Lanes(words);
  std::size_t k = 0;
  for (; k + lanes <= sums.size(); k += lanes) {
    auto sum = hn::Zero(words);
    for (const std::uint8_t* const row : rows) sum = hn::Add(sum, hn::PromoteTo(words, hn::LoadU(bytes, row + k)));
    hn::StoreU(sum, words, sums.data() + k);
  }
  return k;
}

// How many of them it has made. Four pixels of both rows become two: first those at even places and those at odd ones
// are taken apart, each colour in 16 bits.
int halveRowsHere(const std::uint8_t* above, const std::uint8_t* below, int width, std::uint8_t* out) {
  using Bytes = hn::FixedTag<std::uint8_t, 16>;
  using Words = hn::Repartition<std::uint16_t, Bytes>;
  const Bytes bytes;
  const Words words;
  alignas(16) static constexpr std::uint8_t kEven[16] = {0, 255, 1, 255, 2,   255, 6,   255,
                                                         7, 255, 8, 255, 255, 255, 255, 255};
  alignas(16) static constexpr std::uint8_t kOdd[16] = {3,  255, 4,  255, 5,   255, 9,   255,
                                                        10, 255, 11, 255, 255, 255, 255, 255};
  const auto even = hn::Load(bytes, kEven), odd = hn::Load(bytes, kOdd);
  const auto pairs = [&](const std::uint8_t* row) HWY_ATTR {
    const auto pixels = hn::LoadU(bytes, row);
    return hn::Add(hn::BitCast(words, hn::TableLookupBytesOr0(pixels, even)),
                   hn::BitCast(words, hn::TableLookupBytesOr0(pixels, odd)));
  };
  const hn::FixedTag<std::uint8_t, 8> halves;
  int x = 0;
  for (; x + 4 <= width; x += 2) {  // reads 16 bytes, uses 12 of them; writes 8, of which the next ones replace 2
    const std::size_t at = 6 * static_cast<std::size_t>(x);
    const auto sum = hn::Add(hn::Add(pairs(above + at), pairs(below + at)), hn::Set(words, 2));
    const auto mean = hn::BitCast(hn::RebindToSigned<Words>(), hn::ShiftRight<2>(sum));
    hn::StoreU(hn::DemoteTo(halves, mean), halves, out + 3 * static_cast<std::size_t>(x));
  }
  return x;
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace volto::capture
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volto::capture {

HWY_EXPORT(sampleInsideHere);
HWY_EXPORT(halveRowsHere);
HWY_EXPORT(addRowsHere);

bool sampleInside(const CropSamples& crop) { return HWY_DYNAMIC_DISPATCH(sampleInsideHere)(crop); }

void addRows(std::span<const std::uint8_t* const> rows, std::span<std::uint16_t> sums) {
  for (std::size_t k = HWY_DYNAMIC_DISPATCH(addRowsHere)(rows, sums); k < sums.size(); ++k) {
    unsigned sum = 0;
    for (const std::uint8_t* const row : rows) sum += row[k];
    sums[k] = static_cast<std::uint16_t>(sum);
  }
}

void halveRows(const std::uint8_t* above, const std::uint8_t* below, int width, std::uint8_t* out) {
  const int done = HWY_DYNAMIC_DISPATCH(halveRowsHere)(above, below, width, out);
  for (std::size_t i = 3 * static_cast<std::size_t>(done); i < 3 * static_cast<std::size_t>(width); ++i) {
    const std::size_t at = i / 3 * 6 + i % 3;
    out[i] = static_cast<std::uint8_t>((above[at] + above[at + 3] + below[at] + below[at + 3] + 2) / 4);
  }
}

}  // namespace volto::capture
#endif  // HWY_ONCE
