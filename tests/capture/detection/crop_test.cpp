#include "capture/detection/crop.h"

#include <cmath>
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
      EXPECT_NEAR(planes[static_cast<std::size_t>(3 * kSide + at)], expected, 0.51) << "x at scale " << scale;
      EXPECT_NEAR(planes[static_cast<std::size_t>(kSide * kSide + kSide * at + 3)], expected, 0.51)
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
