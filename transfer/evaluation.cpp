#include "transfer/evaluation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "rig/parallel.h"
#include "rig/pose.h"
#include "transfer/added_examples.h"
#include "transfer/self_intersections.h"
#include "transfer/surface.h"

namespace volto::transfer {
namespace {

constexpr double kAreaFactor = 3;
constexpr double kTouchingEs = 5e-4;  // 0.03 mm on a person

class Sum {
 public:
  void add(double error2, double expected2) {
    ++count_;
    error2_ += error2;
    expected2_ += expected2;
    worst2_ = std::max(worst2_, error2);
  }
  ErrorFigures figures(double still) const {
    ErrorFigures f;
    f.vertices = count_;
    if (count_ == 0) return f;
    f.rms = std::sqrt(error2_ / static_cast<double>(count_));
    f.maximum = std::sqrt(worst2_);
    f.expected_rms = std::sqrt(expected2_ / static_cast<double>(count_));
    if (f.expected_rms > still) f.relative = f.rms / f.expected_rms;
    return f;
  }

 private:
  std::size_t count_ = 0;
  double error2_ = 0, expected2_ = 0, worst2_ = 0;
};

}  // namespace

Evaluation evaluate(const rig::Mesh& neutral, const rig::VertexPositions& truth_neutral,
                    std::span<const std::string> names, std::span<const rig::VertexPositions> results,
                    std::span<const rig::VertexPositions> truths, const EvaluationScope& scope) {
  const auto vertices = neutral.positions.rows();
  const auto fits = [&](const rig::VertexPositions& p) { return p.rows() == vertices; };
  if (results.size() != names.size() || truths.size() != names.size() || !fits(truth_neutral) ||
      !std::all_of(results.begin(), results.end(), fits) || !std::all_of(truths.begin(), truths.end(), fits) ||
      (!scope.region_names.empty() && scope.region_of_vertex.size() != neutral.vertexCount()) ||
      (!scope.intersecting.empty() && scope.intersecting.size() != scope.region_names.size()))
    throw std::invalid_argument("evaluate: sizes do not fit together");
  const auto first = static_cast<Eigen::Index>(std::min(scope.first_vertex, neutral.vertexCount()));
  const auto end = static_cast<Eigen::Index>(std::min(scope.end_vertex, neutral.vertexCount()));
  const double size = (neutral.positions.colwise().maxCoeff() - neutral.positions.colwise().minCoeff()).norm();
  const double still = 1e-4 * size;

  Evaluation out;
  out.region_names = scope.region_names;
  std::vector<double> square(neutral.vertexCount(), 0.0);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto& t : rig::triangulate(neutral))
    if (std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return v >= first && v < end; })) triangles.push_back(t);
  std::vector<rig::VertexPositions> all_expected;
  for (const rig::VertexPositions& truth : truths)
    all_expected.push_back(neutral.positions + (truth - truth_neutral));
  // By what is expected, or where that does not say, by the results.
  std::vector<std::int32_t> added(names.size(), -1);
  if (scope.contacts != nullptr && scope.eye_separation > 0) {
    added = addedTo(*scope.contacts, scope.eye_separation, neutral.positions, all_expected);
    if (std::all_of(added.begin(), added.end(), [](std::int32_t to) { return to < 0; }))
      added = addedTo(*scope.contacts, scope.eye_separation, neutral.positions, results);
  }
  std::optional<SelfIntersections> crossings;
  const auto regionsOf = [&](const std::array<std::uint32_t, 3>& t, std::size_t region) {
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) {
      return scope.region_of_vertex[v] == static_cast<std::int16_t>(region);
    });
  };
  if (!scope.intersecting.empty()) {
    std::vector<bool> looked_at;
    for (const auto& t : scope.skin)
      looked_at.push_back(std::any_of(t.begin(), t.end(), [&](std::uint32_t v) {
        const int region = scope.region_of_vertex[v];
        return region >= 0 && scope.intersecting[static_cast<std::size_t>(region)];
      }));
    crossings.emplace(neutral.positions, scope.skin, std::move(looked_at),
                      kTouchingEs * scope.eye_separation);
  }
  const auto crossingsOf = [&](const rig::VertexPositions& positions) {
    ExpressionEvaluation::Crossings c;
    c.regions.assign(scope.region_names.size(), 0);
    for (const auto& [first_triangle, second] : crossings->find(positions)) {
      ++c.pairs;
      for (std::size_t r = 0; r < c.regions.size(); ++r)
        if (regionsOf(crossings->triangle(first_triangle), r) || regionsOf(crossings->triangle(second), r))
          ++c.regions[r];
    }
    return c;
  };
  // What is counted rather than measured: of each, on its own or with what it is added to.
  const auto count = [&](std::size_t i, ExpressionEvaluation& expression) {
    rig::VertexPositions result = results[i], expected = all_expected[i];
    if (added[i] >= 0) {
      const auto to = static_cast<std::size_t>(added[i]);
      expression.counted_with = names[to];
      result = together(neutral.positions, result, results[to]);
      expected = together(neutral.positions, expected, all_expected[to]);
    }
    for (const auto& t : triangles) {
      const auto normal = [&](const rig::VertexPositions& p) {
        const Eigen::Vector3d a = p.row(t[0]), b = p.row(t[1]), c = p.row(t[2]);
        return Eigen::Vector3d((b - a).cross(c - a));
      };
      const Eigen::Vector3d got = normal(result), wanted = normal(expected);
      if (got.dot(wanted) < 0) ++expression.flipped;
      if (got.norm() > kAreaFactor * wanted.norm() || wanted.norm() > kAreaFactor * got.norm())
        ++expression.area_distorted;
    }
    if (scope.contacts != nullptr) {
      expression.result_passes = rig::measurePenetration(*scope.contacts, rig::inSinglePrecision(result));
      expression.expected_passes = rig::measurePenetration(*scope.contacts, rig::inSinglePrecision(expected));
    }
    if (crossings) {
      expression.result_crossings = crossingsOf(result);
      expression.expected_crossings = crossingsOf(expected);
    }
  };
  out.expressions.resize(names.size());
  rig::parallelFor(names.size(), [&](std::size_t i) { count(i, out.expressions[i]); });
  double relative_sum = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    ExpressionEvaluation& expression = out.expressions[i];
    expression.name = names[i];
    const rig::VertexPositions& expected = all_expected[i];
    Sum whole;
    std::vector<Sum> regions(scope.region_names.size());
    for (Eigen::Index v = first; v < end; ++v) {
      const double error2 = (results[i].row(v) - expected.row(v)).squaredNorm();
      const double expected2 = (expected.row(v) - neutral.positions.row(v)).squaredNorm();
      whole.add(error2, expected2);
      square[static_cast<std::size_t>(v)] += error2;
      if (regions.empty()) continue;
      const int region = scope.region_of_vertex[static_cast<std::size_t>(v)];
      if (region >= 0) regions[static_cast<std::size_t>(region)].add(error2, expected2);
    }
    expression.whole = whole.figures(still);
    for (const Sum& region : regions) expression.regions.push_back(region.figures(still));
    if (expression.whole.relative) {
      relative_sum += *expression.whole.relative;
      ++out.related;
    }
  }
  if (out.related > 0) out.mean_relative = relative_sum / static_cast<double>(out.related);
  out.rms_per_vertex.resize(square.size());
  for (std::size_t v = 0; v < square.size(); ++v)
    out.rms_per_vertex[v] =
        names.empty() ? 0.0F : static_cast<float>(std::sqrt(square[v] / static_cast<double>(names.size())));
  return out;
}

}  // namespace volto::transfer
