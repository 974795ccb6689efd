// Eyes drawn with known pupils.
#include "capture/detection/pupils.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace volto::capture {
namespace {

struct DrawnEye {
  double x = 0, y = 0;              // the middle of its corners
  double width = 40;                // corner to corner
  double opening = 0.4;             // height, in widths
  double pupil_x = 0, pupil_y = 0;  // beside the middle, pixels
  double roll = 0;
};

// Skin 170, white of the eye 200, iris 60; noise of 4 grey levels.
struct Face {
  Face() {
    image.resize(320, 240);
    frame.layout = LandmarkLayout::ibug68;
    frame.face_present = true;
    frame.points_px.assign(68, {160, 200});
    std::fill(image.bgr.begin(), image.bgr.end(), std::uint8_t{170});
  }

  void draw(std::size_t eye, const DrawnEye& e) {
    const double c = std::cos(e.roll), s = std::sin(e.roll);
    const double half = 0.5 * e.width, high = 0.5 * e.opening * e.width;
    const auto lidAt = [&](double u) { return high * (1 - (u / half) * (u / half)); };
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const double dx = x + 0.5 - e.x, dy = y + 0.5 - e.y;
        const double u = c * dx + s * dy, v = -s * dx + c * dy;
        if (std::abs(u) >= half || std::abs(v) > lidAt(u)) continue;
        const bool iris = std::hypot(u - e.pupil_x, v - e.pupil_y) < 0.5 * 11.7 / 30 * e.width;
        for (std::size_t k = 0; k < 3; ++k)
          image.bgr[3 * (static_cast<std::size_t>(y) * 320 + static_cast<std::size_t>(x)) + k] = iris ? 60 : 200;
      }
    }
    const double third = half / 3;
    const std::array<std::array<double, 2>, 6> lids = {{{-half, 0},
                                                        {-third, -lidAt(third)},
                                                        {third, -lidAt(third)},
                                                        {half, 0},
                                                        {third, lidAt(third)},
                                                        {-third, lidAt(third)}}};
    for (std::size_t i = 0; i < 6; ++i) {
      frame.points_px[36 + 6 * eye + i] = {static_cast<float>(e.x + c * lids[i][0] - s * lids[i][1]),
                                           static_cast<float>(e.y + s * lids[i][0] + c * lids[i][1])};
    }
    truth[eye] = {static_cast<float>(e.x + c * e.pupil_x - s * e.pupil_y),
                  static_cast<float>(e.y + s * e.pupil_x + c * e.pupil_y)};
  }

  void find() {
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 4);
    for (std::uint8_t& byte : image.bgr) byte = static_cast<std::uint8_t>(std::clamp(byte + noise(random), 0.0, 255.0));
    PupilFinder().find(image, frame);
  }

  Image image;
  LandmarkFrame frame;
  std::array<std::array<float, 2>, 2> truth{};
};

TEST(Pupils, AreFoundWhereTheyWereDrawn) {
  for (const double side : {-7.0, -3.0, 0.0, 5.0}) {
    Face face;
    face.draw(0, {.x = 100, .y = 100, .pupil_x = side, .pupil_y = 1});
    face.draw(1, {.x = 200, .y = 104, .width = 30, .pupil_x = 0.6 * side, .roll = 0.2});
    face.find();
    for (std::size_t eye = 0; eye < 2; ++eye) {
      EXPECT_GT(face.frame.pupils[eye].confidence, 0.5);
      EXPECT_NEAR(face.frame.pupils[eye].x_px, face.truth[eye][0], 1.0) << "eye " << eye << " looking " << side;
      EXPECT_NEAR(face.frame.pupils[eye].y_px, face.truth[eye][1], 1.2) << "eye " << eye << " looking " << side;
    }
  }
}

TEST(Pupils, AClosedEyeHasNone) {
  Face face;
  face.draw(0, {.x = 100, .y = 100, .opening = 0.08});
  face.draw(1, {.x = 200, .y = 100});
  face.find();
  EXPECT_EQ(face.frame.pupils[0].confidence, 0);
  EXPECT_GT(face.frame.pupils[1].confidence, 0.5);
}

TEST(Pupils, SkinHasNone) {
  Face face;
  face.draw(0, {.x = 100, .y = 100});
  face.draw(1, {.x = 200, .y = 100});
  std::fill(face.image.bgr.begin(), face.image.bgr.end(), std::uint8_t{150});
  face.find();
  EXPECT_LT(face.frame.pupils[0].confidence, 0.05);
  EXPECT_LT(face.frame.pupils[1].confidence, 0.05);
}

TEST(Pupils, LandmarksOutsideTheImageOrInOnePlaceDoNoHarm) {
  Face face;
  for (auto& point : face.frame.points_px) point = {5000, -3000};
  face.find();
  EXPECT_EQ(face.frame.pupils[0].confidence, 0);
  face.frame.points_px[36] = {-400, 100};
  face.frame.points_px[39] = {-300, 100};
  face.frame.points_px[37] = face.frame.points_px[38] = {-350, 80};
  face.frame.points_px[40] = face.frame.points_px[41] = {-350, 120};
  PupilFinder().find(face.image, face.frame);
  EXPECT_LT(face.frame.pupils[0].confidence, 0.05);
}

TEST(Pupils, MediaPipesIrisesAreTakenAsTheyAre) {
  LandmarkFrame frame;
  frame.layout = LandmarkLayout::mediapipe478;
  frame.face_present = true;
  frame.points_px.assign(478, {1, 1});
  frame.points_px[468] = {10, 20};
  frame.points_px[473] = {30, 40};
  Image image;
  image.resize(64, 64);
  PupilFinder().find(image, frame);
  EXPECT_EQ(frame.pupils[0].x_px, 10);
  EXPECT_EQ(frame.pupils[1].y_px, 40);
}

}  // namespace
}  // namespace volto::capture
