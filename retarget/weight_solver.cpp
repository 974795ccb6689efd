#include "retarget/weight_solver.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "frames/arkit_blendshapes.h"

namespace volto::retarget {
namespace {

// Confidence of a point is used in quarters, the least certain point still counting a little.
constexpr int kConfidenceSteps = 4;
constexpr double kLeastConfidence = 0.125;
// A weight below this is given out as 0, so that a face at rest is at rest.
constexpr double kInvisible = 1e-4;
// Sweeps of coordinate descent before a Newton step is tried all the same.
constexpr int kMostSweeps = 8;

// The two inner loops, compiled for wider registers too and chosen at run time. No sums are reordered and nothing is
// fused, so every version gives the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define VOLTO_WIDE __attribute__((target_clones("default", "avx2")))
#else
#define VOLTO_WIDE
#endif

// y += factor * x, `count` a multiple of 8.
VOLTO_WIDE void addScaled(double factor, const double* __restrict x, double* __restrict y, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) y[i] += factor * x[i];
}

// Solves A step = step for a positive definite A, lower triangle by columns: column j at a + j * stride. A becomes its
// Cholesky factor. False when A is not positive definite.
VOLTO_WIDE bool choleskySolve(double* __restrict a, std::size_t stride, std::size_t m, double* __restrict step) {
  for (std::size_t j = 0; j < m; ++j) {
    double* const column = a + j * stride;
    if (!(column[j] > 0.0)) return false;
    const double inverse = 1.0 / std::sqrt(column[j]);
    for (std::size_t i = j; i < m; ++i) column[i] *= inverse;
    for (std::size_t l = j + 1; l < m; ++l) {
      double* const later = a + l * stride;
      const double factor = column[l];
      for (std::size_t i = l; i < m; ++i) later[i] -= factor * column[i];
    }
    step[j] /= column[j];
    for (std::size_t i = j + 1; i < m; ++i) step[i] -= step[j] * column[i];
  }
  for (std::size_t j = m; j-- > 0;) {
    const double* const column = a + j * stride;
    double sum = step[j];
    for (std::size_t i = j + 1; i < m; ++i) sum -= column[i] * step[i];
    step[j] = sum / column[j];
  }
  return true;
}

double confidenceWeight(std::uint8_t quarters) {
  return quarters == 0 ? kLeastConfidence : static_cast<double>(quarters) / kConfidenceSteps;
}

// 0 for NaN.
double inUnitRange(float value) { return value > 0.0F ? std::min(static_cast<double>(value), 1.0) : 0.0; }

}  // namespace

WeightSolver::WeightSolver(std::span<const rig::Blendshape> shapes, double eye_separation,
                           const WeightSolverOptions& options)
    : per_eye_separation_(1.0 / eye_separation), options_(options), stride_((shapes.size() + 7) / 8 * 8) {
  if (!(eye_separation > 0.0) || !std::isfinite(per_eye_separation_)) {
    throw std::invalid_argument("eye separation must be positive, is " + std::to_string(eye_separation));
  }
  if (shapes.size() > 65535) throw std::invalid_argument("more than 65535 blendshapes");
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    Shape shape;
    if (const auto arkit = arkitBlendshapeIndex(shapes[k].name)) shape.arkit = static_cast<std::int32_t>(*arkit);
    shape.first_move = static_cast<std::uint32_t>(moves_.size());
    for (std::size_t p = 0; p < kFeaturePointCount && shapes[k].moves_mask; ++p) {
      const auto& by = shapes[k].mask_displacement[p];
      if (by[0] == 0.0F && by[1] == 0.0F && by[2] == 0.0F) continue;
      Move move{static_cast<std::uint16_t>(p), static_cast<std::uint16_t>(k), {}};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(by[axis])) throw std::invalid_argument("blendshape " + shapes[k].name + " is not finite");
        move.by[axis] = static_cast<double>(by[axis]) * per_eye_separation_;
      }
      moves_.push_back(move);
    }
    shape.move_count = static_cast<std::uint32_t>(moves_.size()) - shape.first_move;
    shape.moves_mask = shape.move_count > 0;
    shapes_.push_back(shape);
  }
  moves_by_point_ = moves_;
  std::stable_sort(moves_by_point_.begin(), moves_by_point_.end(),
                   [](const Move& a, const Move& b) { return a.point < b.point; });
  for (const Move& move : moves_) ++point_start_[move.point + 1U];
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) point_start_[p + 1] += point_start_[p];

  const std::size_t n = shapes_.size();
  gram_.resize(n * stride_);
  cholesky_.resize(n * stride_);
  for (std::vector<double>* v : {&pull_, &prior_, &per_curvature_, &right_side_, &gradient_, &w_, &step_, &start_})
    v->resize(stride_, 0.0);
  role_.resize(n, Role::fixed);
  free_.reserve(n);
  confidence_.fill(kConfidenceSteps);
  rebuildGram();
}

void WeightSolver::reset() { std::fill(w_.begin(), w_.end(), 0.0); }

// Only how certain a point is beside the others matters: a face whose every point is half certain is fitted like any
// other.
bool WeightSolver::updateConfidence(const std::array<float, kFeaturePointCount>& confidence) {
  double largest = 0.0;
  for (const float c : confidence) largest = std::max(largest, inUnitRange(c));
  bool changed = false;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const double relative = largest > 0.0 ? inUnitRange(confidence[p]) / largest : 1.0;
    const auto quarters = static_cast<std::uint8_t>(std::lround(relative * kConfidenceSteps));
    changed = changed || quarters != confidence_[p];
    confidence_[p] = quarters;
  }
  return changed;
}

// From nothing each time, so that it does not depend on the frames before.
void WeightSolver::rebuildGram() {
  std::fill(gram_.begin(), gram_.end(), 0.0);
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const double c = confidenceWeight(confidence_[p]);
    for (std::uint32_t i = point_start_[p]; i < point_start_[p + 1]; ++i) {
      const Move& a = moves_by_point_[i];
      const double x = c * a.by[0], y = c * a.by[1], z = c * a.by[2];
      double* row = gram_.data() + a.shape * stride_;
      for (std::uint32_t j = point_start_[p]; j <= i; ++j) {
        const Move& b = moves_by_point_[j];
        row[b.shape] += x * b.by[0] + y * b.by[1] + z * b.by[2];
      }
    }
  }
  // Within a point the shapes are in order, so that the loop above filled the lower half.
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    for (std::size_t l = 0; l < k; ++l) gram_[l * stride_ + k] = gram_[k * stride_ + l];
  }
}

void WeightSolver::assignRoles(const MaskFrame& in, std::span<std::uint8_t> observed) {
  const bool fitted = in.arkit_observed.any();
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const Shape& shape = shapes_[k];
    const bool arkit = shape.arkit >= 0;
    const bool has_prior = arkit && in.arkit_observed[static_cast<std::size_t>(shape.arkit)];
    const bool seen = has_prior || (shape.moves_mask && !(arkit && fitted));
    prior_[k] = has_prior ? inUnitRange(in.arkit_weights[static_cast<std::size_t>(shape.arkit)]) : 0.0;
    pull_[k] = has_prior ? options_.prior_pull : options_.zero_pull;
    per_curvature_[k] = 1.0 / (gram_[k * stride_ + k] + pull_[k]);
    role_[k] = seen && shape.moves_mask ? Role::solved : Role::fixed;
    if (role_[k] == Role::fixed) w_[k] = prior_[k];
    observed[k] = seen ? 1 : 0;
  }
}

void WeightSolver::buildRightSide(const MeshMaskDisplacement& displacement) {
  std::array<std::array<double, 3>, kFeaturePointCount> weighted;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const double c = confidenceWeight(confidence_[p]) * per_eye_separation_;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float d = displacement[p][axis];
      weighted[p][axis] = std::isfinite(d) ? c * static_cast<double>(d) : 0.0;
    }
  }
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    double sum = pull_[k] * prior_[k];
    const Move* move = moves_.data() + shapes_[k].first_move;
    for (std::uint32_t i = 0; i < shapes_[k].move_count; ++i, ++move) {
      const auto& d = weighted[move->point];
      sum += move->by[0] * d[0] + move->by[1] * d[1] + move->by[2] * d[2];
    }
    right_side_[k] = sum;
  }
}

void WeightSolver::computeGradient() {
  const std::size_t n = shapes_.size();
  for (std::size_t k = 0; k < n; ++k) gradient_[k] = pull_[k] * w_[k] - right_side_[k];
  for (std::size_t k = 0; k < n; ++k) {
    if (w_[k] == 0.0 || !shapes_[k].moves_mask) continue;
    addScaled(w_[k], gram_.data() + k * stride_, gradient_.data(), stride_);
  }
}

void WeightSolver::shift(std::size_t k, double by) {
  w_[k] += by;
  addScaled(by, gram_.data() + k * stride_, gradient_.data(), stride_);
  gradient_[k] += by * pull_[k];
}

// Once over all weights, each to the minimum along its own axis. Returns the largest change; counts the weights that
// came to a bound or left one.
double WeightSolver::sweep(std::size_t& changes_of_bound) {
  double largest = 0.0;
  changes_of_bound = 0;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    if (role_[k] == Role::fixed) continue;
    const double target = std::clamp(w_[k] - gradient_[k] * per_curvature_[k], 0.0, 1.0);
    const double change = target - w_[k];
    if (change == 0.0) continue;
    largest = std::max(largest, std::abs(change));
    const bool was_held = w_[k] <= 0.0 || w_[k] >= 1.0, is_held = target <= 0.0 || target >= 1.0;
    changes_of_bound += was_held != is_held ? 1 : 0;
    shift(k, change);
    w_[k] = target;  // exactly the bound, not a rounding beside it
  }
  return largest;
}

// Goes to the minimum over the weights that are not held at a bound, or as far towards it as the bounds allow. True
// when it got there.
bool WeightSolver::newtonStep() {
  free_.clear();
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const bool held = (w_[k] <= 0.0 && gradient_[k] >= 0.0) || (w_[k] >= 1.0 && gradient_[k] <= 0.0);
    if (role_[k] == Role::solved && !held) free_.push_back(static_cast<std::uint32_t>(k));
  }
  const std::size_t m = free_.size();
  if (m == 0) return true;
  // Cholesky, lower triangle by columns: column j of the factor is cholesky_[j * stride_ + i], i >= j.
  for (std::size_t j = 0; j < m; ++j) {
    const double* from = gram_.data() + free_[j] * stride_;
    double* column = cholesky_.data() + j * stride_;
    for (std::size_t i = j; i < m; ++i) column[i] = from[free_[i]];
    column[j] += pull_[free_[j]];
    step_[j] = -gradient_[free_[j]];
  }
  if (!choleskySolve(cholesky_.data(), stride_, m, step_.data())) return false;
  // All the way, weights that would leave 0..1 held at the bound; when that is no improvement, only as far as the first
  // bound.
  const double before = objective();
  bool inside = true;
  double reach = 1.0;
  std::size_t blocking = m;
  for (std::size_t j = 0; j < m; ++j) {
    double& w = w_[free_[j]];
    const double room = step_[j] < 0.0 ? w : 1.0 - w;
    if (std::abs(step_[j]) > room) inside = false;
    if (std::abs(step_[j]) * reach > room) {
      reach = room / std::abs(step_[j]);
      blocking = j;
    }
    start_[j] = w;
    w = std::clamp(w + step_[j], 0.0, 1.0);
  }
  computeGradient();
  if (inside) return true;
  if (objective() < before) return false;
  for (std::size_t j = 0; j < m; ++j) w_[free_[j]] = std::clamp(start_[j] + reach * step_[j], 0.0, 1.0);
  w_[free_[blocking]] = step_[blocking] < 0.0 ? 0.0 : 1.0;
  computeGradient();
  return false;
}

// Of the point w_, up to a constant; gradient_ must be that of w_.
double WeightSolver::objective() const {
  double sum = 0.0;
  for (std::size_t k = 0; k < shapes_.size(); ++k) sum += w_[k] * (gradient_[k] - right_side_[k]);
  return 0.5 * sum;
}

void WeightSolver::minimise() {
  computeGradient();
  for (last_rounds_ = 1; last_rounds_ < options_.max_rounds; ++last_rounds_) {
    // Descent is cheap, the Newton step is not: descend until it is clear which weights lie at a bound.
    std::size_t changes_of_bound = 1;
    for (int i = 0; i < kMostSweeps && changes_of_bound > 0; ++i) {
      if (sweep(changes_of_bound) <= 0.1 * options_.tolerance) return;
    }
    if (!newtonStep()) continue;
    // At the minimum of one face of the box. It is the answer when no weight held at a bound wants to leave it.
    bool settled = true;
    for (std::size_t k = 0; k < shapes_.size() && settled; ++k) {
      if (role_[k] == Role::fixed) continue;
      settled = std::abs(std::clamp(w_[k] - gradient_[k] * per_curvature_[k], 0.0, 1.0) - w_[k]) <= options_.tolerance;
    }
    if (settled) return;
  }
}

void WeightSolver::solve(const MeshMaskDisplacement& displacement, const MaskFrame& in, std::span<float> weights,
                         std::span<std::uint8_t> observed) {
  const std::size_t n = shapes_.size();
  if (weights.size() != n || observed.size() != n) {
    throw std::invalid_argument("room for " + std::to_string(weights.size()) + " weights, the character has " +
                                std::to_string(n) + " blendshapes");
  }
  if (updateConfidence(in.point_confidence)) rebuildGram();
  assignRoles(in, observed);
  buildRightSide(displacement);
  minimise();
  for (std::size_t k = 0; k < n; ++k) weights[k] = w_[k] < kInvisible ? 0.0F : static_cast<float>(w_[k]);
}

}  // namespace volto::retarget
