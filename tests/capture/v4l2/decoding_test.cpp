// Bytes of a camera to pixels.
#include <cmath>

#include <gtest/gtest.h>

#include "capture/v4l2/mjpeg_decoder.h"
#include "capture/v4l2/pixel_conversion.h"
#include "tests/capture/v4l2/camera_stage.h"

namespace volto::capture {
namespace {

using Result = v4l2::MjpegDecoder::Result;
struct Decoded {
  Result result;
  std::string problem;
  int error;
};

Decoded decode(const std::vector<std::uint8_t>& jpeg, int width = 320, int height = 240) {
  v4l2::MjpegDecoder decoder;
  Image image;
  image.resize(width, height);
  const Result result = decoder.decode(jpeg, width, height, image.bgr);
  return {result, decoder.problem(), colourError(image)};
}

class ForgivenJpeg : public testing::TestWithParam<const char*> {};

TEST_P(ForgivenJpeg, IsDecodedAsIfNothingWereWrong) {
  const Decoded decoded = decode(fake::makeJpeg(320, 240, GetParam()));
  EXPECT_NE(decoded.result, Result::corrupt) << decoded.problem;
  EXPECT_LE(decoded.error, 4);
}
INSTANTIATE_TEST_SUITE_P(All, ForgivenJpeg,
                         testing::Values("ok", "nodht", "noeoi", "trailing", "preamble", "extraneous"));

class RefusedJpeg : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(RefusedJpeg, IsCorruptAndSaysWhy) {
  const Decoded decoded = decode(fake::makeJpeg(320, 240, GetParam().first));
  EXPECT_EQ(decoded.result, Result::corrupt);
  EXPECT_TRUE(says(decoded.problem, {GetParam().second}));
}
INSTANTIATE_TEST_SUITE_P(All, RefusedJpeg,
                         testing::Values(std::pair{"truncate", "premature end"},
                                         std::pair{"progressive", "progressive"}, std::pair{"othersize", "336x240"},
                                         std::pair{"65535x65535", "Maximum supported image dimension"},
                                         std::pair{"garbage", "not a JPEG"}, std::pair{"empty", "not a JPEG"}));

TEST(MjpegDecoder, StrayBytesAreAWarningAndNoDamage) {
  EXPECT_EQ(decode(fake::makeJpeg(320, 240, "extraneous")).result, Result::good_with_warnings);
  EXPECT_EQ(decode(fake::makeJpeg(320, 240, "ok")).result, Result::good);
}

TEST(MjpegDecoder, GoesOnAfterEveryBrokenPicture) {
  v4l2::MjpegDecoder decoder;
  Image image;
  image.resize(320, 240);
  const std::vector<std::uint8_t> good = fake::makeJpeg(320, 240, "ok");
  for (std::uint32_t seed = 0; seed < 300; ++seed) {
    decoder.decode(fake::makeJpeg(320, 240, "bitflip", seed), 320, 240, image.bgr);
    if (seed % 10 == 0) {
      ASSERT_EQ(decoder.decode(good, 320, 240, image.bgr), Result::good);
    }
  }
  EXPECT_LE(colourError(image), 255);
}

TEST(MjpegDecoder, CutAnywhereItNeitherCrashesNorShowsHalfAPicture) {
  const std::vector<std::uint8_t> good = fake::makeJpeg(64, 48, "ok");
  v4l2::MjpegDecoder decoder;
  Image image;
  image.resize(64, 48);
  for (std::size_t size = 0; size + 8 < good.size(); ++size) {
    const std::vector<std::uint8_t> cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
    ASSERT_EQ(decoder.decode(cut, 64, 48, image.bgr), Result::corrupt) << size << " of " << good.size();
  }
}

// Every luminance and colour against the definition in real numbers.
TEST(PixelConversion, IsWithinOneStepOfTheStandardEverywhere) {
  struct Case {
    v4l2::YuvMatrix matrix;
    double kr, kb;
    bool full;
  };
  for (const Case& c :
       {Case{v4l2::kBt601Limited, 0.299, 0.114, false}, Case{v4l2::kBt601Full, 0.299, 0.114, true},
        Case{v4l2::kBt709Limited, 0.2126, 0.0722, false}, Case{v4l2::kBt709Full, 0.2126, 0.0722, true}}) {
    // A row of every brightness is done by the kernel, and its last six pixels also alone, by the loop for what
    // remains.
    double worst = 0;
    std::array<std::uint8_t, 512> yuyv{};
    std::array<std::uint8_t, 768> bgr{};
    const auto check = [&](int y, int u, int v, const std::uint8_t* pixel) {
      const double luma = c.full ? y / 255.0 : (y - 16) / 219.0;
      const double pb = (u - 128) / (c.full ? 255.0 : 224.0), pr = (v - 128) / (c.full ? 255.0 : 224.0);
      const double red = luma + 2 * (1 - c.kr) * pr, blue = luma + 2 * (1 - c.kb) * pb;
      const double green = (luma - c.kr * red - c.kb * blue) / (1 - c.kr - c.kb);
      const std::array<double, 3> truth{blue, green, red};
      for (std::size_t i = 0; i < 3; ++i)
        worst = std::max(worst, std::abs(std::clamp(255 * truth[i], 0.0, 255.0) - pixel[i]));
    };
    for (int u = 0; u < 256; u += 5) {
      for (int v = 0; v < 256; v += 5) {
        for (std::size_t y = 0; y < 256; ++y) {
          yuyv[2 * y] = static_cast<std::uint8_t>(y);
          yuyv[2 * y + 1] = static_cast<std::uint8_t>(y % 2 == 0 ? u : v);
        }
        v4l2::yuyvToBgr(yuyv, 256, 1, 512, c.matrix, bgr);
        for (std::size_t y = 0; y < 256; ++y) check(static_cast<int>(y), u, v, &bgr[3 * y]);
        v4l2::yuyvToBgr(std::span(yuyv).subspan(500), 6, 1, 12, c.matrix, bgr);
        for (std::size_t y = 250; y < 256; ++y) check(static_cast<int>(y), u, v, &bgr[3 * (y - 250)]);
      }
    }
    EXPECT_LE(worst, 1.5);
  }
}

TEST(PixelConversion, ReadsNoByteBeyondThePicture) {
  // Odd sizes and padded rows; the vector is exactly as long as is asked for, so AddressSanitizer sees one byte too
  // many.
  for (const auto& [width, height] :
       {std::pair{5, 3}, std::pair{1, 1}, std::pair{2, 2}, std::pair{7, 4}, std::pair{16, 2}, std::pair{37, 3}}) {
    std::vector<std::uint8_t> bgr(static_cast<std::size_t>(width * height * 3));
    for (const std::size_t padding : {0U, 13U}) {
      const auto w = static_cast<std::size_t>(width);
      const std::size_t yuyv_stride = (w + 1) / 2 * 4 + padding, stride = (w + 1) / 2 * 2 + padding;
      const std::vector<std::uint8_t> yuyv(v4l2::yuyvBytes(width, height, yuyv_stride), 128);
      v4l2::yuyvToBgr(yuyv, width, height, yuyv_stride, v4l2::kBt601Full, bgr);
      EXPECT_EQ(bgr.back(), 128);
      const std::vector<std::uint8_t> nv12(v4l2::nv12Bytes(width, height, stride), 128);
      v4l2::nv12ToBgr(nv12, width, height, stride, v4l2::kBt601Full, bgr);
      EXPECT_EQ(bgr.back(), 128);
      const std::vector<std::uint8_t> grey(v4l2::greyBytes(width, height, stride), 77);
      v4l2::greyToBgr(grey, width, height, stride, bgr);
      EXPECT_EQ(bgr.back(), 77);
    }
  }
}

}  // namespace
}  // namespace volto::capture
