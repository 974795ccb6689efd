#include "tracker/tracker.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>

#include "rig/fapu.h"
#include "tracker/detector_noise.h"
#include "tracker/face_model.h"
#include "tracker/frame_fit.h"
#include "tracker/gaze.h"
#include "tracker/head_filter.h"
#include "tracker/head_pose.h"
#include "tracker/lid_range.h"
#include "tracker/mean_face.h"
#include "tracker/neutral_estimator.h"
#include "tracker/neutral_face.h"
#include "tracker/observability.h"
#include "tracker/observation.h"
#include "tracker/region_filters.h"
#include "tracker/settings.h"

namespace volto::tracker {
namespace {

constexpr int kIterations = 3;
constexpr int kSweeps = 8;
constexpr double kPoorFit_mm = 3.0;  // beyond this the pose may have gone astray and is looked for anew
constexpr double kNoFace_mm = 9.0;   // beyond this the points are no face
constexpr double kSmallestStep_s = 0.001, kLargestStep_s = 0.25;
constexpr double kNeutralBlend_s = 0.3;  // a better neutral is blended in over about this time
constexpr double kReturn_s = 0.25;       // a face that came back is blended in over this time
constexpr double kSettle_s = 1.0;        // points are followed beyond the table once the neutral has stood so long
constexpr double kUnitChange = 0.01;     // expressions are scaled anew when a FAPU changed by more than this
constexpr double kLargestResidual_mm = 6.0;

// Of the subject's right (0) and left (1) eye.
std::size_t eyeBlinkIndex(std::size_t eye) {
  static const std::array<std::size_t, 2> index = {arkitBlendshapeIndex("eyeBlinkRight").value(),
                                                   arkitBlendshapeIndex("eyeBlinkLeft").value()};
  return index[eye];
}

}  // namespace

struct Tracker::State {
  State(const TrackerOptions& o, const rig::ExpressionTable& t, const Settings& s, const ExpressionPrior& e)
      : options(o), table(&t), settings(s), expression(&e), filters(o.from_pixels) {
    build(LandmarkLayout::ibug68);
  }

  // What depends on the layout.
  struct Parts {
    Parts(const State& state, LandmarkLayout l)
        : layout(l),
          points(measuredPoints(layoutTable(l), state.options)),
          shape(points, state.settings),
          basis(points, *state.table),
          observer(points, shape.mean(), {state.options.use_3d, state.options.focal_length_px}),
          fit(points, state.settings),
          estimator(points, shape, *state.table, *state.expression, state.settings, state.settings.stream_keyframes),
          observed(observableShapes(points, *state.table, false)),
          observed_with_depth(observableShapes(points, *state.table, true)),
          seen(makeObservation(points.count())) {
      neutral = target = Eigen::VectorXd::Zero(3 * points.count());
      takeFace(meanFace());
      faceChanged();
    }

    void takeFace(const rig::FeaturePointPositions& face_mm) {
      fapu = rig::measureFapu(face_mm).fapu;
      scale_mm = rig::fapuScale(fapu);
      basis.fitTo(face_mm);
    }

    void faceChanged() {
      face = shape.mean() + neutral;
      fit.setFace(face, basis);
    }

    LandmarkLayout layout;
    MeasuredPoints points;
    ShapePrior shape;
    ExpressionBasis basis;
    Observer observer;
    FrameFit fit;
    NeutralEstimator estimator;
    ArkitObserved observed, observed_with_depth;
    const ArkitObserved& shows() const { return seen.has_depth ? observed_with_depth : observed; }
    Observation seen;
    Eigen::VectorXd face;
    Eigen::VectorXd neutral, target;  // deviation from the mean face: in use, and where it is going
    rig::Fapu fapu;
    rig::FeaturePointPositions scale_mm;
  };

  void build(LandmarkLayout layout) {
    parts.emplace(*this, layout);
    prior.precision = expression->secondMoment(settings.correlation).llt().solve(ShapeMatrix::Identity());
    usual.setZero();
    if (fixed) fixNeutral(*fixed);
    tracking = false;
  }

  void fixNeutral(const NeutralFace& face) {
    const Deviation deviation = deviationOf(face, parts->shape, parts->points);
    parts->neutral = parts->target = deviation.points;
    parts->observer.expectScale(deviation.scale);
    const rig::FeaturePointPositions mm = parts->shape.complete(parts->neutral);
    parts->takeFace(mm);
    parts->faceChanged();
    ShapeMatrix habits = expression->secondMoment(settings.correlation);
    usual.setZero();
    if (std::ranges::any_of(face.deviation, [](float d) { return d > 0; })) {
      ShapeVector spread;
      for (int k = 0; k < kShapes; ++k) {
        usual[k] = std::clamp(static_cast<double>(face.usual[static_cast<std::size_t>(k)]), 0.0, 1.0);
        spread[k] = std::clamp(static_cast<double>(face.deviation[static_cast<std::size_t>(k)]), 0.0, 1.0);
      }
      habits = expression->covarianceOf(spread, settings.correlation);
    }
    prior.precision = habits.llt().solve(ShapeMatrix::Identity());
    parts->estimator.fixNeutral(parts->neutral, mm, usual, habits);
    known = true;
    known_s = kSettle_s;
  }

  bool track(double dt_s);
  void learn();
  void adoptEstimate();
  void measure(const LandmarkFrame& in, double dt_s, MaskFrame& out);
  void lose(double dt_s, MaskFrame& out);
  void blendIn(double dt_s, MaskFrame& out);
  HeadPose restingHead(float left) const;

  TrackerOptions options;
  const rig::ExpressionTable* table;
  Settings settings;
  const ExpressionPrior* expression;
  std::optional<Parts> parts;
  std::optional<NeutralFace> fixed;

  // Expression statistics in use.
  WeightPrior prior;
  ShapeVector usual;
  bool known = false;  // the neutral rests on this actor's frames
  double known_s = 0;

  // This stream.
  bool tracking = false;
  bool started = false;
  std::int64_t last_ns = 0;
  std::optional<double> to_learn_dt_s;  // the last frame still has to be learned from; its distance to the one before
  ViewPose pose;
  ShapeVector weights = ShapeVector::Zero();
  RegionFilters filters;
  HeadFilter head_filter;
  GazeTracker gaze;
  std::array<LidCalibration, 2> lids;  // right, left
  rig::FeaturePointPositions rest_mm = rig::FeaturePointPositions::Zero();

  // Lost and found.
  MaskFrame last_good;  // as it was put out
  MaskFrame shown;      // what was put out last
  bool ever_shown = false;
  double lost_s = 0;
  double back_s = kReturn_s;  // since the face came back
  double away_s = 0;          // how long it had been lost
  MaskFrame before_return;
};

bool Tracker::State::track(double dt_s) {
  Parts& p = *parts;
  if (!tracking) {
    if (!p.fit.initialisePose(p.seen, pose)) return false;
    weights = usual;
  }
  // An expression persists: the weights follow an Ornstein-Uhlenbeck process about the usual expression.
  const double keep = tracking && settings.expression_memory_s > 0 ? std::exp(-dt_s / settings.expression_memory_s) : 0;
  prior.tightness = 1 / (1 - keep * keep);
  prior.mean = usual + keep * (weights - usual);
  const int iterations = tracking ? kIterations : 3 * kIterations;
  bool good = p.fit.improve(p.seen, prior, iterations, kSweeps, pose, weights);
  if (tracking && (!good || p.fit.rms_mm() > kPoorFit_mm)) {
    const double rms = good ? p.fit.rms_mm() : 1e9;
    ViewPose other_pose;
    ShapeVector other = usual;
    if (p.fit.initialisePose(p.seen, other_pose)) {
      prior.tightness = 1;
      prior.mean = usual;
      if (p.fit.improve(p.seen, prior, 3 * kIterations, kSweeps, other_pose, other) && p.fit.rms_mm() < rms) {
        pose = other_pose;
        weights = other;
        good = true;
      }
    }
    if (good && !p.fit.evaluate(p.seen, pose, weights)) good = false;
  }
  return good && p.fit.rms_mm() < kNoFace_mm;
}

void Tracker::State::learn() {
  if (!to_learn_dt_s) return;
  const double time_s = static_cast<double>(last_ns) * 1e-9, dt_s = *to_learn_dt_s;
  to_learn_dt_s.reset();
  Parts& p = *parts;
  if (p.estimator.wants(time_s)) p.estimator.add(p.seen, pose, time_s);
  const int pieces =
      p.estimator.passes() < settings.early_passes ? settings.early_pieces_per_frame : settings.pieces_per_frame;
  for (int piece = 0; piece < pieces; ++piece)
    if (p.estimator.work()) adoptEstimate();
  if (known && !fixed) known_s += dt_s;
  if (p.target == p.neutral) return;
  p.neutral += (1 - std::exp(-dt_s / kNeutralBlend_s)) * (p.target - p.neutral);
  if ((p.target - p.neutral).cwiseAbs().maxCoeff() < 0.01) p.neutral = p.target;
  p.faceChanged();
}

void Tracker::State::adoptEstimate() {
  Parts& p = *parts;
  usual = p.estimator.usualExpression();
  prior.precision = p.estimator.habits().llt().solve(ShapeMatrix::Identity());
  if (fixed) return;
  p.target = p.estimator.neutralDeviation();
  known = true;
  const rig::FeaturePointPositions face = p.shape.complete(p.target);
  const rig::Fapu fapu = rig::measureFapu(face).fapu;
  const auto differs = [](double a, double b) { return std::abs(a - b) > kUnitChange * b; };
  if (differs(fapu.iris_diameter, p.fapu.iris_diameter) || differs(fapu.eye_separation, p.fapu.eye_separation) ||
      differs(fapu.eye_nose, p.fapu.eye_nose) || differs(fapu.mouth_nose, p.fapu.mouth_nose) ||
      differs(fapu.mouth_width, p.fapu.mouth_width))
    p.takeFace(face);
  p.faceChanged();
}

void Tracker::State::measure(const LandmarkFrame& in, double dt_s, MaskFrame& out) {
  const Parts& p = *parts;
  // What the measured points show beyond the table; trusted as far as the neutral is.
  const double trust = std::clamp(known_s / kSettle_s, 0.0, 1.0);
  rest_mm.setZero();
  for (int i = 0; i < p.points.count(); ++i) {
    const int feature = p.points.feature[static_cast<std::size_t>(i)];
    Eigen::Vector3d rest = p.fit.residual().segment<3>(3 * i);
    const double length = rest.norm();
    if (length > kLargestResidual_mm) rest *= kLargestResidual_mm / length;
    rest_mm.row(feature) = (trust * p.points.trust[i] * rest).transpose();
  }
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    out.arkit_weights[k] = p.shows()[k] ? static_cast<float>(weights[static_cast<Eigen::Index>(k)]) : 0.0F;
  if (options.from_pixels) {
    for (std::size_t eye = 0; eye < 2; ++eye) {
      const std::optional<float> opening = eyeOpening(in, eye, pose.rotation);
      if (!opening && lids[eye].range().open <= 0) continue;  // never seen: as fitted
      out.arkit_weights[eyeBlinkIndex(eye)] = opening ? lids[eye].push(*opening, dt_s) : lids[eye].last();
    }
  }
  filters.push(dt_s, options.smoothing, options.regions, out.arkit_weights, rest_mm);

  out.state = TrackingState::tracking;
  const double fit_quality = 1 / (1 + std::pow(p.fit.rms_mm() / kPoorFit_mm, 2));
  out.confidence = static_cast<float>(std::clamp(static_cast<double>(in.confidence), 0.0, 1.0) * fit_quality);
  table->apply(out.arkit_weights, out.displacement_fapu);
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(c);
      out.displacement_fapu[i][c] += static_cast<float>(rest_mm(row, column) / p.scale_mm(row, column));
    }
    out.point_confidence[i] = 0.5F;  // inferred from the table
  }
  for (int i = 0; i < p.points.count(); ++i)
    if (p.seen.weight[i] > 0)
      out.point_confidence[static_cast<std::size_t>(p.points.feature[static_cast<std::size_t>(i)])] =
          static_cast<float>(0.5 + 0.5 * p.points.trust[i] * p.seen.weight[i]);
  Eigen::Vector3d translation = p.observer.scale() * pose.translation;
  translation.tail<2>() = -translation.tail<2>();
  Eigen::Matrix3d rotation = pose.rotation;
  head_filter.push(dt_s, options.smoothing * options.regions.head, rotation, translation);
  setHeadPose(rotation, translation, out.head);
  out.arkit_observed = p.shows();
  gaze.push(in, pose, p.observer.focalLength_px(), dt_s, options.smoothing * options.regions.gaze, out.gaze);
  lookSideways(out.gaze, out.arkit_weights, out.arkit_observed);
}

namespace {

float mix(float from, float to, float share) { return from + share * (to - from); }

// Expression only: `share` of `to`, the rest of `from`.
void mixExpression(const MaskFrame& from, const MaskFrame& to, float share, MaskFrame& out) {
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      out.displacement_fapu[i][c] = mix(from.displacement_fapu[i][c], to.displacement_fapu[i][c], share);
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    out.arkit_weights[k] = mix(from.arkit_weights[k], to.arkit_weights[k], share);
}

}  // namespace

void Tracker::State::lose(double dt_s, MaskFrame& out) {
  tracking = false;
  lost_s += dt_s;
  back_s = kReturn_s;
  out.confidence = 0;
  out.gaze = {};
  out.arkit_observed = parts->shows();
  out.point_confidence.fill(0);
  if (!ever_shown || lost_s > options.hold_s + options.ease_s) {
    out.state = TrackingState::no_face;
    for (auto& d : out.displacement_fapu) d.fill(0);
    out.arkit_weights.fill(0);
    out.head = restingHead(0);
    return;
  }
  const double into_ease = options.ease_s > 0 ? (lost_s - options.hold_s) / options.ease_s : 1;
  const double share = std::clamp(into_ease, 0.0, 1.0);
  out.state = lost_s <= options.hold_s ? TrackingState::holding : TrackingState::easing;
  const auto left = static_cast<float>(1 - share * share * (3 - 2 * share));
  static const MaskFrame neutral;
  mixExpression(neutral, last_good, left, out);
  out.head = restingHead(left);
}

// Of a lost face: turned as it was seen last by the share `left` of it, where it was.
HeadPose Tracker::State::restingHead(float left) const {
  HeadPose out = last_good.head;
  out.observed = false;
  if (options.keep_head || left >= 1) return out;
  HeadPose upright;
  upright.translation_mm = out.translation_mm;
  mixHeadPose(upright, last_good.head, left, out);
  return out;
}

// A face that was lost comes back without a jump.
void Tracker::State::blendIn(double dt_s, MaskFrame& out) {
  if (back_s >= kReturn_s) return;
  back_s += dt_s;
  const auto share = static_cast<float>(std::clamp(back_s / kReturn_s, 0.0, 1.0));
  mixExpression(before_return, out, share, out);
  // The head has gone no further than it was given time to: what was away for a moment is followed at once.
  const auto head_share = static_cast<float>(std::clamp(back_s / std::min(kReturn_s, away_s), 0.0, 1.0));
  const HeadPose seen_head = out.head;
  if (head_share < 1) mixHeadPose(before_return.head, seen_head, head_share, out.head);
}

Tracker::Tracker(const TrackerOptions& options, const rig::ExpressionTable& table)
    : Tracker(options, table, settingsFor(options), ExpressionPrior::standard()) {}
Tracker::Tracker(const TrackerOptions& options, const rig::ExpressionTable& table, const Settings& settings,
                 const ExpressionPrior& expression)
    : state_(std::make_unique<State>(options, table, settings, expression)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::setNeutral(const NeutralFace& neutral) {
  deviationOf(neutral, state_->parts->shape, state_->parts->points);  // throws before anything changes
  state_->learn();
  state_->fixed = neutral;
  state_->fixNeutral(neutral);
  for (std::size_t eye = 0; eye < 2; ++eye) state_->lids[eye].start(neutral.lids[eye]);
}

NeutralFace Tracker::neutral() const {
  state_->learn();
  const State& s = *state_;
  NeutralFace face = makeNeutralFace(s.parts->shape, s.parts->points, s.parts->target, s.parts->observer.scale());
  if (s.parts->estimator.hasResult()) {
    for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      face.usual[k] = static_cast<float>(std::clamp(s.usual[i], 0.0, 1.0));
      face.deviation[k] =
          static_cast<float>(std::clamp(std::sqrt(std::max(s.parts->estimator.habits()(i, i), 0.0)), 0.0, 1.0));
    }
  }
  for (std::size_t eye = 0; eye < 2; ++eye) face.lids[eye] = s.lids[eye].range();
  return face;
}

void Tracker::learn() { state_->learn(); }

void Tracker::push(const LandmarkFrame& in, MaskFrame& out) {
  State& s = *state_;
  s.learn();
  if (in.layout != s.parts->layout) s.build(in.layout);
  out.t_capture_ns = in.t_capture_ns;
  out.capture_seq = in.capture_seq;

  double passed_s = 1.0 / 60;
  bool usable = true;
  if (s.started) {
    usable = in.t_capture_ns > s.last_ns;
    passed_s = usable ? 1e-9 * (static_cast<double>(in.t_capture_ns) - static_cast<double>(s.last_ns)) : 0;
  }
  const double dt_s = std::clamp(passed_s, kSmallestStep_s, kLargestStep_s);
  if (usable) s.last_ns = in.t_capture_ns;
  s.started = true;

  usable = usable && s.parts->observer.read(in, s.parts->seen);
  const bool was_tracking = s.tracking;
  if (usable && s.track(dt_s)) {
    if (!was_tracking) {
      s.filters.reset();
      s.head_filter.reset();
      s.gaze.reset();
      if (s.ever_shown) {
        s.before_return = s.shown;
        s.back_s = 0;
        s.away_s = s.lost_s;
      }
    }
    s.tracking = true;
    s.lost_s = 0;
    s.measure(in, dt_s, out);
    s.blendIn(dt_s, out);
    s.to_learn_dt_s = dt_s;
    s.last_good = out;
    s.ever_shown = true;
  } else {
    s.lose(passed_s, out);
  }
  s.shown = out;
}

}  // namespace volto::tracker
