#include "rig/measure/measure_expression_table.h"

#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "rig/expression_table.h"
#include "tests/support/test_data.h"

namespace volto::rig {

TEST(MeasureExpressionTable, ShippedTableIsWhatTheExpressionsMeasure) {
  VOLTO_REQUIRE_DATA(data);
  const std::string measured =
      measureExpressionTable(data / "meshes/ict", test::sourceDir() / "tests/rig/ict_feature_points.json");
  std::ifstream file(test::sourceDir() / "rig/assets/expression_table.csv");
  const std::string shipped{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(measured.substr(0, measured.find("shape,feature_point")),
            shipped.substr(0, shipped.find("shape,feature_point")));
  // Numbers may differ by a last digit on another processor.
  const ExpressionTable now = ExpressionTable::parse(measured, "measured"),
                        then = ExpressionTable::parse(shipped, "shipped");
  const ExpressionTable::Basis difference = now.basis() - then.basis();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 2e-4);
}

}  // namespace volto::rig
