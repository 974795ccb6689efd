#include "rig/subdivision.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "rig/errors.h"
#include "rig/refined_mask.h"

namespace volto::rig {
namespace {

class Subdivider {
 public:
  Subdivider(const SkinProblem& problem, MaskOnSkin mask) : problem_(problem), mask_(std::move(mask)) {
    is_point_.assign(mask_.triangle.size(), false);
    for (const SkinPoint& point : mask_.points)
      if (point.isVertex()) is_point_[point.around.front().vertex] = true;
    inside_.resize(mask_.geometry.triangles.size());
    for (std::uint32_t v = 0; v < mask_.triangle.size(); ++v)
      if (mask_.triangle[v] >= 0 && problem.skin.stands(v))
        inside_[static_cast<std::size_t>(mask_.triangle[v])].push_back(v);
  }

  const MaskOnSkin& mask() const { return mask_; }
  MaskOnSkin take() { return std::move(mask_); }
  std::size_t triangleCount() const { return mask_.geometry.triangles.size(); }
  const std::vector<std::uint32_t>& verticesOf(std::size_t t) const { return inside_[t]; }

  // The vertex at which a triangle would be split; -1: none lies well inside.
  std::int64_t centre(std::size_t t) const {
    const MaskGeometry::Triangle& corner = mask_.geometry.triangles[t];
    const Eigen::Vector3d centroid = (mask_.geometry.points.row(corner[0]) + mask_.geometry.points.row(corner[1]) +
                                      mask_.geometry.points.row(corner[2])) /
                                     3;
    std::int64_t best = -1;
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::uint32_t v : inside_[t]) {
      if (!canSplitAt(v)) continue;
      const double distance = (problem_.mesh.positions.row(v).transpose() - centroid).squaredNorm();
      if (distance < nearest) {
        nearest = distance;
        best = v;
      }
    }
    return best;
  }

  bool canSplitAt(std::uint32_t v) const {
    constexpr double kMargin = 0.03;  // nearer to an edge than this, and one of the three would be a sliver
    const auto& at = mask_.barycentric[v];
    return !is_point_[v] && mask_.triangle[v] >= 0 && std::min({at[0], at[1], at[2]}) > kMargin;
  }

  void splitAt(std::uint32_t v) {
    MaskGeometry& geometry = mask_.geometry;
    const auto t = static_cast<std::size_t>(mask_.triangle[v]);
    const auto m = static_cast<std::uint16_t>(geometry.pointCount());
    geometry.points.conservativeResize(m + 1, 3);
    geometry.points.row(m) = problem_.mesh.positions.row(v);
    geometry.point_side.push_back(geometry.triangle_side[t]);
    mask_.points.push_back({{{v, 0.0F}}, {1.0}});
    is_point_[v] = true;

    const MaskGeometry::Triangle corner = geometry.triangles[t];
    std::array<std::size_t, 3> part{t, triangleCount(), triangleCount() + 1};
    geometry.triangles[t] = {corner[0], corner[1], m};
    geometry.triangles.push_back({corner[1], corner[2], m});
    geometry.triangles.push_back({corner[2], corner[0], m});
    for (int k = 0; k < 2; ++k) {
      geometry.triangle_side.push_back(geometry.triangle_side[t]);
      geometry.base_triangle.push_back(geometry.base_triangle[t]);
    }
    const std::array<double, 3> at = mask_.barycentric[v];
    const std::vector<std::uint32_t> all = std::move(inside_[t]);
    inside_[t].clear();
    inside_.resize(geometry.triangles.size());
    for (const std::uint32_t q : all) {
      // In the part beside edge (i, i + 1) the new point has the share q_k / at_k of the corner k opposite to it.
      const std::array<double, 3> of = mask_.barycentric[q];
      std::array<double, 3> best{};
      double most = -std::numeric_limits<double>::infinity();
      std::size_t best_part = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        const double share = of[k] / at[k];
        const std::array<double, 3> here{of[i] - share * at[i], of[j] - share * at[j], share};
        const double least = std::min({here[0], here[1], here[2]});
        if (least <= most) continue;
        most = least;
        best = here;
        best_part = i;
      }
      double sum = 0;
      for (double& b : best) sum += b = std::max(b, 0.0);
      for (double& b : best) b /= sum;
      mask_.barycentric[q] = best;
      mask_.triangle[q] = static_cast<std::int32_t>(part[best_part]);
      inside_[part[best_part]].push_back(q);
    }
  }

 private:
  const SkinProblem& problem_;
  MaskOnSkin mask_;
  std::vector<bool> is_point_;                      // #V
  std::vector<std::vector<std::uint32_t>> inside_;  // per triangle: the vertices associated with it
};

// What the mean relative error would lose if a vertex were right, for all vertices in triangles of the mask.
std::vector<double> errorByVertex(const SkinProblem& problem, const Subdivider& subdivider, const Columns& examples,
                                  const Eigen::RowVectorXd& size2) {
  const MaskOnSkin& mask = subdivider.mask();
  Columns points(static_cast<Eigen::Index>(mask.points.size()), examples.cols());
  for (std::size_t p = 0; p < mask.points.size(); ++p) {
    points.row(static_cast<Eigen::Index>(p)).setZero();
    for (std::size_t i = 0; i < mask.points[p].around.size(); ++i)
      points.row(static_cast<Eigen::Index>(p)) +=
          mask.points[p].weight[i] * examples.row(mask.points[p].around[i].vertex);
  }
  const Columns made = SkinInterpolation(problem, mask).displace(points);
  // What is to fall is the mean over the examples of |made - example| / |example|: its slope, so that an example that
  // is nearly right already counts for what it can still give.
  Eigen::RowVectorXd error2 = Eigen::RowVectorXd::Zero(examples.cols());
  for (std::size_t t = 0; t < subdivider.triangleCount(); ++t)
    for (const std::uint32_t v : subdivider.verticesOf(t))
      error2 += (made.row(v) - examples.row(v)).array().square().matrix();
  for (Eigen::Index k = 0; k < error2.size(); k += 3) error2.segment(k, 3).setConstant(error2.segment(k, 3).sum());
  const Eigen::RowVectorXd slope = (error2.array().max(1e-30) * size2.array()).rsqrt().matrix();
  const auto errorAt = [&](std::int64_t v) {
    return ((made.row(v) - examples.row(v)).array().square() * slope.array()).sum();
  };
  std::vector<double> error(problem.mesh.vertexCount(), 0.0);
  for (std::size_t t = 0; t < subdivider.triangleCount(); ++t)
    for (const std::uint32_t v : subdivider.verticesOf(t)) error[v] = errorAt(v);
  return error;
}

// How much of the error around a vertex a point may be expected to mend: what the last one there did mend. Some places
// are beyond what the mask can say (the inside of a lip that rolls out), and would draw all points there.
class Promise {
 public:
  explicit Promise(std::size_t vertices) : of_(vertices, -1.0) {}

  // One answer is noisy: the usual counts for more.
  double operator()(std::uint32_t v) const { return of_[v] < 0 ? usual_ : 0.25 * of_[v] + 0.75 * usual_; }

  // After a round: the vertices of the triangles that were split, and the errors before and after.
  void learn(const std::vector<std::vector<std::uint32_t>>& split, const std::vector<double>& before,
             const std::vector<double>& after) {
    double all_before = 0, all_after = 0;
    for (const std::vector<std::uint32_t>& vertices : split) {
      double sum_before = 0, sum_after = 0;
      for (const std::uint32_t v : vertices) {
        sum_before += before[v];
        sum_after += after[v];
      }
      if (!(sum_before > 0)) continue;
      all_before += sum_before;
      all_after += sum_after;
      for (const std::uint32_t v : vertices) of_[v] = std::clamp(1 - sum_after / sum_before, kLeast, 1.0);
    }
    if (all_before > 0) usual_ = std::clamp(1 - all_after / all_before, kLeast, 1.0);
  }

 private:
  static constexpr double kLeast = 0.05;
  std::vector<double> of_;  // #V; negative: nothing is known
  double usual_ = 0.5;      // elsewhere: what points of the last round did
};

void subdivideAutomatically(const SkinProblem& problem, Subdivider& subdivider, std::size_t budget,
                            std::span<const VertexPositions> examples) {
  // All examples side by side, and the square of each one's size over the mask.
  Columns all(static_cast<Eigen::Index>(problem.mesh.vertexCount()), 3 * static_cast<Eigen::Index>(examples.size()));
  for (std::size_t k = 0; k < examples.size(); ++k) all.middleCols(3 * static_cast<Eigen::Index>(k), 3) = examples[k];
  Eigen::RowVectorXd size2 = Eigen::RowVectorXd::Zero(all.cols());
  for (std::size_t t = 0; t < subdivider.triangleCount(); ++t)
    for (const std::uint32_t v : subdivider.verticesOf(t)) size2 += all.row(v).array().square().matrix();
  const double smallest = 1e-12 * std::max(size2.maxCoeff(), 1e-30);
  for (Eigen::Index k = 0; k < size2.cols(); k += 3) {
    const double sum = size2.segment(k, 3).sum();
    size2.segment(k, 3).setConstant(sum > smallest ? sum : std::numeric_limits<double>::infinity());
  }

  Promise promise(problem.mesh.vertexCount());
  std::vector<double> error = errorByVertex(problem, subdivider, all, size2);
  std::size_t added = 0;
  while (added < budget) {
    // The error of all vertices of a triangle, not that of the new point's own alone (tried: worse).
    std::vector<double> gain(subdivider.triangleCount(), 0.0);
    for (std::size_t t = 0; t < gain.size(); ++t) {
      if (subdivider.centre(t) < 0) continue;
      for (const std::uint32_t v : subdivider.verticesOf(t)) gain[t] += promise(v) * error[v];
    }
    std::vector<std::size_t> order(gain.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return gain[a] > gain[b]; });
    const std::size_t before = added;
    const std::size_t round = std::min(budget - added, std::max<std::size_t>({8, budget / 8, added / 4}));
    std::vector<std::vector<std::uint32_t>> split;
    for (const std::size_t t : order) {
      if (added - before == round || !(gain[t] > 0)) break;
      split.push_back(subdivider.verticesOf(t));
      subdivider.splitAt(static_cast<std::uint32_t>(subdivider.centre(t)));
      ++added;
    }
    if (added == before || added == budget) break;  // every vertex is a point, or enough are
    std::vector<double> now = errorByVertex(problem, subdivider, all, size2);
    promise.learn(split, error, now);
    error = std::move(now);
  }
}

}  // namespace

MaskOnSkin subdivide(const SkinProblem& problem, MaskOnSkin mask, const Subdivision& wanted,
                     std::span<const VertexPositions> examples) {
  const std::size_t most = kMaxRefinedPoints - mask.points.size();
  Subdivider subdivider(problem, std::move(mask));
  if (!wanted.vertices.empty()) {
    if (wanted.vertices.size() > most)
      throw InputError("a refined mask may have at most " + std::to_string(kMaxRefinedPoints) + " points");
    for (const std::uint32_t v : wanted.vertices) {
      if (v >= problem.mesh.vertexCount())
        throw InputError("subdivision names vertex " + std::to_string(v) + ", the mesh has " +
                         std::to_string(problem.mesh.vertexCount()));
      const std::uint32_t stands = problem.skin.same_as[v];
      // A little nearer to an edge than ever chosen is still good: another mesh, or another rounding.
      if (!subdivider.canSplitAt(stands))
        throw InputError("subdivision at vertex " + std::to_string(v) +
                         ": it lies on no triangle of the mask, on an edge of one, or is a point already");
      subdivider.splitAt(stands);
    }
    return subdivider.take();
  }
  if (wanted.budget > 0) {
    if (examples.empty()) throw InputError("automatic subdivision needs example meshes");
    subdivideAutomatically(problem, subdivider, std::min(wanted.budget, most), examples);
    return subdivider.take();
  }
  std::vector<bool> chosen(kMaskTriangleCount, wanted.triangles.empty());
  for (const std::uint8_t t : wanted.triangles) chosen.at(t) = true;
  for (int level = 0; level < wanted.levels; ++level) {
    const std::size_t triangles = subdivider.triangleCount();
    for (std::size_t t = 0; t < triangles; ++t) {
      if (!chosen[subdivider.mask().geometry.base_triangle[t]]) continue;
      if (subdivider.mask().points.size() >= kMaxRefinedPoints) break;
      if (const std::int64_t v = subdivider.centre(t); v >= 0) subdivider.splitAt(static_cast<std::uint32_t>(v));
    }
  }
  return subdivider.take();
}

}  // namespace volto::rig
