// Landmark models of every kind of output, played by networks that say what the test wants.
#include "capture/detection/landmark_model.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/capture/detection/onnx_writer.h"

namespace volto::capture {
namespace {

using test::makeOnnx;

ModelManifest shipped(const std::string& name) {
  for (const ModelManifest& manifest : shippedModels())
    if (manifest.name == name) return manifest;
  throw std::logic_error("no manifest " + name);
}

Image grey(int width, int height, std::uint8_t level = 128) {
  Image image;
  image.resize(width, height);
  std::fill(image.bgr.begin(), image.bgr.end(), level);
  return image;
}

template <typename F>
std::string errorOf(F&& f) {
  try {
    f();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

// A crop twice as large in the image as in the network's picture, at (100, 50).
ImageFromCrop twiceAt(double x, double y) {
  ImageFromCrop crop;
  crop.a = 2;
  crop.tx = x;
  crop.ty = y;
  return crop;
}

TEST(LandmarkModel, FractionsOfTheCropBecomePixelsOfTheImage) {
  std::vector<float> points(136);
  for (std::size_t i = 0; i < 68; ++i) {
    points[2 * i] = static_cast<float>(i) / 68;
    points[2 * i + 1] = 0.25F;
  }
  LandmarkModel model(shipped("pfld_68"), makeOnnx(112, 112, {{"output", {1, 136}, points, {}}}), "test.onnx");
  LandmarkFrame out;
  EXPECT_EQ(model.run(grey(640, 480), twiceAt(100, 50), out), 1.0F);
  ASSERT_EQ(out.points_px.size(), 68U);
  EXPECT_NEAR(out.points_px[34][0], 100 + 2 * 112 * 0.5, 1e-3);
  EXPECT_NEAR(out.points_px[34][1], 50 + 2 * 112 * 0.25, 1e-3);
}

TEST(LandmarkModel, ChannelsArriveInTheOrderAndScaleOfTheManifest) {
  // Point 0 is (mean red, mean blue) of the input, which PFLD wants as fractions of 255.
  std::vector<float> constant(136, 0.5F), per_colour(3 * 136, 0.0F);
  constant[0] = constant[1] = 0;
  per_colour[0] = 1;            // red to x
  per_colour[2 * 136 + 1] = 1;  // blue to y
  LandmarkModel model(shipped("pfld_68"), makeOnnx(112, 112, {{"o", {1, 136}, constant, per_colour}}), "test.onnx");
  Image image = grey(640, 480);
  for (std::size_t i = 0; i < image.bgr.size(); i += 3) {
    image.bgr[i] = 51;       // blue: 0.2
    image.bgr[i + 2] = 204;  // red: 0.8
  }
  LandmarkFrame out;
  model.run(image, twiceAt(100, 50), out);
  EXPECT_NEAR(out.points_px[0][0], 100 + 2 * 112 * 0.8, 0.05);
  EXPECT_NEAR(out.points_px[0][1], 50 + 2 * 112 * 0.2, 0.05);
}

TEST(LandmarkModel, OpenSeeFaceMapsAreReadAtTheirHighestCellPlusOffset) {
  constexpr int kGrid = 28;
  constexpr std::size_t kCells = kGrid * kGrid;
  std::vector<float> maps(198 * kCells, 0.01F);
  const auto cell = [](std::size_t row, std::size_t column) { return row * kGrid + column; };
  for (std::size_t i = 0; i < 66; ++i) maps[i * kCells + cell(14, 9)] = 0.9F;
  const auto logistic = [](double x) { return static_cast<float>(1 / (1 + std::exp(-x))); };
  for (std::size_t i = 0; i < 66; ++i) {
    maps[(66 + i) * kCells + cell(14, 9)] = logistic(16 * 0.010);    // down, as a share of 223 pixels
    maps[(132 + i) * kCells + cell(14, 9)] = logistic(16 * -0.005);  // right
  }
  ModelManifest manifest = shipped("openseeface_66");
  LandmarkModel model(manifest, makeOnnx(224, 224, {{"out", {1, 198, kGrid, kGrid}, maps, {}}}), "test.onnx");
  LandmarkFrame out;
  out.layout = manifest.layout;
  EXPECT_NEAR(model.run(grey(640, 480), twiceAt(100, 50), out), 0.9, 1e-4);
  ASSERT_EQ(out.points_px.size(), 66U);
  EXPECT_NEAR(out.points_px[7][0], 100 + 2 * 223 * (9.0 / 27 - 0.005), 1e-2);
  EXPECT_NEAR(out.points_px[7][1], 50 + 2 * 223 * (14.0 / 27 + 0.010), 1e-2);
  EXPECT_NEAR(out.point_confidence[7], 0.9, 1e-4);
}

TEST(LandmarkModel, MediaPipePointsArePixelsAndItsScoreIsALogit) {
  std::vector<float> points(1434, 0.0F);
  for (std::size_t i = 0; i < 478; ++i) {
    points[3 * i] = 64;
    points[3 * i + 1] = static_cast<float>(i) / 4;
    points[3 * i + 2] = -1e3F;  // depth, not used
  }
  const auto run = [&](float score) {
    LandmarkModel model(shipped("mediapipe_478"),
                        makeOnnx(256, 256, {{"score", {1, 1}, {score}, {}}, {"points", {1, 1434}, points, {}}}),
                        "test.onnx");
    LandmarkFrame out;
    const float confidence = model.run(grey(640, 480), twiceAt(100, 50), out);
    EXPECT_EQ(out.points_px.size(), 478U);
    EXPECT_NEAR(out.points_px[468][0], 100 + 2 * 64, 1e-3);
    EXPECT_NEAR(out.points_px[468][1], 50 + 2 * 117, 1e-3);
    return confidence;
  };
  EXPECT_GT(run(6), 0.99);
  EXPECT_LT(run(-6), 0.01);
}

TEST(LandmarkModel, AnotherNumberOfPointsIsRefusedWithBothNumbers) {
  const std::string error = errorOf([] {
    LandmarkModel(shipped("pfld_68"), makeOnnx(112, 112, {{"output", {1, 196}, std::vector<float>(196), {}}}),
                  "other.onnx");
  });
  EXPECT_NE(error.find("other.onnx"), std::string::npos) << error;
  EXPECT_NE(error.find("1x196"), std::string::npos) << error;
  EXPECT_NE(error.find("136"), std::string::npos) << error;
}

TEST(LandmarkModel, AModelWithoutTheScoreItShouldHaveIsRefused) {
  const std::string error = errorOf([] {
    LandmarkModel(shipped("mediapipe_478"), makeOnnx(256, 256, {{"p", {1, 1434}, std::vector<float>(1434), {}}}),
                  "m.onnx");
  });
  EXPECT_NE(error.find("score"), std::string::npos) << error;
}

TEST(LandmarkModel, NumbersThatAreNotFiniteAreRefusedWhenItIsLoaded) {
  const std::string error = errorOf([] {
    LandmarkModel(shipped("pfld_68"), makeOnnx(112, 112, {{"o", {1, 136}, std::vector<float>(136, NAN), {}}}),
                  "nan.onnx");
  });
  EXPECT_NE(error.find("not finite"), std::string::npos) << error;
}

TEST(LandmarkModel, TextAndCutFilesAreRefusedInOneLine) {
  const std::string whole = makeOnnx(112, 112, {{"output", {1, 136}, std::vector<float>(136), {}}});
  for (const std::string& bytes : {std::string("this is no network\n"), whole.substr(0, whole.size() / 2),
                                   whole.substr(0, 10), std::string("\0\0\0\0", 4)}) {
    const std::string error = errorOf([&] { LandmarkModel(shipped("pfld_68"), bytes, "bad.onnx"); });
    EXPECT_TRUE(error.starts_with("bad.onnx: ")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace volto::capture
