#include "rig/shape_set.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "rig/errors.h"

namespace volto::rig {

// The texts of rig/assets/shape_sets, put into the library by CMake.
extern const char* const kShapeSetFacsText;
extern const char* const kShapeSetIctText;
extern const char* const kShapeSetVrm0Text;
extern const char* const kShapeSetVrm1Text;

namespace {

constexpr std::size_t kMostShapes = 1000, kLongestName = 200;
constexpr std::string_view kHeader = "shape,arkit,weight";
// Of fromArkit: the pull to zero, and how often descent and the exact step take turns at most, so many sweeps each.
constexpr double kPull = 1e-4, kTolerance = 1e-6;
constexpr int kMostRounds = 30, kSweeps = 5;

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

// The cells of a row, at most four; one more when there are more.
std::vector<std::string_view> cellsOf(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::string_view rest = line; cells.size() < 5;) {
    const auto comma = rest.find(',');
    cells.push_back(trimmed(rest.substr(0, comma)));
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  return cells;
}

// Minimises w' gram w / 2 - right' w over 0 <= w <= 1: descent finds which weights lie at a bound, an exact step on the
// others follows.
Eigen::VectorXd boundedLeastSquares(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right) {
  const Eigen::Index n = right.size();
  Eigen::VectorXd w = Eigen::VectorXd::Zero(n);
  for (int round = 0; round < kMostRounds; ++round) {
    for (int sweep = 0; sweep < kSweeps; ++sweep)
      for (Eigen::Index k = 0; k < n; ++k)
        w[k] = std::clamp(w[k] + (right[k] - gram.row(k).dot(w)) / gram(k, k), 0.0, 1.0);
    std::vector<Eigen::Index> free;
    for (Eigen::Index k = 0; k < n; ++k)
      if (w[k] > 0 && w[k] < 1) free.push_back(k);
    if (free.empty()) continue;
    const Eigen::VectorXd residual = right - gram * w;
    const Eigen::MatrixXd free_gram = gram(free, free);
    const Eigen::VectorXd step = free_gram.llt().solve(residual(free).eval());
    Eigen::VectorXd next = w;
    for (std::size_t j = 0; j < free.size(); ++j) next[free[j]] += step[static_cast<Eigen::Index>(j)];
    if (next.minCoeff() < 0 || next.maxCoeff() > 1) {
      // As far as the first bound in the way.
      double reach = 1;
      for (const Eigen::Index k : free) {
        const double by = next[k] - w[k];
        if (by != 0) reach = std::min(reach, (by < 0 ? w[k] : 1 - w[k]) / std::abs(by));
      }
      w = (w + reach * (next - w)).cwiseMax(0.0).cwiseMin(1.0);
      continue;
    }
    w = next;
    const Eigen::VectorXd descent = right - gram * w;
    bool settled = true;
    for (Eigen::Index k = 0; k < n && settled; ++k)
      settled = std::abs(std::clamp(w[k] + descent[k] / gram(k, k), 0.0, 1.0) - w[k]) < kTolerance;
    if (settled) break;
  }
  return w;
}

std::vector<std::string> arkitNames() { return {kArkitBlendshapeNames.begin(), kArkitBlendshapeNames.end()}; }

}  // namespace

ShapeSet ShapeSet::parse(std::string_view text, const std::string& name, const Suggest& suggest) {
  ShapeSet set;
  set.name_ = name;
  std::size_t line_number = 0;
  const auto fail = [&](const std::string& what) {
    throw InputError(name + ":" + std::to_string(line_number) + ": " + what);
  };
  bool header_seen = false;
  while (!text.empty()) {
    ++line_number;
    const auto end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.starts_with('#')) continue;
    if (!header_seen) {
      if (line != kHeader) fail("the first row must be \"" + std::string(kHeader) + "\"");
      header_seen = true;
      continue;
    }
    const std::vector<std::string_view> cells = cellsOf(line);
    if (cells.size() < 3 || cells.size() > 4)
      fail("a row has 3 columns (" + std::string(kHeader) + "), or 4 with one_way");
    const std::string shape_name(cells[0]);
    if (shape_name.empty() || shape_name.size() > kLongestName) fail("a shape's name has 1 to 200 bytes");
    if (cells.size() == 4 && cells[3] != "one_way")
      fail("the fourth column is one_way or not there, not \"" + std::string(cells[3]) + "\"");
    double weight = 0;
    const auto [stop, error] = std::from_chars(cells[2].data(), cells[2].data() + cells[2].size(), weight);
    if (error != std::errc() || stop != cells[2].data() + cells[2].size() || !(weight >= 0 && weight <= 1))
      fail("weight \"" + std::string(cells[2]) + "\" is no number from 0 to 1");

    auto shape =
        std::find_if(set.shapes_.begin(), set.shapes_.end(), [&](const Shape& s) { return s.name == shape_name; });
    const bool fresh = shape == set.shapes_.end();
    if (fresh) {
      if (set.shapes_.size() == kMostShapes) fail("more than 1000 shapes");
      set.shapes_.push_back({shape_name, {}, false});
      shape = set.shapes_.end() - 1;
    }
    shape->one_way = shape->one_way || cells.size() == 4;
    if (cells[1] == "-") {
      if (!fresh) fail("shape '" + shape_name + "' has parts and none; keep the rows or the dash");
      continue;
    }
    const auto arkit = arkitBlendshapeIndex(cells[1]);
    if (!arkit) {
      const std::string nearest = suggest ? suggest(cells[1], arkitNames()) : std::string();
      fail("shape \"" + std::string(cells[1]) + "\" is no ARKit blendshape" +
           (nearest.empty() ? "; a shape of no such meaning has a dash" : "; did you mean " + nearest + "?"));
    }
    const auto index = static_cast<std::uint16_t>(*arkit);
    const auto at = std::lower_bound(shape->parts.begin(), shape->parts.end(), index,
                                     [](const Part& part, std::uint16_t k) { return part.arkit < k; });
    if (at != shape->parts.end() && at->arkit == index)
      fail("shape '" + shape_name + "' has " + std::string(cells[1]) + " twice; keep one row");
    shape->parts.insert(at, {index, weight});
  }
  if (set.shapes_.empty()) {
    line_number = std::max<std::size_t>(line_number, 1);
    fail("no rows; a shape set has \"" + std::string(kHeader) + "\" and at least one row");
  }
  return set;
}

std::span<const ShapeSet> ShapeSet::shipped() {
  static const std::vector<ShapeSet> sets = [] {
    ShapeSet arkit;
    arkit.name_ = "arkit";
    for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
      arkit.shapes_.push_back({std::string(kArkitBlendshapeNames[k]), {{static_cast<std::uint16_t>(k), 1.0}}, false});
    std::vector<ShapeSet> out{std::move(arkit)};
    out.push_back(parse(kShapeSetFacsText, "facs"));
    out.push_back(parse(kShapeSetIctText, "ict"));
    out.push_back(parse(kShapeSetVrm0Text, "vrm0"));
    out.push_back(parse(kShapeSetVrm1Text, "vrm1"));
    return out;
  }();
  return sets;
}

const ShapeSet* ShapeSet::shipped(std::string_view name) {
  for (const ShapeSet& set : shipped())
    if (set.name_ == name) return &set;
  return nullptr;
}

const ShapeSet::Shape* ShapeSet::find(std::string_view name) const {
  for (const Shape& shape : shapes_)
    if (shape.name == name) return &shape;
  if (name_ != "arkit") return nullptr;
  const auto index = arkitBlendshapeIndex(name);
  return index ? &shapes_[*index] : nullptr;
}

void ShapeSet::toArkit(std::span<const float> weights, ArkitWeights& out) const {
  std::array<double, kArkitBlendshapeCount> sum{};
  for (std::size_t k = 0; k < shapes_.size() && k < weights.size(); ++k)
    for (const Part& part : shapes_[k].parts) sum[part.arkit] += part.weight * static_cast<double>(weights[k]);
  for (std::size_t k = 0; k < sum.size(); ++k) out[k] = static_cast<float>(std::clamp(sum[k], 0.0, 1.0));
}

void ShapeSet::fromArkit(const ArkitWeights& weights, const ArkitObserved& observed, std::span<float> out,
                         std::span<std::uint8_t> out_observed) const {
  std::vector<std::size_t> used;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    double seen = 0, all = 0;
    for (const Part& part : shapes_[k].parts) {
      all += part.weight;
      if (observed[part.arkit]) seen += part.weight;
    }
    out[k] = 0.0F;
    out_observed[k] = all > 0 && seen >= 0.5 * all ? 1 : 0;
    if (out_observed[k] != 0 && !shapes_[k].one_way) used.push_back(k);
  }
  const auto n = static_cast<Eigen::Index>(used.size());
  Eigen::MatrixXd parts = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(kArkitBlendshapeCount), n);
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kArkitBlendshapeCount));
  for (std::size_t a = 0; a < kArkitBlendshapeCount; ++a)
    if (observed[a]) wanted[static_cast<Eigen::Index>(a)] = static_cast<double>(weights[a]);
  for (Eigen::Index k = 0; k < n; ++k)
    for (const Part& part : shapes_[used[static_cast<std::size_t>(k)]].parts)
      if (observed[part.arkit]) parts(part.arkit, k) = part.weight;
  Eigen::MatrixXd gram = parts.transpose() * parts;
  gram.diagonal().array() += kPull;
  const Eigen::VectorXd w = boundedLeastSquares(gram, parts.transpose() * wanted);
  for (Eigen::Index k = 0; k < n; ++k)
    out[used[static_cast<std::size_t>(k)]] = static_cast<float>(std::min(w[k] * (1.0 + kPull), 1.0));
}

const ShapeSet* shapeSetOf(std::span<const std::string> names) {
  const ShapeSet* best = nullptr;
  std::size_t most = 0;
  for (const ShapeSet& set : ShapeSet::shipped()) {
    const auto known = static_cast<std::size_t>(
        std::count_if(names.begin(), names.end(), [&](const std::string& name) { return set.find(name) != nullptr; }));
    if (known > most && 2 * known >= names.size()) {
      best = &set;
      most = known;
    }
  }
  return best;
}

ShapeSet ShapeSet::ofNames(std::span<const std::string> names, const ShapeSet& known) {
  ShapeSet out;
  out.name_ = known.name_;
  for (const std::string& name : names) {
    const Shape* shape = known.find(name);
    out.shapes_.push_back(shape != nullptr ? *shape : Shape{name, {}, false});
    out.shapes_.back().name = name;
  }
  return out;
}

}  // namespace volto::rig
