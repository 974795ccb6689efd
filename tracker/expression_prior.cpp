#include "tracker/expression_prior.h"

#include <stdexcept>

#include "tracker/csv_row.h"

namespace volto::tracker {

extern const char* const kExpressionPriorText;  // assets/expression_prior.csv

namespace {

// A shape that nobody used in the recordings can still be used: no deviation is taken to be smaller than this.
constexpr double kSmallestScale = 0.035;

}  // namespace

ExpressionPrior ExpressionPrior::parse(std::string_view csv, const std::string& name) {
  ExpressionPrior prior;
  int next = -1;  // -1: header
  forEachCsvRow(csv, name, [&](CsvRow& row) {
    if (next >= kShapes) row.fail("belongs to a row too many; there are 52 shapes");
    const std::string_view first = row.field();
    const std::string_view expected = next < 0 ? "shape" : kArkitBlendshapeNames[static_cast<std::size_t>(next)];
    if (first != expected) row.fail(std::string("is ").append(first).append(", expected ").append(expected));
    if (next >= 0) {
      prior.rms_[next] = row.number(0, 1);
      prior.deviation_[next] = row.number(0, 1);
      for (int k = 0; k < kShapes; ++k) prior.correlation_(next, k) = row.number(-1, 1);
      row.expectEnd();
    }
    ++next;
  });
  if (next != kShapes) throw std::invalid_argument(std::string(name).append(": does not hold all 52 shapes"));
  prior.correlation_ = (0.5 * (prior.correlation_ + prior.correlation_.transpose())).eval();
  return prior;
}

const ExpressionPrior& ExpressionPrior::standard() {
  static const ExpressionPrior prior = parse(kExpressionPriorText, "expression_prior.csv");
  return prior;
}

ShapeMatrix ExpressionPrior::covarianceOf(const ShapeVector& scale, double correlation) const {
  const ShapeVector floored = scale.cwiseMax(kSmallestScale);
  ShapeMatrix result = correlation * (scale.asDiagonal() * correlation_ * scale.asDiagonal());
  result.diagonal() = floored.cwiseAbs2();
  // Correlations printed to two digits may leave the matrix a hair short of positive definite.
  result.diagonal().array() += 2e-4;
  return result;
}

}  // namespace volto::tracker
