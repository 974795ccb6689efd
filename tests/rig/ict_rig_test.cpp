// A head by an artist, and 53 expressions that the artist made: how near the rig comes to them when it is told only
// where the 84 feature points went.
#include <cmath>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "tests/rig/test_head.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

std::string textOf(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

class IctHead : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP()
        << "SKIPPED: figures on 26 719 vertices are measured in the plain build; sanitizers see the small head";
#endif
    VOLTO_REQUIRE_DATA(data);
    ict_ = data / "meshes/ict";
    if (!rig_) {
      const std::string points = (test::sourceDir() / "tests/rig/ict_feature_points.json").string();
      rig_ =
          std::make_unique<Rig>(buildRig(readMesh(ict_ / "neutral.obj"), parseFeaturePoints(textOf(points), points)));
    }
  }
  static void TearDownTestSuite() { rig_.reset(); }

  // Displacement of every vertex in one of the expressions, and what the rig makes of that of the feature points.
  std::pair<VertexPositions, VertexPositions> truthAndRig(const std::filesystem::path& expression) const {
    const VertexPositions truth = readMesh(expression).positions - rig_->neutral.positions;
    FeaturePointPositions points;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      points.row(static_cast<Eigen::Index>(p)) = truth.row(rig_->feature_vertex[p]);
    return {truth, test::deform(*rig_, points)};
  }

  static std::unique_ptr<Rig> rig_;
  std::filesystem::path ict_;
};
std::unique_ptr<Rig> IctHead::rig_;

TEST_F(IctHead, ArtistsExpressionsAreReproducedFrom84Points) {
  constexpr Eigen::Index kNarrowFace = 6706;
  double sum = 0, worst = 0;
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(ict_ / "expressions")) {
    const auto [truth, made] = truthAndRig(entry.path());
    const double motion = truth.topRows(kNarrowFace).norm();
    if (motion / std::sqrt(static_cast<double>(kNarrowFace)) < 1e-3) continue;
    const double error = (made - truth).topRows(kNarrowFace).norm() / motion;
    sum += error;
    worst = std::max(worst, error);
    ++count;
  }
  ASSERT_GT(count, 40);
  RecordProperty("mean_relative_error", std::to_string(sum / count));
  // One multiquadric over all points reaches 0.37, a thin-plate spline 0.34.
  EXPECT_LT(sum / count, 0.30);
  EXPECT_LT(worst, 0.50);
}

TEST_F(IctHead, OpeningJawTakesLowerTeethAlongAndLeavesUpperOnes) {
  const auto [truth, made] = truthAndRig(ict_ / "expressions/jawOpen.obj");
  ASSERT_FALSE(rig_->rigid_parts.empty());
  std::size_t upper = 0, lower = 0;
  double error = 0, motion = 0;
  for (const RigidPart& part : rig_->rigid_parts) {
    for (const std::uint32_t v : part.vertices) {
      if (part.name == "upper teeth") {
        ++upper;
        EXPECT_EQ(made.row(v).norm(), 0.0);
      } else if (part.name == "lower teeth") {
        ++lower;
        error += (made.row(v) - truth.row(v)).squaredNorm();
        motion += truth.row(v).squaredNorm();
      }
    }
  }
  EXPECT_GT(upper, 1000U);
  EXPECT_GT(lower, 1000U);
  // The skin says where the bone is only roughly.
  EXPECT_LT(std::sqrt(error / motion), 0.35);
}

TEST_F(IctHead, EyeballsAreFoundOnBothSides) {
  double left = 0, right = 0;
  for (const RigidPart& part : rig_->rigid_parts) {
    if (part.follows == RigidPart::Follows::left_eye) left = part.centre[0];
    if (part.follows == RigidPart::Follows::right_eye) right = part.centre[0];
  }
  EXPECT_GT(left, 2.5);
  EXPECT_NEAR(left, -right, 0.1);
}

TEST_F(IctHead, RowsAreCompact) {
  std::size_t moving = 0;
  for (std::size_t v = 0; v < rig_->deformation.vertexCount(); ++v)
    moving += rig_->deformation.row_start[v + 1] > rig_->deformation.row_start[v] ? 1U : 0U;
  EXPECT_LT(static_cast<double>(rig_->deformation.weight.size()) / static_cast<double>(moving), 20.0);
}

}  // namespace
}  // namespace volto::rig
