#include "tracker/neutral_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace volto::tracker {
namespace {

constexpr int kSweeps = 10;
constexpr int kLinearisePeriod = 8;
constexpr int kSolveStepsPerPiece = 4;
constexpr int kMostSolveSteps = 60;
constexpr int kPassesBeforeRest = 3;  // the deviations must have settled before rest is looked for
constexpr double kMostGain = 2.0;     // by which a variance may change faster than by plain expectation maximisation
constexpr double kBelowRest =
    3.0;  // a usual expression that makes weights negative is so much less likely than one above rest

const std::array<int, kArkitBlendshapeCount>& mirrorShapes() {
  static const std::array<int, kArkitBlendshapeCount> mirror = [] {
    std::array<int, kArkitBlendshapeCount> m;
    for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) m[k] = static_cast<int>(arkitMirrorIndex(k));
    return m;
  }();
  return mirror;
}

}  // namespace

NeutralEstimator::NeutralEstimator(const MeasuredPoints& points, const ShapePrior& shape,
                                   const rig::ExpressionTable& table, const ExpressionPrior& expression,
                                   const Settings& settings, int capacity)
    : points_(points),
      settings_(settings),
      table_(&table),
      shape_(shape),
      basis_(points, table),
      fit_(points, settings),
      general_(expression.deviation(settings.correlation)),
      store_(static_cast<std::size_t>(capacity)),
      interval_s_(settings.stream_interval_s) {
  const int size = 3 * points.count();
  const Eigen::MatrixXd b = basis_.interleaved();
  basis_matrix_ = b;
  // M's prior: a person's shape and a usual expression of twice the general size.
  const ShapeVector usual = 2 * expression.secondMoment(0).diagonal();
  Eigen::MatrixXd covariance = shape.covariance() + b * usual.asDiagonal() * b.transpose();
  covariance += (settings.shape_size * settings.shape_size) * shape.size() * shape.size().transpose();
  covariance.diagonal().array() += 1e-4;
  mean_precision_ = covariance.llt().solve(Eigen::MatrixXd::Identity(size, size));
  rest_pull_ = b.transpose() * shape.precision();
  rest_normal_ = rest_pull_ * b;

  for (Stored& s : store_) {
    s.seen.ray.setZero(2, points.count());
    s.seen.point.setZero(3, points.count());
    s.seen.weight.setZero(points.count());
  }
  mean_ = neutral_ = pull_ = solution_ = direction_ = remainder_ = product_ = preconditioned_ =
      Eigen::VectorXd::Zero(size);
  block_.setZero(3, size);
  habits_ = general_;
  sorted_.reserve(store_.size());
  mirrorShapes();  // made here, not in the first frame
}

void NeutralEstimator::fixNeutral(const Eigen::VectorXd& deviation, const rig::FeaturePointPositions& neutral_mm,
                                  const ShapeVector& usual, const ShapeMatrix& habits) {
  fixed_ = true;
  usual_ = usual;
  habits_ = general_ = habits;
  neutral_ = mean_ = deviation;
  basis_.fitTo(neutral_mm);
  basis_matrix_ = basis_.interleaved();
  stage_ = Stage::begin;
}

void NeutralEstimator::add(const Observation& seen, const ViewPose& pose, double time_s) {
  if (count_ == static_cast<int>(store_.size())) {
    int kept = 0;
    for (int i = 0; i < count_; i += 2)
      std::swap(store_[static_cast<std::size_t>(kept++)], store_[static_cast<std::size_t>(i)]);
    count_ = kept;
    interval_s_ *= 2;
    stage_ = Stage::begin;  // a pass under way has sums of frames that are gone
    if (time_s - store_[static_cast<std::size_t>(kept - 1)].time_s < interval_s_) {
      last_time_s_ = store_[static_cast<std::size_t>(kept - 1)].time_s;
      return;
    }
  }
  Stored& slot = store_[static_cast<std::size_t>(count_++)];
  slot.seen.has_depth = seen.has_depth;
  slot.seen.ray = seen.ray;
  slot.seen.point = seen.point;
  slot.seen.weight = seen.weight;
  slot.pose = pose;
  slot.weights.setZero();
  slot.fits = 0;
  slot.time_s = last_time_s_ = time_s;
}

double NeutralEstimator::independentFrames() const {
  if (count_ == 0) return 0;
  const double span = store_[static_cast<std::size_t>(count_ - 1)].time_s - store_[0].time_s;
  return std::clamp(1 + span / settings_.independent_s, 1.0, static_cast<double>(count_));
}

bool NeutralEstimator::work() {
  switch (stage_) {
    case Stage::begin:
      if (count_ == 0) return false;
      beginPass();
      return false;
    case Stage::frames:
      fitOne(store_[static_cast<std::size_t>(next_++)]);
      if (next_ == in_pass_) endOfFrames();
      return false;
    case Stage::solve:
      if (solveSome()) stage_ = Stage::finish;
      return false;
    case Stage::finish:
      learnHabits();
      ++passes_;
      stage_ = Stage::begin;
      if (passes_ < kPassesBeforeRest) return false;
      if (!fixed_) findRest();
      has_result_ = true;
      return true;
  }
  return false;
}

void NeutralEstimator::beginPass() {
  in_pass_ = count_;
  next_ = 0;
  prior_.precision = habits_.llt().solve(ShapeMatrix::Identity());
  prior_.low = fixed_ ? 0 : -1;
  prior_.mean = fixed_ ? usual_ : ShapeVector::Zero();
  product_ = shape_.mean() + mean_;
  fit_.setFace(product_, basis_);
  pull_.setZero();
  block_.setZero();
  sum_.setZero();
  scatter_.setZero();
  information_.setZero();
  stage_ = Stage::frames;
}

void NeutralEstimator::fitOne(Stored& stored) {
  if (fixed_) stored.weights = stored.weights.cwiseMax(0.0);
  // A stored frame is linearised again now and then only: its pose hardly moves any more.
  const bool linearise = stored.fits < 2 || stored.fits % kLinearisePeriod == 0;
  if (!fit_.improve(stored.seen, prior_, 1, kSweeps, stored.pose, stored.weights,
                    linearise ? nullptr : &stored.normal)) {
    // No head in this frame's points any more: start it again from the present mean.
    stored.weights.setZero();
    stored.fits = 0;
    if (!fit_.initialisePose(stored.seen, stored.pose)) stored.seen.weight.setZero();
    return;
  }
  if (linearise) stored.normal = fit_.normal();
  ++stored.fits;
  pull_ += fit_.gradient();
  fit_.addPointInformation(stored.seen, block_);
  sum_ += stored.weights;
  scatter_.noalias() += stored.weights * stored.weights.transpose();
  information_ += stored.normal.information;
}

void NeutralEstimator::endOfFrames() {
  const double n = in_pass_;
  const ShapeVector average = sum_ / n;
  scatter_ = scatter_ / n - average * average.transpose();
  information_ /= n;
  if (fixed_) {
    usual_ = average;
    stage_ = Stage::finish;
    return;
  }
  // What all deviations have in common belongs to the mean face.
  for (int i = 0; i < in_pass_; ++i) store_[static_cast<std::size_t>(i)].weights -= average;
  mean_.noalias() += basis_matrix_ * average;
  // Normal equations of M's change: (mean_precision + c H) change = c pull - mean_precision M.
  const double c = std::min(1.0, std::min(settings_.independent_frames, independentFrames()) / n);
  pull_ *= c / (settings_.point_noise_mm * settings_.point_noise_mm);
  block_ *= c / (settings_.point_noise_mm * settings_.point_noise_mm);
  remainder_.noalias() = pull_ - mean_precision_ * mean_;
  iterations_ = 0;
  stage_ = Stage::solve;
}

// Conjugate gradients, preconditioned by each point's own block: the data say nearly everything, the prior the rest.
bool NeutralEstimator::solveSome() {
  const auto precondition = [&] {
    for (int p = 0; p < points_.count(); ++p) {
      Eigen::Matrix3d m = block_.block<3, 3>(0, 3 * p);
      m.diagonal() += mean_precision_.diagonal().segment<3>(3 * p);
      preconditioned_.segment<3>(3 * p).noalias() = m.inverse() * remainder_.segment<3>(3 * p);
    }
  };
  if (iterations_ == 0) {
    precondition();
    direction_ = preconditioned_;
    first_norm_ = remainder_norm_ = remainder_.dot(preconditioned_);
    solution_.setZero();
  }
  for (int step = 0; step < kSolveStepsPerPiece; ++step) {
    if (!(remainder_norm_ > 1e-8 * first_norm_) || iterations_ >= kMostSolveSteps) {
      mean_ += solution_;
      return true;
    }
    product_.noalias() = mean_precision_ * direction_;
    for (int p = 0; p < points_.count(); ++p)
      product_.segment<3>(3 * p).noalias() += block_.block<3, 3>(0, 3 * p) * direction_.segment<3>(3 * p);
    const double length = remainder_norm_ / direction_.dot(product_);
    solution_ += length * direction_;
    remainder_ -= length * product_;
    precondition();
    const double norm = remainder_.dot(preconditioned_);
    direction_ = preconditioned_ + (norm / remainder_norm_) * direction_;
    remainder_norm_ = norm;
    ++iterations_;
  }
  return false;
}

void NeutralEstimator::learnHabits() {
  const ShapeMatrix open = (information_ + prior_.precision).llt().solve(ShapeMatrix::Identity());
  // Expectation maximisation creeps where the points say little (its estimate grows by the share that they explain), so
  // the scatter is scaled up to what it would settle at (D. MacKay: Bayesian interpolation, 1992: variance = scatter /
  // well determined share).
  ShapeVector gain;
  for (int k = 0; k < kShapes; ++k) {
    const double determined = std::max(1 - open(k, k) / habits_(k, k), 0.05);
    const double plain = scatter_(k, k) + open(k, k);
    gain[k] = std::sqrt(std::clamp(scatter_(k, k) / determined / plain, 1 / kMostGain, kMostGain));
  }
  ShapeMatrix seen = gain.asDiagonal() * (scatter_ + open) * gain.asDiagonal();
  // Left and right are used alike in the long run.
  for (int a = 0; a < kShapes; ++a)
    for (int b = 0; b <= a; ++b) {
      const int ma = mirrorShapes()[static_cast<std::size_t>(a)], mb = mirrorShapes()[static_cast<std::size_t>(b)];
      const double value = 0.25 * (seen(a, b) + seen(b, a) + seen(ma, mb) + seen(mb, ma));
      seen(a, b) = seen(b, a) = seen(ma, mb) = seen(mb, ma) = value;
    }
  const double n = std::min(settings_.independent_frames, independentFrames());
  habits_ = (settings_.habit_frames * general_ + n * seen) / (settings_.habit_frames + n);
}

void NeutralEstimator::findRest() {
  ShapeVector rest;
  for (int k = 0; k < kShapes; ++k) {
    sorted_.clear();
    for (int i = 0; i < in_pass_; ++i) sorted_.push_back(store_[static_cast<std::size_t>(i)].weights[k]);
    const double at = settings_.rest_quantile * (static_cast<double>(sorted_.size()) - 1);
    const auto index = static_cast<std::size_t>(at);
    std::nth_element(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(index), sorted_.end());
    double low = sorted_[index];
    if (index + 1 < sorted_.size()) {
      const double next = *std::min_element(sorted_.begin() + static_cast<std::ptrdiff_t>(index) + 1, sorted_.end());
      low += (at - static_cast<double>(index)) * (next - low);
    }
    rest[k] = std::clamp(-low, 0.0, 1.0);
  }
  // A quantile of few frames may be far above rest.
  const double n = independentFrames();
  const ShapeVector doubt =
      (ShapeVector::Constant(settings_.rest_deviation * settings_.rest_deviation) + habits_.diagonal() * (4 / (n * n)));
  const ShapeVector pull = rest_pull_ * mean_;
  ShapeVector slope = pull - rest_normal_ * rest;
  usual_ = rest;
  for (int sweep = 0; sweep < 100; ++sweep) {
    double largest = 0;
    for (int k = 0; k < kShapes; ++k) {
      const double own = rest_normal_(k, k);
      const double wanted = slope[k] + own * usual_[k];
      double value = (wanted + rest[k] / doubt[k]) / (own + 1 / doubt[k]);
      if (value < rest[k]) {
        const double firm = kBelowRest * kBelowRest / doubt[k];
        value = std::min(rest[k], (wanted + rest[k] * firm) / (own + firm));
      }
      value = std::clamp(value, 0.0, 1.0);
      const double moved = value - usual_[k];
      usual_[k] = value;
      slope.noalias() -= moved * rest_normal_.col(k);
      largest = std::max(largest, std::abs(moved));
    }
    if (largest < 1e-5) break;
  }
  neutral_.noalias() = mean_ - basis_matrix_ * usual_;
}

}  // namespace volto::tracker
