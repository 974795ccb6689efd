// Points from few: what is kept, what is refused, what is mended. On the shipped heads; accuracy on people is measured
// in fitting_accuracy_test.cpp.
#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/rig/fitting_support.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

using test::KnownHead;

class FitPoints : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::filesystem::path assets = volto::test::sourceDir() / "rig/assets";
    adult_ = new KnownHead(KnownHead::read(assets / "volto_head.obj", assets / "volto_head.points.json"));
    creature_ = new KnownHead(KnownHead::read(assets / "volto_creature.obj", assets / "volto_creature.points.json"));
  }
  static void TearDownTestSuite() {
    delete adult_;
    delete creature_;
  }
  static std::string refusal(const Mesh& mesh, const FeaturePointChoices& told) {
    try {
      fitPoints(mesh, told);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return "nothing was refused";
  }

  static KnownHead *adult_, *creature_;
};
KnownHead* FitPoints::adult_ = nullptr;
KnownHead* FitPoints::creature_ = nullptr;

TEST_F(FitPoints, GivenPointsStayExactlyWhereTheyAre) {
  FeaturePointChoices told = adult_->told(kTenPoints);
  const std::size_t chin = featurePointIndex("2.1").value();
  told[chin] = Eigen::Vector3d(adult_->at("2.1") + Eigen::Vector3d(0, -0.05, 0.02));
  const FittedPoints fitted = fitPoints(adult_->mesh, told);
  ASSERT_EQ(fitted.points.size(), kFeaturePointCount);
  for (const auto& [p, choice] : told) {
    EXPECT_EQ(fitted.points.at(p), choice) << featurePoints()[p].id;
    EXPECT_EQ(fitted.confidence[p], 1);
  }
}

TEST_F(FitPoints, ShippedHeadIsFoundAgainWhereverItLies) {
  VOLTO_PLAIN_BUILD_ONLY();
  for (const unsigned seed : {0U, 3U}) {
    const KnownHead placed = adult_->placedAnyhow(seed);
    const test::FitError error = test::errorOf(fitPoints(placed.mesh, placed.told(kTenPoints)), placed);
    EXPECT_LT(error.mean, 0.08) << seed;
    EXPECT_LT(error.worst, 0.4) << seed << " " << error.worst_point;
  }
}

TEST_F(FitPoints, UpperAndLowerLipAndLidAreNotMixed) {
  VOLTO_PLAIN_BUILD_ONLY();
  for (const KnownHead* head : {adult_, creature_}) {
    const FittedPoints fitted = fitPoints(head->mesh, head->told(kTenPoints));
    const auto y = [&](const char* id) {
      return fitted.positions(static_cast<Eigen::Index>(featurePointIndex(id).value()), 1);
    };
    for (const auto& [upper, lower] : {std::pair{"2.2", "2.3"},
                                       {"2.6", "2.8"},
                                       {"2.7", "2.9"},
                                       {"3.1", "3.3"},
                                       {"3.2", "3.4"},
                                       {"12.5", "12.7"},
                                       {"12.10", "12.12"},
                                       {"8.1", "2.2"},
                                       {"2.3", "8.2"}})
      EXPECT_GT(y(upper), y(lower)) << upper << " over " << lower;
  }
}

// The cartoon head is no human face: a smooth fit comes to lie an eighth of an eye separation beside its lips and its
// large eyes. The edges are seen all the same.
TEST_F(FitPoints, LidsAndLipsOfACartoonHeadAreFoundFromTenPoints) {
  for (const unsigned seed : {0U, 1U}) {
    const KnownHead placed = creature_->placedAnyhow(seed);
    const FittedPoints fitted = fitPoints(placed.mesh, placed.told(kTenPoints));
    const auto vertical = [&](std::string_view id) {  // across the margin: along it nothing can be seen
      const auto p = static_cast<Eigen::Index>(featurePointIndex(id).value());
      const Eigen::Vector3d up = (placed.at("11.1") - placed.at("2.1")).normalized();
      return std::abs(up.dot(fitted.positions.row(p).transpose() - placed.at(id))) / placed.eyeSeparation();
    };
    for (const std::string_view id : {"2.2", "2.3", "2.6", "2.7", "2.8", "2.9"}) EXPECT_LT(vertical(id), 0.02) << id;
    for (const std::string_view id : {"3.1", "3.2", "3.3", "3.4"}) EXPECT_LT(vertical(id), 0.03) << id;
  }
}

TEST_F(FitPoints, PointsOfAFaceThatIsItsOwnMirrorImageAreToo) {
  VOLTO_PLAIN_BUILD_ONLY();
  const auto& points = featurePoints();
  for (const KnownHead* head : {adult_, creature_}) {
    const FittedPoints fitted = fitPoints(head->mesh, head->told(kTenPoints));
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      const Eigen::RowVector3d at = fitted.positions.row(static_cast<Eigen::Index>(p)),
                               other = fitted.positions.row(static_cast<Eigen::Index>(points[p].mirror));
      EXPECT_LT((at - other.cwiseProduct(Eigen::RowVector3d(-1, 1, 1))).norm() / head->eyeSeparation(), 2e-3)
          << points[p].id;
    }
  }
}

TEST_F(FitPoints, OneSideOfAFaceThatIsItsOwnMirrorImageIsEnough) {
  VOLTO_PLAIN_BUILD_ONLY();
  constexpr std::array<std::string_view, 6> kLeftOrMiddle = {"3.7", "4.3", "9.3", "8.3", "2.1", "10.7"};
  for (const unsigned seed : {0U, 5U}) {
    const KnownHead placed = creature_->placedAnyhow(seed);
    const double ten = test::errorOf(fitPoints(placed.mesh, placed.told(kTenPoints)), placed).mean;
    EXPECT_LT(test::errorOf(fitPoints(placed.mesh, placed.told(kLeftOrMiddle)), placed).mean, 1.1 * ten);
  }
}

TEST_F(FitPoints, MorePointsAreNeverWorse) {
  VOLTO_PLAIN_BUILD_ONLY();
  constexpr std::array<std::string_view, 4> kFour = {"3.7", "3.12", "9.3", "2.1"};
  std::vector<std::string_view> twenty(kTenPoints.begin(), kTenPoints.end());
  for (const char* id : {"3.11", "3.8", "2.2", "2.3", "9.15", "11.1", "9.1", "9.2", "3.1", "3.2"}) twenty.push_back(id);
  const double four = test::errorOf(fitPoints(creature_->mesh, creature_->told(kFour)), *creature_).mean;
  const double ten = test::errorOf(fitPoints(creature_->mesh, creature_->told(kTenPoints)), *creature_).mean;
  const double more = test::errorOf(fitPoints(creature_->mesh, creature_->told(twenty)), *creature_).mean;
  EXPECT_LT(ten, four);
  EXPECT_LT(more, ten);
}

TEST_F(FitPoints, SaysWhichPointsToLookAt) {
  VOLTO_PLAIN_BUILD_ONLY();
  constexpr std::array<std::string_view, 4> kFour = {"3.7", "3.12", "9.3", "2.1"};
  const FittedPoints sure = fitPoints(adult_->mesh, adult_->told(kTenPoints));
  const FittedPoints unsure = fitPoints(adult_->mesh, adult_->told(kFour));
  EXPECT_GE(unsure.to_check.size(), sure.to_check.size());
  const auto mean = [](const FittedPoints& f) {
    return std::accumulate(f.confidence.begin(), f.confidence.end(), 0.0) / kFeaturePointCount;
  };
  EXPECT_LT(mean(unsure), mean(sure) - 0.05);
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const bool listed = std::find(unsure.to_check.begin(), unsure.to_check.end(), p) != unsure.to_check.end();
    EXPECT_EQ(listed, unsure.confidence[p] < 0.5) << featurePoints()[p].id;
  }
}

TEST_F(FitPoints, IsTheSameEveryTime) {
  VOLTO_PLAIN_BUILD_ONLY();
  const FeaturePointChoices told = creature_->told(kTenPoints);
  const FittedPoints once = fitPoints(creature_->mesh, told), again = fitPoints(creature_->mesh, told);
  EXPECT_EQ(once.points, again.points);
  EXPECT_EQ(once.positions, again.positions);
}

TEST_F(FitPoints, DenseCorrespondenceOfTheShippedHeadToItselfIsTheSamePlace) {
  const FittedPoints fitted = fitPoints(adult_->mesh, adult_->truth);
  const GenericHead& generic = genericHead();
  ASSERT_EQ(fitted.dense.size(), generic.mesh.vertexCount());
  std::size_t near = 0, trusted = 0;
  for (const std::uint32_t v : generic.vertex_of_face) {
    const CorrespondingPlace& c = fitted.dense[v];
    if (c.trust <= 0) continue;
    ++trusted;
    Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) at += c.place.weights[i] * adult_->mesh.positions.row(c.place.vertices[i]);
    near += (at - adult_->mesh.positions.row(v)).norm() < 0.1 * adult_->eyeSeparation() ? 1 : 0;
  }
  EXPECT_GT(static_cast<double>(trusted), 0.8 * static_cast<double>(generic.vertex_of_face.size()));
  EXPECT_GT(static_cast<double>(near), 0.9 * static_cast<double>(trusted));
}

TEST_F(FitPoints, RoughPointsMayBeOff) {
  std::vector<RoughPoint> rough;
  for (const std::string_view id : kTenPoints)
    rough.push_back(
        {featurePointIndex(id).value(),
         adult_->at(id) + 0.05 * adult_->eyeSeparation() * Eigen::Vector3d(rough.size() % 2 ? 1 : -1, 0.5, -1), 0.08});
  const test::FitError error = test::errorOf(fitPoints(adult_->mesh, {}, rough), *adult_);
  EXPECT_LT(error.mean, 0.12);
}

TEST_F(FitPoints, InsideOutMeshIsMendedAndNamed) {
  VOLTO_PLAIN_BUILD_ONLY();
  const KnownHead turned = creature_->insideOut();
  const FittedPoints fitted = fitPoints(turned.mesh, turned.told(kTenPoints));
  ASSERT_EQ(fitted.notes.size(), 1U);
  EXPECT_NE(fitted.notes[0].find("inside out"), std::string::npos) << fitted.notes[0];
  // Quads are cut along their other diagonal, so not to the bit.
  const FittedPoints straight = fitPoints(creature_->mesh, creature_->told(kTenPoints));
  EXPECT_LT((fitted.positions - straight.positions).rowwise().norm().maxCoeff(), 0.02 * creature_->eyeSeparation());
}

TEST_F(FitPoints, MirroredGeometryIsMendedAndNamed) {
  const KnownHead mirrored = creature_->mirrored();
  const FittedPoints fitted = fitPoints(mirrored.mesh, mirrored.told(kTenPoints));
  ASSERT_FALSE(fitted.notes.empty());
  EXPECT_NE(fitted.notes[0].find("mirror image"), std::string::npos) << fitted.notes[0];
  const std::size_t left = featurePointIndex("3.7").value(), right = featurePointIndex("3.12").value();
  EXPECT_EQ(fitted.points.at(right), creature_->truth.at(left)) << "the side that it is on now";
}

TEST_F(FitPoints, LeftAndRightExchangedIsNoticedAndNamed) {
  FeaturePointChoices told;
  for (const auto& [p, choice] : adult_->told(kTenPoints)) told[featurePoints()[p].mirror] = choice;
  const std::string message = refusal(adult_->placedAnyhow(5).mesh, told);
  EXPECT_NE(message.find("left and right are exchanged"), std::string::npos) << message;
}

TEST_F(FitPoints, OnePairExchangedIsNoticedAndNamed) {
  FeaturePointChoices told = adult_->told(kTenPoints);
  std::swap(told.at(featurePointIndex("8.3").value()), told.at(featurePointIndex("8.4").value()));
  const std::string message = refusal(adult_->mesh, told);
  EXPECT_NE(message.find("8.3 (left corner of outer lip contour)"), std::string::npos) << message;
  EXPECT_NE(message.find("8.4"), std::string::npos) << message;
  EXPECT_NE(message.find("exchanged"), std::string::npos) << message;
}

TEST_F(FitPoints, LandmarkFarOffTheSurfaceIsNamedWithItsDistance) {
  FeaturePointChoices told = adult_->told(kTenPoints);
  told[featurePointIndex("9.3").value()] = Eigen::Vector3d(adult_->at("9.3") + Eigen::Vector3d(0, 0, 4));
  const std::string message = refusal(adult_->mesh, told);
  EXPECT_NE(message.find("9.3 (tip of the nose) lies 4 off the surface"), std::string::npos) << message;
}

TEST_F(FitPoints, TooFewPointsAreRefusedWithWhatIsNeeded) {
  constexpr std::array<std::string_view, 3> kThree = {"3.7", "3.12", "9.3"};
  const std::string message = refusal(adult_->mesh, adult_->told(kThree));
  EXPECT_NE(message.find("only 3 feature points"), std::string::npos) << message;
  EXPECT_NE(message.find("at least 4"), std::string::npos) << message;
}

TEST_F(FitPoints, PointsOnOneLineOrInOnePlaceAreRefused) {
  FeaturePointChoices line, place;
  int i = 0;
  for (const char* id : {"11.1", "12.13", "9.3", "8.1", "2.1"}) {
    line[featurePointIndex(id).value()] = Eigen::Vector3d(0, 5.0 - i++, 8);
    place[featurePointIndex(id).value()] = Eigen::Vector3d(0, 0, 8);
  }
  EXPECT_NE(refusal(adult_->mesh, line).find("on one line"), std::string::npos) << refusal(adult_->mesh, line);
  EXPECT_NE(refusal(adult_->mesh, place).find("in one place"), std::string::npos) << refusal(adult_->mesh, place);
}

TEST_F(FitPoints, VertexOutOfRangeIsRefused) {
  FeaturePointChoices told = adult_->told(kTenPoints);
  told[featurePointIndex("9.3").value()] = std::uint32_t{4'000'000};
  EXPECT_NE(refusal(adult_->mesh, told).find("9.3 is vertex 4000000"), std::string::npos);
}

// --- all 84 given

std::string checkRefusal(const Mesh& mesh, const FeaturePointChoices& given) {
  try {
    checkPoints(mesh, given);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST_F(FitPoints, AllPointsOfTheShippedHeadsPassTheCheck) {
  for (const KnownHead* head : {adult_, creature_}) {
    const CheckedPoints checked = checkPoints(head->placedAnyhow(3).mesh, head->truth);
    EXPECT_EQ(checked.points, head->truth);
    EXPECT_TRUE(checked.notes.empty()) << checked.notes.front();
  }
}

TEST_F(FitPoints, AllPointsExchangedOrOnePairOfThemIsNoticedAndNamed) {
  FeaturePointChoices all, one = adult_->truth;
  for (const auto& [p, choice] : adult_->truth) all[featurePoints()[p].mirror] = choice;
  std::swap(one.at(featurePointIndex("8.3").value()), one.at(featurePointIndex("8.4").value()));
  EXPECT_NE(checkRefusal(adult_->mesh, all).find("left and right are exchanged"), std::string::npos);
  const std::string message = checkRefusal(adult_->mesh, one);
  EXPECT_NE(message.find("8.3"), std::string::npos) << message;
  EXPECT_NE(message.find("only when exchanged"), std::string::npos) << message;
}

TEST_F(FitPoints, APointFarFromItsPlaceAmongAllIsNamed) {
  FeaturePointChoices given = adult_->truth;
  given[featurePointIndex("9.3").value()] = given.at(featurePointIndex("10.7").value());  // the nose on the ear lobe
  const CheckedPoints checked = checkPoints(adult_->mesh, given);
  ASSERT_EQ(checked.notes.size(), 1U);
  EXPECT_NE(checked.notes[0].find("check 9.3"), std::string::npos) << checked.notes[0];
  given[featurePointIndex("9.3").value()] = Eigen::Vector3d(adult_->at("9.3") + Eigen::Vector3d(0, 0, 400));
  EXPECT_NE(checkRefusal(adult_->mesh, given).find("9.3 (tip of the nose) lies"), std::string::npos);
}

}  // namespace
}  // namespace volto::rig
