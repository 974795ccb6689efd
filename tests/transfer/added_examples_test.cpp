#include "transfer/added_examples.h"

#include <gtest/gtest.h>

#include "tests/transfer/sheet.h"

namespace volto::transfer {
namespace {

// A sheet whose slit is a mouth that is a little open; an eye separation of 4.
struct Mouth : ::testing::Test {
  static constexpr double kEyeSeparation = 4;
  Sheet sheet = makeSheet(24, 8, 0.2);
  const rig::VertexPositions& neutral = sheet.mesh.positions;
  rig::Contacts contacts;

  Mouth() {
    rig::SlitContact slit;
    slit.up = {0, 1, 0};
    for (std::size_t k = 0; k < sheet.upper.size(); ++k) {
      slit.upper.push_back({sheet.upper[k], sheet.upper[k], 0});
      slit.lower.push_back({sheet.lower[k], sheet.lower[k], 0});
      slit.least_gap.push_back(0);
    }
    contacts.slits.push_back(slit);
  }

  // The lower lip and what is below it moves up by `way`.
  rig::VertexPositions lowerLipUp(double way) const {
    rig::VertexPositions out = neutral;
    for (const std::uint32_t v : sheet.lower) out(v, 1) += way;
    return out;
  }
  std::vector<std::int32_t> addedTo(std::initializer_list<double> ways) const {
    std::vector<rig::VertexPositions> examples;
    for (const double way : ways) examples.push_back(lowerLipUp(way));
    return transfer::addedTo(contacts, kEyeSeparation, neutral, examples);
  }
};

TEST_F(Mouth, ClosingShapeIsAddedToTheOneThatOpens) {
  EXPECT_EQ(addedTo({2.0, 0.1, -2.0, -1.0}), (std::vector<std::int32_t>{2, -1, -1, -1}));
}

TEST_F(Mouth, PressedLipsAreAnExpressionByThemselves) {
  EXPECT_EQ(addedTo({0.4, -0.4, -2.0}), (std::vector<std::int32_t>{-1, -1, -1}));
}

TEST_F(Mouth, NothingIsAddedToWhatDoesNotUndoIt) {
  EXPECT_EQ(addedTo({2.0, -0.5, 0.0}), (std::vector<std::int32_t>{-1, -1, -1}));
}

TEST_F(Mouth, SumIsBothDisplacements) {
  EXPECT_TRUE(together(neutral, lowerLipUp(2), lowerLipUp(-2)).isApprox(neutral, 1e-12));
}

TEST(AddedExamples, WithoutContactsNothingIsKnown) {
  const Sheet sheet = makeSheet(6, 4, 0.4);
  const std::vector<rig::VertexPositions> examples(2, sheet.mesh.positions);
  EXPECT_EQ(addedTo({}, 1, sheet.mesh.positions, examples), (std::vector<std::int32_t>{-1, -1}));
}

}  // namespace
}  // namespace volto::transfer
