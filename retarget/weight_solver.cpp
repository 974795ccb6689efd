#include "retarget/weight_solver.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "frames/arkit_blendshapes.h"
#include "rig/shape_set.h"

namespace volto::retarget {
namespace {

// Confidence of a point is used in quarters, the least certain point still counting a little.
constexpr int kConfidenceSteps = 4;
constexpr double kLeastConfidence = 0.125;
// A weight below this is given out as 0, so that a face at rest is at rest.
constexpr double kInvisible = 1e-4;
// A free weight is out of its range when it is by more than this.
constexpr double kOutside = 1e-6;
// So many times the number of weights in the wrong place need not fall before they change one by one.
constexpr int kPatience = 3;
// A tangent of the combinations is good enough when no weight moves further than this; and the most tangents a frame.
constexpr double kTangentHolds = 2e-4;
constexpr int kMostTangents = 12;
// Eye separations: a point that is said to have moved further is not believed.
constexpr double kFarthest = 1e6;
// A face that was not seen for longer than this starts anew.
constexpr std::int64_t kForgetAfter_ns = 250'000'000;

constexpr std::size_t kBlock = 32, kCoordinates = 3 * kFeaturePointCount;

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

// out[k] = sum over the coordinates of basis[coordinate][k] * displacement[coordinate], for one block of shapes.
VOLTO_WIDE void projectBlock(const float* __restrict basis, const float* __restrict displacement,
                             float* __restrict out) {
  float sum[kBlock] = {};
  for (std::size_t i = 0; i < kCoordinates; ++i, basis += kBlock)
    for (std::size_t k = 0; k < kBlock; ++k) sum[k] += basis[k] * displacement[i];
  for (std::size_t k = 0; k < kBlock; ++k) out[k] = sum[k];
}

// The Cholesky factor of a positive definite A in place, lower triangle by columns: column j at a + j * stride, rows
// from `m` to the next multiple of kLanes and those above the diagonal zero. Afterwards the diagonal is in
// `inverse_diagonal` (its inverses) and zero in place, so that whole registers can be used throughout. False when A is
// not positive definite. Single precision: what is lost shows in the next gradient, which is not.
constexpr std::size_t kLanes = 8;

VOLTO_WIDE bool factorise(float* __restrict a, std::size_t stride, std::size_t m, float* __restrict inverse_diagonal) {
  const std::size_t blocks = (m + kLanes - 1) / kLanes;
  for (std::size_t j = 0; j < m; ++j) {
    float* const column = a + j * stride;
    if (!(column[j] > 0.0F)) return false;
    const float inverse = 1.0F / std::sqrt(column[j]);
    inverse_diagonal[j] = inverse;
    for (std::size_t i = j / kLanes * kLanes; i <= j; ++i) column[i] = 0.0F;
    for (std::size_t block = j / kLanes; block < blocks; ++block)
      for (std::size_t i = 0; i < kLanes; ++i) column[block * kLanes + i] *= inverse;
    for (std::size_t l = j + 1; l < m; ++l) {
      float* __restrict const later = a + l * stride;
      const float factor = column[l];
      for (std::size_t block = l / kLanes; block < blocks; ++block)
        for (std::size_t i = 0; i < kLanes; ++i) later[block * kLanes + i] -= factor * column[block * kLanes + i];
    }
  }
  return true;
}

// x becomes the solution of L L' x = x; x is zero from `m` to the next multiple of kLanes.
VOLTO_WIDE void solveFactorised(const float* __restrict a, std::size_t stride, std::size_t m,
                                const float* __restrict inverse_diagonal, float* __restrict x) {
  const std::size_t blocks = (m + kLanes - 1) / kLanes;
  for (std::size_t j = 0; j < m; ++j) {
    const float* const column = a + j * stride;
    x[j] *= inverse_diagonal[j];
    const float by = x[j];
    for (std::size_t block = j / kLanes; block < blocks; ++block)
      for (std::size_t i = 0; i < kLanes; ++i) x[block * kLanes + i] -= by * column[block * kLanes + i];
  }
  for (std::size_t j = m; j-- > 0;) {
    const float* const column = a + j * stride;
    float part[kLanes] = {};
    for (std::size_t block = j / kLanes; block < blocks; ++block)
      for (std::size_t i = 0; i < kLanes; ++i) part[i] += column[block * kLanes + i] * x[block * kLanes + i];
    const float sum = ((part[0] + part[4]) + (part[1] + part[5])) + ((part[2] + part[6]) + (part[3] + part[7]));
    x[j] = (x[j] - sum) * inverse_diagonal[j];
  }
}

double confidenceWeight(std::uint8_t quarters) {
  return quarters == 0 ? kLeastConfidence : static_cast<double>(quarters) / kConfidenceSteps;
}

// 0 for NaN.
double inUnitRange(float value) { return value > 0.0F ? std::min(static_cast<double>(value), 1.0) : 0.0; }

}  // namespace

WeightSolver::WeightSolver(std::span<const rig::Blendshape> shapes, double eye_separation,
                           const WeightSolverOptions& options, std::span<const rig::Combination> combinations)
    : relations_(shapeRelations(shapes, combinations)),
      per_eye_separation_(1.0 / eye_separation),
      options_(options),
      stride_((shapes.size() + 7) / 8 * 8) {
  if (!(eye_separation > 0.0) || !std::isfinite(per_eye_separation_)) {
    throw std::invalid_argument("eye separation must be positive, is " + std::to_string(eye_separation));
  }
  if (shapes.size() > 65535) throw std::invalid_argument("more than 65535 blendshapes");
  readShapes(shapes);
  std::size_t slopes = 0;
  for (const DrivenShape& driven : relations_.driven) {
    shapes_[driven.shape].driven = true;
    slopes += driven.parents.size();
  }
  const std::size_t n = shapes_.size();
  for (std::vector<double>* v : {&gram_, &hessian_}) v->resize(n * stride_);
  cholesky_.resize(n * stride_);
  for (std::vector<double>* v :
       {&pull_, &prior_, &per_curvature_, &before_, &mask_side_, &right_side_, &gradient_, &w_, &tangent_at_})
    v->resize(stride_, 0.0);
  for (std::vector<float>* v : {&step_, &inverse_diagonal_}) v->resize(stride_, 0.0F);
  slope_.resize(slopes, 0.0);
  has_prior_.resize(n, 0);
  role_.resize(n, Role::fixed);
  place_.resize(n, Place::zero);
  wrong_.reserve(n);
  free_.reserve(n);
  factored_.reserve(n);
  confidence_.fill(kConfidenceSteps);
  rebuildGram();
}

WeightSolver::WeightSolver(const rig::Rig& rig, const WeightSolverOptions& options)
    : WeightSolver(rig.blendshapes, rig.fapu.fapu.eye_separation, options, rig.combinations) {}

void WeightSolver::readShapes(std::span<const rig::Blendshape> shapes) {
  const std::size_t blocks = (shapes.size() + kBlock - 1) / kBlock;
  basis_.assign(blocks * kCoordinates * kBlock, 0.0F);
  projected_.assign(blocks * kBlock, 0.0F);
  std::vector<std::string> names;
  for (const rig::Blendshape& shape : shapes) names.push_back(shape.name);
  const rig::ShapeSet* const set = rig::shapeSetOf(names);
  std::array<std::vector<Move>, kFeaturePointCount> of_point;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    Shape shape;
    shape.moves_mask = false;
    // A shape that is one of ARKit's under another name, or its half (browInnerUp_L), has that one's prior.
    const rig::ShapeSet::Shape* meaning = set == nullptr ? nullptr : set->find(shapes[k].name);
    if (const auto arkit = arkitBlendshapeIndex(shapes[k].name))
      shape.arkit = static_cast<std::int32_t>(*arkit);
    else if (meaning != nullptr && meaning->parts.size() == 1)
      shape.arkit = static_cast<std::int32_t>(meaning->parts[0].arkit);
    for (std::size_t p = 0; p < kFeaturePointCount && shapes[k].moves_mask; ++p) {
      const auto& by = shapes[k].mask_displacement[p];
      if (by[0] == 0.0F && by[1] == 0.0F && by[2] == 0.0F) continue;
      Move move{static_cast<std::uint16_t>(k), {}};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(by[axis])) throw std::invalid_argument("blendshape " + shapes[k].name + " is not finite");
        move.by[axis] = static_cast<double>(by[axis]) * per_eye_separation_;
        basis_[(k / kBlock * kCoordinates + 3 * p + axis) * kBlock + k % kBlock] = static_cast<float>(move.by[axis]);
      }
      of_point[p].push_back(move);
      shape.moves_mask = true;
    }
    shapes_.push_back(shape);
  }
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    moves_by_point_.insert(moves_by_point_.end(), of_point[p].begin(), of_point[p].end());
    point_start_[p + 1] = static_cast<std::uint32_t>(moves_by_point_.size());
  }
}

void WeightSolver::reset() {
  untie();
  std::fill(w_.begin(), w_.end(), 0.0);
  std::fill(place_.begin(), place_.end(), Place::zero);
  has_before_ = false;
  system_stale_ = true;
}

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

// True when the system has changed by it: not when only the priors have.
bool WeightSolver::assignRoles(const MaskFrame& in, std::span<std::uint8_t> observed) {
  const bool fitted = in.arkit_observed.any();
  bool changed = false;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const Shape& shape = shapes_[k];
    const bool arkit = shape.arkit >= 0;
    const bool has_prior = arkit && !shape.driven && in.arkit_observed[static_cast<std::size_t>(shape.arkit)];
    const bool seen = has_prior || (shape.moves_mask && !shape.driven && !(arkit && fitted));
    prior_[k] = has_prior ? inUnitRange(in.arkit_weights[static_cast<std::size_t>(shape.arkit)]) : 0.0;
    const Role role = seen && shape.moves_mask ? Role::solved : Role::fixed;
    changed = changed || (role == Role::fixed) != (role_[k] == Role::fixed) || has_prior != (has_prior_[k] != 0);
    has_prior_[k] = has_prior ? 1 : 0;
    pull_[k] = has_prior ? options_.prior_pull : options_.zero_pull + (has_before_ ? options_.temporal_pull : 0.0);
    if (role == Role::fixed || role_[k] == Role::fixed) role_[k] = role;  // a tied shape stays tied
    if (role_[k] == Role::fixed) w_[k] = prior_[k];
    observed[k] = seen ? 1 : 0;
  }
  for (const DrivenShape& driven : relations_.driven)
    observed[driven.shape] = std::all_of(driven.parents.begin(), driven.parents.end(),
                                         [&](std::uint16_t parent) { return observed[parent] != 0; })
                                 ? 1
                                 : 0;
  return changed;
}

// mask_side_ = B' C d, for driven shapes too.
void WeightSolver::projectDisplacement(const MeshMaskDisplacement& displacement) {
  std::array<float, kCoordinates> weighted;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const double c = confidenceWeight(confidence_[p]) * per_eye_separation_;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float d = displacement[p][axis];
      weighted[3 * p + axis] =
          std::isfinite(d) ? static_cast<float>(std::clamp(c * static_cast<double>(d), -kFarthest, kFarthest)) : 0.0F;
    }
  }
  for (std::size_t block = 0; block * kBlock < shapes_.size(); ++block)
    projectBlock(basis_.data() + block * kCoordinates * kBlock, weighted.data(), projected_.data() + block * kBlock);
  for (std::size_t k = 0; k < shapes_.size(); ++k) mask_side_[k] = static_cast<double>(projected_[k]);
}

// The Hessian at the tangent that slope_ holds.
void WeightSolver::buildSystem() {
  const std::size_t n = shapes_.size();
  std::copy(gram_.begin(), gram_.end(), hessian_.begin());
  // A parent moves the mask as its own shape does and, by its slope, as the combination does.
  const auto follow = [&](std::size_t leader, std::size_t follower, double by, bool rows) {
    if (rows) {
      addScaled(by, hessian_.data() + follower * stride_, hessian_.data() + leader * stride_, stride_);
    } else {
      for (std::size_t l = 0; l < n; ++l) hessian_[l * stride_ + leader] += by * hessian_[l * stride_ + follower];
    }
  };
  for (const bool rows : {true, false}) {
    const double* slope = slope_.data();
    for (const DrivenShape& driven : relations_.driven)
      for (const std::uint16_t parent : driven.parents)
        if (const double by = *slope++; by != 0.0) follow(parent, driven.shape, by, rows);
  }
  for (std::size_t k = 0; k < n; ++k) hessian_[k * stride_ + k] += pull_[k];
  for (const ShapePair& pair : relations_.pairs) {
    const std::size_t a = pair.left, b = pair.right;
    if (role_[a] == Role::fixed || role_[b] == Role::fixed || has_prior_[a] != 0 || has_prior_[b] != 0) continue;
    hessian_[a * stride_ + a] += options_.pair_pull;
    hessian_[b * stride_ + b] += options_.pair_pull;
    hessian_[a * stride_ + b] -= options_.pair_pull;
    hessian_[b * stride_ + a] -= options_.pair_pull;
  }
  if (tie_)
    for (const bool rows : {true, false}) follow(*relations_.jaw_open, *relations_.mouth_close, 1.0, rows);
  for (std::size_t k = 0; k < n; ++k) per_curvature_[k] = 1.0 / hessian_[k * stride_ + k];
  system_stale_ = false;
  factor_stale_ = true;
}

void WeightSolver::buildRightSide() {
  const std::size_t n = shapes_.size();
  std::copy(mask_side_.begin(), mask_side_.end(), right_side_.begin());
  // f(w) ~ f(w0) + J (w - w0): the displacement that J w is to make is d - f(w0) + J w0, and for a product of q factors
  // J w0 holds it q times.
  const double* slope = slope_.data();
  for (const DrivenShape& driven : relations_.driven) {
    const double product = *slope * weightOf(driven.parents[0]);
    slope += driven.parents.size();
    if (product != 0.0)
      addScaled(static_cast<double>(driven.parents.size() - 1) * product, gram_.data() + driven.shape * stride_,
                right_side_.data(), stride_);
  }
  slope = slope_.data();
  for (const DrivenShape& driven : relations_.driven)
    for (const std::uint16_t parent : driven.parents) right_side_[parent] += *slope++ * right_side_[driven.shape];
  const double temporal = has_before_ ? options_.temporal_pull : 0.0;
  for (std::size_t k = 0; k < n; ++k)
    right_side_[k] += has_prior_[k] != 0 ? pull_[k] * prior_[k] : temporal * before_[k] - options_.sparsity;
  if (tie_) right_side_[*relations_.jaw_open] += right_side_[*relations_.mouth_close];
}

void WeightSolver::computeGradient() {
  for (std::size_t k = 0; k < shapes_.size(); ++k) gradient_[k] = -right_side_[k];
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    if (w_[k] != 0.0 && role_[k] == Role::solved)
      addScaled(w_[k], hessian_.data() + k * stride_, gradient_.data(), stride_);
}

void WeightSolver::moveTo(std::size_t k, double w) {
  addScaled(w - w_[k], hessian_.data() + k * stride_, gradient_.data(), stride_);
  w_[k] = w;
}

// Once over all weights, each to the minimum along its own axis. Returns the largest change.
double WeightSolver::sweep() {
  double largest = 0.0;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    if (role_[k] != Role::solved) continue;
    const double target = std::clamp(w_[k] - gradient_[k] * per_curvature_[k], 0.0, 1.0);
    const double change = target - w_[k];
    if (change == 0.0) continue;
    largest = std::max(largest, std::abs(change));
    moveTo(k, target);
  }
  return largest;
}

// The minimum over the free weights, wherever that is, the others where they are. False when rounding made the Hessian
// indefinite.
bool WeightSolver::minimiseFree() {
  free_.clear();
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    if (role_[k] == Role::solved && place_[k] == Place::free) free_.push_back(static_cast<std::uint32_t>(k));
  const std::size_t m = free_.size();
  const std::size_t padded = (m + kLanes - 1) / kLanes * kLanes;
  if (factor_stale_ || free_ != factored_) {
    for (std::size_t j = 0; j < m; ++j) {
      const double* from = hessian_.data() + free_[j] * stride_;
      float* column = cholesky_.data() + j * stride_;
      for (std::size_t i = j / kLanes * kLanes; i < j; ++i) column[i] = 0.0F;
      for (std::size_t i = j; i < m; ++i) column[i] = static_cast<float>(from[free_[i]]);
      for (std::size_t i = m; i < padded; ++i) column[i] = 0.0F;
    }
    factor_stale_ = true;
    if (!factorise(cholesky_.data(), stride_, m, inverse_diagonal_.data())) return false;
    factored_ = free_;
    factor_stale_ = false;
  }
  for (std::size_t j = 0; j < m; ++j) step_[j] = static_cast<float>(-gradient_[free_[j]]);
  for (std::size_t j = m; j < padded; ++j) step_[j] = 0.0F;
  solveFactorised(cholesky_.data(), stride_, m, inverse_diagonal_.data(), step_.data());
  for (std::size_t j = 0; j < m; ++j) moveTo(free_[j], w_[free_[j]] + static_cast<double>(step_[j]));
  return true;
}

// Where weight k ought to be: a free one that left 0..1 at the bound, one that pushes away from its bound free.
WeightSolver::Place WeightSolver::betterPlace(std::size_t k) const {
  const double push = gradient_[k] * per_curvature_[k];
  switch (place_[k]) {
    case Place::free:
      return w_[k] < -kOutside ? Place::zero : w_[k] > 1.0 + kOutside ? Place::one : Place::free;
    case Place::zero:
      return push < -options_.tolerance ? Place::free : Place::zero;
    case Place::one:
      return push > options_.tolerance ? Place::free : Place::one;
  }
  return place_[k];
}

// Block principal pivoting (Judice and Pires 1994): all weights that are in the wrong place change it at once, as long
// as that makes them fewer; else only the last of them, which cannot go in circles.
void WeightSolver::minimise() {
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    if (role_[k] == Role::solved && place_[k] != Place::free) w_[k] = place_[k] == Place::one ? 1.0 : 0.0;
  computeGradient();
  std::size_t fewest = shapes_.size() + 1;
  int patience = kPatience;
  for (int round = 0; round < options_.max_rounds; ++round) {
    ++last_rounds_;
    if (!minimiseFree()) break;
    wrong_.clear();
    for (std::size_t k = 0; k < shapes_.size(); ++k)
      if (role_[k] == Role::solved && betterPlace(k) != place_[k]) wrong_.push_back(static_cast<std::uint32_t>(k));
    if (wrong_.empty()) {
      for (const std::uint32_t k : free_) w_[k] = std::clamp(w_[k], 0.0, 1.0);
      return;
    }
    if (wrong_.size() < fewest) {
      fewest = wrong_.size();
      patience = kPatience;
    } else if (patience > 0) {
      --patience;
    } else {
      wrong_.erase(wrong_.begin(), wrong_.end() - 1);
    }
    for (const std::uint32_t k : wrong_) {
      place_[k] = betterPlace(k);
      if (place_[k] != Place::free) moveTo(k, place_[k] == Place::one ? 1.0 : 0.0);
    }
  }
  // Not in the time it has, or beyond what single precision can tell apart: descent from where it is.
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    if (role_[k] == Role::solved) w_[k] = std::clamp(w_[k], 0.0, 1.0);
  computeGradient();
  for (int i = 0; i < options_.max_rounds; ++i) {
    ++last_rounds_;
    if (sweep() <= 0.1 * options_.tolerance) break;
  }
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    place_[k] = w_[k] <= 0.0 ? Place::zero : w_[k] >= 1.0 ? Place::one : Place::free;
}

void WeightSolver::solveWithCombinations() {
  for (int tangent = 0; tangent < kMostTangents; ++tangent) {
    double* slope = slope_.data();
    for (const DrivenShape& driven : relations_.driven)
      for (const std::uint16_t parent : driven.parents) {
        double others = 1.0;
        for (const std::uint16_t other : driven.parents) others *= other == parent ? 1.0 : weightOf(other);
        system_stale_ = system_stale_ || others != *slope;
        *slope++ = others;
      }
    if (system_stale_) buildSystem();
    buildRightSide();
    if (relations_.driven.empty()) return minimise();
    std::copy(w_.begin(), w_.end(), tangent_at_.begin());
    minimise();
    double furthest = 0.0;
    for (const DrivenShape& driven : relations_.driven)
      for (const std::uint16_t parent : driven.parents)
        furthest = std::max(furthest, std::abs(w_[parent] - tangent_at_[parent]));
    if (furthest <= kTangentHolds) return;
  }
}

// mouthClose and jawOpen become one variable or two again. True when nothing had to change.
bool WeightSolver::tiesHold() {
  if (!relations_.mouth_close) return true;
  const std::size_t close = *relations_.mouth_close, jaw = *relations_.jaw_open;
  if (tie_) {
    // gradient_[close] is that of mouthClose alone: it wants less than jawOpen.
    if (gradient_[close] * per_curvature_[close] <= options_.tolerance) return true;
    role_[close] = Role::solved;
    w_[close] = w_[jaw];
    place_[close] = place_[jaw];
    tie_ = false;
  } else {
    if (role_[close] != Role::solved || role_[jaw] != Role::solved || w_[close] <= w_[jaw] + options_.tolerance)
      return true;
    role_[close] = Role::tied;
    w_[close] = 0.0;
    tie_ = true;
  }
  system_stale_ = true;
  return false;
}

void WeightSolver::untie() {
  if (!tie_) return;
  Role& role = role_[*relations_.mouth_close];
  if (role == Role::tied) role = Role::solved;
  tie_ = false;
  system_stale_ = true;
}

void WeightSolver::solve(const MeshMaskDisplacement& displacement, const MaskFrame& in, std::span<float> weights,
                         std::span<std::uint8_t> observed) {
  const std::size_t n = shapes_.size();
  if (weights.size() != n || observed.size() != n) {
    throw std::invalid_argument("room for " + std::to_string(weights.size()) + " weights, the character has " +
                                std::to_string(n) + " blendshapes");
  }
  const std::int64_t since_ns = in.t_capture_ns - before_ns_;
  if (has_before_ && (since_ns < 0 || since_ns > kForgetAfter_ns)) {
    has_before_ = false;
    system_stale_ = true;
  }
  if (updateConfidence(in.point_confidence)) {
    rebuildGram();
    system_stale_ = true;
  }
  if (assignRoles(in, observed)) system_stale_ = true;
  if (tie_ && (role_[*relations_.jaw_open] != Role::solved || role_[*relations_.mouth_close] != Role::tied)) untie();
  projectDisplacement(displacement);
  last_rounds_ = 0;
  for (int ties = 0; ties < 4; ++ties) {
    solveWithCombinations();
    if (tiesHold()) break;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const double w = weightOf(k);
    weights[k] = w < kInvisible ? 0.0F : static_cast<float>(w);
    if (role_[k] != Role::tied) before_[k] = w;
  }
  if (relations_.mouth_close) {  // also where one of them is not solved for, and for the last bit
    const std::size_t close = *relations_.mouth_close, jaw = *relations_.jaw_open;
    before_[close] = std::min(weightOf(close), weightOf(jaw));
    if (observed[jaw] != 0) weights[close] = std::min(weights[close], weights[jaw]);
  }
  relations_.drive(weights);
  if (!has_before_) system_stale_ = true;  // from now on there is a frame before
  has_before_ = true;
  before_ns_ = in.t_capture_ns;
}

}  // namespace volto::retarget
