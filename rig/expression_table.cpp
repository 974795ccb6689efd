#include "rig/expression_table.h"

#include <charconv>
#include <cmath>
#include <set>

#include "rig/errors.h"

namespace volto::rig {

// The text of rig/assets/expression_table.csv, put into the library by CMake.
extern const char* const kExpressionTableText;

namespace {

[[noreturn]] void fail(const std::string& name, std::size_t line, const std::string& what) {
  throw InputError(name + ":" + std::to_string(line) + ": " + what);
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

constexpr std::string_view kSourcePrefix = "# source ";
constexpr std::string_view kHeader = "shape,feature_point,x,y,z";

}  // namespace

ExpressionTable ExpressionTable::parse(std::string_view text, const std::string& name) {
  ExpressionTable table;
  std::set<std::pair<std::size_t, std::size_t>> seen;
  bool header_seen = false;
  std::size_t line_number = 0;
  while (!text.empty()) {
    ++line_number;
    const auto end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);

    if (line.starts_with(kSourcePrefix)) {
      const std::string_view rest = line.substr(kSourcePrefix.size());
      const auto colon = rest.find(':');
      const auto shape =
          colon == std::string_view::npos ? std::nullopt : arkitBlendshapeIndex(trimmed(rest.substr(0, colon)));
      if (!shape)
        fail(name, line_number,
             "a source line reads \"# source SHAPE: where its numbers come from\", SHAPE an ARKit name");
      table.source_[*shape] = std::string(trimmed(rest.substr(colon + 1)));
      continue;
    }
    if (line.empty() || line.starts_with('#')) continue;
    if (!header_seen) {
      if (line != kHeader) fail(name, line_number, "the first row must be \"" + std::string(kHeader) + "\"");
      header_seen = true;
      continue;
    }

    std::array<std::string_view, 5> cells;
    std::size_t count = 0;
    for (std::string_view rest = line;; ++count) {
      const auto comma = rest.find(',');
      if (count < cells.size()) cells[count] = trimmed(rest.substr(0, comma));
      if (comma == std::string_view::npos) break;
      rest.remove_prefix(comma + 1);
    }
    if (++count != cells.size())
      fail(name, line_number,
           "a row has 5 columns (" + std::string(kHeader) + "), this one has " + std::to_string(count));
    const auto shape = arkitBlendshapeIndex(cells[0]);
    if (!shape) fail(name, line_number, "\"" + std::string(cells[0]) + "\" is no ARKit blendshape");
    const auto point = featurePointIndex(cells[1]);
    if (!point) fail(name, line_number, "\"" + std::string(cells[1]) + "\" is no feature point of the mask");
    if (!seen.insert({*shape, *point}).second)
      fail(name, line_number, std::string(cells[0]) + " has point " + std::string(cells[1]) + " twice; keep one row");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string_view cell = cells[2 + axis];
      double value = 0;
      const auto [stop, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
      if (error != std::errc() || stop != cell.data() + cell.size() || !std::isfinite(value))
        fail(name, line_number, "\"" + std::string(cell) + "\" is not a finite number");
      table.basis_(static_cast<Eigen::Index>(3 * *point + axis), static_cast<Eigen::Index>(*shape)) = value;
    }
  }
  if (!header_seen || seen.empty())
    fail(name, line_number, "no rows; an expression table has \"" + std::string(kHeader) + "\" and at least one row");
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    table.moves_mask_[k] = table.basis_.col(static_cast<Eigen::Index>(k)).cwiseAbs().maxCoeff() > 0;
  return table;
}

const ExpressionTable& ExpressionTable::standard() {
  static const ExpressionTable table = parse(kExpressionTableText, "expression_table.csv");
  return table;
}

void ExpressionTable::apply(const ArkitWeights& weights, MaskDisplacements& out_fapu) const {
  using Column = Eigen::Matrix<double, static_cast<int>(3 * kFeaturePointCount), 1>;
  Column sum = Column::Zero();
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    if (weights[k] != 0.0F) sum += static_cast<double>(weights[k]) * basis_.col(static_cast<Eigen::Index>(k));
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      out_fapu[i][axis] = static_cast<float>(sum(static_cast<Eigen::Index>(3 * i + axis)));
}

}  // namespace volto::rig
