#include "capture/detection/crop.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace volto::capture {
namespace {

constexpr FaceAnchors kModel = {{{0.3F, 0.4F}, {0.7F, 0.4F}, {0.5F, 0.55F}, {0.4F, 0.75F}, {0.6F, 0.75F}}};

// The model's own face, turned, enlarged and moved.
FaceAnchors seen(double scale, double roll_rad, double x, double y, double narrower = 1) {
  FaceAnchors out;
  for (std::size_t i = 0; i < kFaceAnchorCount; ++i) {
    const double u = (kModel[i][0] - 0.5) * 100 * narrower, v = (kModel[i][1] - 0.5) * 100;
    out[i] = {static_cast<float>(x + scale * (std::cos(roll_rad) * u - std::sin(roll_rad) * v)),
              static_cast<float>(y + scale * (std::sin(roll_rad) * u + std::cos(roll_rad) * v))};
  }
  return out;
}

TEST(Crop, AFaceStandsUprightWhereTheModelWantsIt) {
  const FaceAnchors face = seen(2.5, 0.6, 320, 200);
  ImageFromCrop crop;
  ASSERT_TRUE(cropOf(face, kModel, 100, 100, crop));
  EXPECT_NEAR(crop.scale(), 2.5, 1e-4);
  for (std::size_t i = 0; i < kFaceAnchorCount; ++i) {
    const auto at = crop.inverse(face[i][0], face[i][1]);
    EXPECT_NEAR(at[0], 100 * kModel[i][0], 1e-2);
    EXPECT_NEAR(at[1], 100 * kModel[i][1], 1e-2);
  }
}

TEST(Crop, DoesNotCloseInOnAFaceThatTurnsAway) {
  ImageFromCrop crop;
  ASSERT_TRUE(cropOf(seen(2.5, 0, 320, 200, 0.4), kModel, 100, 100, crop));
  EXPECT_NEAR(crop.scale(), 2.5, 1e-3);
  EXPECT_NEAR(crop.b, 0, 1e-6);
}

TEST(Crop, AllPointsInOnePlaceOrNotFiniteMakeNoFace) {
  ImageFromCrop crop;
  EXPECT_FALSE(cropOf(FaceAnchors{}, kModel, 100, 100, crop));
  FaceAnchors face = seen(1, 0, 0, 0);
  face[2][0] = face[0][1] = NAN;
  EXPECT_FALSE(cropOf(face, kModel, 100, 100, crop));
}

TEST(Crop, InverseGoesBack) {
  ImageFromCrop crop{1.5, -0.7, 30, 40};
  const auto there = crop(12, 34);
  const auto back = crop.inverse(there[0], there[1]);
  EXPECT_NEAR(back[0], 12, 1e-4);
  EXPECT_NEAR(back[1], 34, 1e-4);
}

// Blue rises with x, green with y.
Image ramp(int side) {
  Image image;
  image.resize(side, side);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const auto i = static_cast<std::size_t>(3 * (y * side + x));
      image.bgr[i] = static_cast<std::uint8_t>(x);
      image.bgr[i + 1] = static_cast<std::uint8_t>(y);
      image.bgr[i + 2] = 200;
    }
  return image;
}

TEST(SampleCrop, ARampStaysARampAtEveryScale) {
  const Image image = ramp(256);
  constexpr int kSide = 16;
  for (const double scale : {0.5, 1.0, 1.7, 3.0, 7.5}) {
    ImageFromCrop crop;
    crop.a = scale;
    crop.tx = crop.ty = 100;
    std::vector<float> planes(3 * kSide * kSide);
    sampleCrop(image, crop, kSide, kSide, {}, false, planes);
    for (const int at : {0, 5, 15}) {
      const double expected = 100 + scale * (at + 0.5) - 0.5;  // pixel centres lie at half
      // What is much smaller than in the image is halved first, and rounded to whole levels each time.
      const double rounding = 0.51 + (scale < 2.5 ? 0 : scale < 5 ? 0.5 : 1);
      EXPECT_NEAR(planes[static_cast<std::size_t>(3 * kSide + at)], expected, rounding) << "x at scale " << scale;
      EXPECT_NEAR(planes[static_cast<std::size_t>(kSide * kSide + kSide * at + 3)], expected, rounding)
          << "y at scale " << scale;
    }
  }
}

TEST(SampleCrop, OutsideTheImageIsBlackOrItsBorder) {
  const Image image = ramp(64);
  ImageFromCrop crop;
  crop.tx = crop.ty = -100;
  std::vector<float> planes(3 * 8 * 8);
  sampleCrop(image, crop, 8, 8, {}, true, planes);
  EXPECT_EQ(planes[2 * 64 + 5], 0);
  sampleCrop(image, crop, 8, 8, {}, false, planes);
  EXPECT_NEAR(planes[2 * 64 + 5], 200, 1e-3);
}

TEST(SampleCrop, WhatIsMadeSmallerIsAveragedNotSkipped) {
  Image image;
  image.resize(64, 64);  // stripes of one pixel
  for (std::size_t i = 0; i < image.bgr.size(); ++i) image.bgr[i] = (i / 3) % 2 == 0 ? 0 : 200;
  ImageFromCrop crop;
  crop.a = 4;
  std::vector<float> planes(3 * 16 * 16);
  sampleCrop(image, crop, 16, 16, {}, false, planes);
  for (std::size_t i = 0; i < 256; ++i) EXPECT_NEAR(planes[i], 100, 1e-2);
}

// Each sample by itself, in double precision, as the header says it.
std::vector<double> plainly(const Image& image, const ImageFromCrop& m, int width, int height, bool black_outside) {
  const int n = std::clamp(static_cast<int>(std::lround(m.scale())), 1, 8);
  const auto pixel = [&](int x, int y, int c) -> double {
    const bool outside = x < 0 || y < 0 || x >= image.width || y >= image.height;
    if (outside && black_outside) return 0;
    x = std::clamp(x, 0, image.width - 1);
    y = std::clamp(y, 0, image.height - 1);
    return image.bgr[static_cast<std::size_t>(3 * (y * image.width + x) + c)];
  };
  std::vector<double> planes;
  for (int c = 0; c < 3; ++c)
    for (int row = 0; row < height; ++row)
      for (int column = 0; column < width; ++column) {
        double sum = 0;
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j) {
            const double u = column + (j + 0.5) / n, v = row + (i + 0.5) / n;
            const double x = m.a * u - m.b * v + m.tx, y = m.b * u + m.a * v + m.ty;
            const int px = static_cast<int>(std::floor(n == 1 ? x - 0.5 : x));
            const int py = static_cast<int>(std::floor(n == 1 ? y - 0.5 : y));
            if (n > 1) {
              sum += pixel(px, py, c);
              continue;
            }
            const double fx = x - 0.5 - px, fy = y - 0.5 - py;
            sum += (1 - fy) * ((1 - fx) * pixel(px, py, c) + fx * pixel(px + 1, py, c)) +
                   fy * ((1 - fx) * pixel(px, py + 1, c) + fx * pixel(px + 1, py + 1, c));
          }
        planes.push_back(sum / (n * n));
      }
  return planes;
}

TEST(SampleCrop, EveryWayOfDoingItGivesWhatThePlainOneGives) {
  std::mt19937 random(7);
  Image image;
  image.resize(200, 160);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  for (const int width : {3, 8, 20, 45}) {  // narrower than a vector; not a multiple of one
    for (const double scale : {0.4, 1.0, 1.9, 2.7, 3.2, 5.0, 9.0}) {
      // Smooth, six levels from one pixel of the crop to the next: a sample lies at most a quarter of one beside its
      // place.
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          for (int c = 0; c < 3; ++c)
            image.bgr[static_cast<std::size_t>(3 * (y * image.width + x) + c)] = static_cast<std::uint8_t>(
                128 + 60 * std::sin(0.1 / scale * x + c) + 60 * std::cos(0.1 / scale * y - c));
      for (const double turn : {0.0, 0.4, -2.5}) {
        for (const double apart : {0.0, 1.0}) {  // within the image where it fits; over its border
          for (const bool black_outside : {false, true}) {
            const int height = width + 2;
            ImageFromCrop m;
            m.a = scale * std::cos(turn);
            m.b = scale * std::sin(turn);
            m.tx = 100 - 0.5 * (m.a * width - m.b * height) + apart * 90 * anywhere(random);
            m.ty = 80 - 0.5 * (m.b * width + m.a * height) + apart * 70 * anywhere(random);
            std::vector<float> planes(static_cast<std::size_t>(3 * width * height));
            sampleCrop(image, m, width, height, {}, black_outside, planes);
            const std::vector<double> expected = plainly(image, m, width, height, black_outside);
            // Beyond the border lies the mean of the last few pixels where the image was halved.
            const double tolerance = apart > 0 && scale >= 2.5 && !black_outside ? 8 : 3.5;
            int different = 0;
            for (std::size_t i = 0; i < planes.size(); ++i)
              different += std::abs(planes[i] - expected[i]) > tolerance ? 1 : 0;
            // At a black border rounding decides between a pixel and nothing.
            EXPECT_LE(different, black_outside ? static_cast<int>(planes.size()) / 50 : 0)
                << width << " wide, scale " << scale << ", turned by " << turn << ", moved " << apart;
          }
        }
      }
    }
  }
}

TEST(Anchors, EveryLayoutHasThem) {
  std::vector<std::array<float, 2>> points(68);
  for (std::size_t i = 0; i < 68; ++i) points[i] = {static_cast<float>(i), 1};
  const FaceAnchors anchors = anchorsOf(LandmarkLayout::ibug68, points);
  EXPECT_EQ(anchors[0][0], 38.5F);
  EXPECT_EQ(anchors[1][0], 44.5F);
  EXPECT_EQ(anchors[2][0], 30.0F);
  EXPECT_EQ(anchors[3][0], 48.0F);
  EXPECT_EQ(anchors[4][0], 54.0F);
}

}  // namespace
}  // namespace volto::capture
