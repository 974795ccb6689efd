#include "tracker/expression_prior.h"

#include <charconv>
#include <stdexcept>

namespace volto::tracker {

extern const char* const kExpressionPriorText;  // assets/expression_prior.csv

namespace {

// A shape that nobody used in the recordings can still be used: no deviation is taken to be smaller than this.
constexpr double kSmallestScale = 0.035;

class Row {
 public:
  Row(std::string_view line, std::string where) : rest_(line), where_(std::move(where)) {}

  std::string_view field() {
    ++column_;
    if (done_) fail("is missing");
    const std::size_t comma = rest_.find(',');
    const std::string_view text = rest_.substr(0, comma);
    done_ = comma == std::string_view::npos;
    rest_ = done_ ? std::string_view{} : rest_.substr(comma + 1);
    return text;
  }

  double number(double low, double high) {
    const std::string_view text = field();
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !(value >= low && value <= high))
      fail(std::string(text).append(" is not a number from ").append(std::to_string(low)).append(" to ").append(std::to_string(high)));
    return value;
  }

  void expectEnd() {
    if (!done_) fail("is one too many");
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument(where_ + ": column " + std::to_string(column_) + " " + what);
  }

 private:
  std::string_view rest_;
  std::string where_;
  int column_ = 0;
  bool done_ = false;
};

}  // namespace

ExpressionPrior ExpressionPrior::parse(std::string_view csv, const std::string& name) {
  ExpressionPrior prior;
  int line_number = 0;
  int row_index = -1;  // -1: header
  while (!csv.empty()) {
    ++line_number;
    const std::size_t newline = csv.find('\n');
    std::string_view line = csv.substr(0, newline);
    csv = newline == std::string_view::npos ? std::string_view{} : csv.substr(newline + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    Row row(line, name + ":" + std::to_string(line_number));
    if (row_index >= kShapes) row.fail("belongs to a row too many; there are 52 shapes");
    const std::string_view first = row.field();
    const std::string_view expected = row_index < 0 ? "shape" : kArkitBlendshapeNames[static_cast<std::size_t>(row_index)];
    if (first != expected) row.fail(std::string("is ").append(first).append(", expected ").append(expected));
    if (row_index >= 0) {
      prior.rms_[row_index] = row.number(0, 1);
      prior.deviation_[row_index] = row.number(0, 1);
      for (int k = 0; k < kShapes; ++k) prior.correlation_(row_index, k) = row.number(-1, 1);
      row.expectEnd();
    }
    ++row_index;
  }
  if (row_index != kShapes)
    throw std::invalid_argument(name + ": has " + std::to_string(std::max(row_index, 0)) + " shapes, expected 52");
  prior.correlation_ = (0.5 * (prior.correlation_ + prior.correlation_.transpose())).eval();
  return prior;
}

const ExpressionPrior& ExpressionPrior::standard() {
  static const ExpressionPrior prior = parse(kExpressionPriorText, "expression_prior.csv");
  return prior;
}

ShapeMatrix ExpressionPrior::covariance(const ShapeVector& scale, double correlation) const {
  const ShapeVector floored = scale.cwiseMax(kSmallestScale);
  ShapeMatrix result = correlation * (scale.asDiagonal() * correlation_ * scale.asDiagonal());
  result.diagonal() = floored.cwiseAbs2();
  // Correlations printed to two digits may leave the matrix a hair short of positive definite.
  result.diagonal().array() += 2e-4;
  return result;
}

}  // namespace volto::tracker
