#include "capture/detection/crop_kernel.h"

#include <algorithm>
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
#else

namespace hn = hwy::HWY_NAMESPACE;

using Numbers = hn::CappedTag<std::int32_t, 8>;
using Half = hn::Half<Numbers>;
using Doubles = hn::Rebind<double, Half>;
using Floats = hn::Rebind<float, Numbers>;
using NumberVec = hn::Vec<Numbers>;

// The image as a gather sees it.
struct Texels {
  const std::int32_t* base;
  NumberVec row_bytes;

  // Blue, green, red and a byte of the next pixel.
  NumberVec at(NumberVec x, NumberVec y) const {
    const auto pixel = hn::Add(hn::Add(x, x), x);
    return hn::GatherOffset(Numbers(), base, hn::Add(hn::Mul(y, row_bytes), pixel));
  }
};

// (across + down + along + shift) in fixed point; truncation, so for positive numbers only.
NumberVec position(const double* across, double down, double along, double shift) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const auto half = [&](const double* from) HWY_ATTR {
    const auto sum =
        hn::Add(hn::Add(hn::Add(hn::LoadU(d, from), hn::Set(d, down)), hn::Set(d, along)), hn::Set(d, shift));
    return hn::DemoteTo(Half(), hn::Mul(sum, hn::Set(d, 1 << kFixedBits)));
  };
  return hn::Combine(Numbers(), half(across + lanes), half(across));
}

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
  const auto step = hn::Set(Numbers(), 1);
  const auto x1 = hn::Add(x0, step), y1 = hn::Add(y0, step);
  const auto a = texels.at(x0, y0), b = texels.at(x1, y0), c = texels.at(x0, y1), e = texels.at(x1, y1);
  const auto wa = hn::Mul(gx, gy), wb = hn::Mul(fx, gy), wc = hn::Mul(gx, fy), we = hn::Mul(fx, fy);
  const auto mix = [&](auto va, auto vb, auto vc, auto ve) HWY_ATTR {
    return hn::Add(hn::Add(hn::Add(hn::Mul(wa, va), hn::Mul(wb, vb)), hn::Mul(wc, vc)), hn::Mul(we, ve));
  };
  return {mix(byteOf<0>(a), byteOf<0>(b), byteOf<0>(c), byteOf<0>(e)),
          mix(byteOf<8>(a), byteOf<8>(b), byteOf<8>(c), byteOf<8>(e)),
          mix(byteOf<16>(a), byteOf<16>(b), byteOf<16>(c), byteOf<16>(e))};
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
  const auto fixedStep = [&](double v) HWY_ATTR {
    return hn::Set(Numbers(), static_cast<std::int32_t>(std::llround(v * step * (1 << kFixedBits))));
  };
  const auto step_x = fixedStep(m.a), step_y = fixedStep(m.b);
  std::vector<double> across(2 * static_cast<std::size_t>(crop.width));  // what a column adds to x, then to y
  double* const across_x = across.data();
  double* const across_y = across_x + crop.width;
  for (int column = 0; column < crop.width; ++column) {
    const double x0 = column + 0.5 * step;
    across_x[column] = m.a * x0;
    across_y[column] = m.b * x0;
  }
  const Texels texels{reinterpret_cast<const std::int32_t*>(crop.image->bgr.data()),
                      hn::Set(Numbers(), 3 * crop.image->width)};
  const Floats d;
  std::size_t row_start = 0;
  for (int row = 0; row < crop.height; ++row, row_start += static_cast<std::size_t>(crop.width)) {
    for (int next = 0; next < crop.width; next += lanes) {
      const int column = std::min(next, crop.width - lanes);  // the last ones may overlap those before
      Sums sums{hn::Zero(Numbers()), hn::Zero(Numbers())};
      Colours colours{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
      for (int i = 0; i < n; ++i) {
        const double y0 = row + (i + 0.5) * step;
        auto x = position(across_x + column, -(m.b * y0), m.tx, shift);
        auto y = position(across_y + column, m.a * y0, m.ty, shift);
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
int halveRowsHere(const std::uint8_t* above, const std::uint8_t* below, int width, std::uint8_t* out) {
  using Bytes = hn::FixedTag<std::uint8_t, 16>;
  using Words = hn::Repartition<std::uint16_t, Bytes>;
  using Halves = hn::FixedTag<std::uint8_t, 8>;
  const Words words;
  const auto low = hn::Set(words, 0xFF), two = hn::Set(words, 2);
  const auto mean = [&](auto a, auto b) HWY_ATTR {
    const auto u = hn::BitCast(words, a), v = hn::BitCast(words, b);
    const auto sum =
        hn::Add(hn::Add(hn::And(u, low), hn::ShiftRight<8>(u)), hn::Add(hn::And(v, low), hn::ShiftRight<8>(v)));
    const auto rounded = hn::ShiftRight<2>(hn::Add(sum, two));
    return hn::DemoteTo(Halves(), hn::BitCast(hn::RebindToSigned<Words>(), rounded));
  };
  int x = 0;
  for (; x + 8 <= width; x += 8) {
    hn::Vec<Bytes> b0, g0, r0, b1, g1, r1;
    hn::LoadInterleaved3(Bytes(), above + 6 * static_cast<std::size_t>(x), b0, g0, r0);
    hn::LoadInterleaved3(Bytes(), below + 6 * static_cast<std::size_t>(x), b1, g1, r1);
    hn::StoreInterleaved3(mean(b0, b1), mean(g0, g1), mean(r0, r1), Halves(), out + 3 * static_cast<std::size_t>(x));
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

bool sampleInside(const CropSamples& crop) { return HWY_DYNAMIC_DISPATCH(sampleInsideHere)(crop); }

void halveRows(const std::uint8_t* above, const std::uint8_t* below, int width, std::uint8_t* out) {
  const int done = HWY_DYNAMIC_DISPATCH(halveRowsHere)(above, below, width, out);
  for (std::size_t i = 3 * static_cast<std::size_t>(done); i < 3 * static_cast<std::size_t>(width); ++i) {
    const std::size_t at = i / 3 * 6 + i % 3;
    out[i] = static_cast<std::uint8_t>((above[at] + above[at + 3] + below[at] + below[at + 3] + 2) / 4);
  }
}

}  // namespace volto::capture
#endif  // HWY_ONCE
