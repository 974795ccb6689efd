// Offline: the actor's face at rest from a second of rest, or from a whole take.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/Cholesky>

#include "tracker/detector_noise.h"
#include "tracker/face_model.h"
#include "tracker/frame_fit.h"
#include "tracker/neutral_estimator.h"
#include "tracker/neutral_face.h"
#include "tracker/observation.h"
#include "tracker/settings.h"
#include "tracker/tracker.h"

namespace volto::tracker {
namespace {

struct Face {
  Observation seen;
  ViewPose pose;
  double time_s;
};

LandmarkLayout layoutOf(std::span<const LandmarkFrame> frames) {
  return frames.empty() ? LandmarkLayout::ibug68 : frames.front().layout;
}

// Every frame that shows a face, at most `most` of them, spread evenly.
std::vector<Face> readFaces(std::span<const LandmarkFrame> frames, std::size_t most, Observer& observer,
                            FrameFit& fit) {
  std::vector<std::size_t> good;
  std::vector<Face> faces;
  Face face{makeObservation(static_cast<int>(fit.points().count())), {}, 0};
  const LandmarkLayout layout = layoutOf(frames);
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (frames[i].layout == layout && observer.read(frames[i], face.seen)) good.push_back(i);
  if (good.empty())
    throw std::invalid_argument("no frame shows a face, so there is no neutral to find; give frames with landmarks");
  const std::size_t count = std::min(most, good.size());
  for (std::size_t k = 0; k < count; ++k) {
    const LandmarkFrame& frame = frames[good[count == 1 ? 0 : k * (good.size() - 1) / (count - 1)]];
    observer.read(frame, face.seen);
    if (!fit.initialisePose(face.seen, face.pose)) continue;
    face.time_s = static_cast<double>(frame.t_capture_ns) * 1e-9;
    faces.push_back(face);
  }
  if (faces.empty())
    throw std::invalid_argument("the landmarks form no face; give landmarks of a face in their layout's order");
  return faces;
}

}  // namespace

NeutralFace neutralFromRest(std::span<const LandmarkFrame> rest, const TrackerOptions& options) {
  const Settings settings = settingsFor(options);
  const MeasuredPoints points = measuredPoints(layoutTable(layoutOf(rest)), options);
  const ShapePrior shape(points, settings);
  const ExpressionBasis basis(points, rig::ExpressionTable::standard());
  Observer observer(points, shape.mean(), {options.use_3d, options.focal_length_px});
  FrameFit fit(points, settings);
  fit.setFace(shape.mean(), basis);
  std::vector<Face> faces = readFaces(rest, 120, observer, fit);

  WeightPrior still;
  still.low = still.high = 0;
  const int size = 3 * points.count();
  Eigen::VectorXd deviation = Eigen::VectorXd::Zero(size);
  std::vector<double> rms(faces.size());
  double worst = 1e9;
  const double variance = settings.point_noise_mm * settings.point_noise_mm;
  for (int pass = 0; pass < 12; ++pass) {
    fit.setFace(shape.mean() + deviation, basis);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(size);
    Eigen::MatrixXd normal = shape.precision();
    Eigen::Matrix<double, 3, Eigen::Dynamic> blocks = Eigen::Matrix<double, 3, Eigen::Dynamic>::Zero(3, size);
    for (std::size_t i = 0; i < faces.size(); ++i) {
      Face& face = faces[i];
      ShapeVector weights = ShapeVector::Zero();
      if (!fit.improve(face.seen, still, 2, 1, face.pose, weights)) {
        rms[i] = 1e9;
        continue;
      }
      rms[i] = fit.rms_mm();
      if (rms[i] > worst) continue;
      pull += fit.gradient() / variance;
      fit.addPointInformation(face.seen, blocks);
    }
    for (int p = 0; p < points.count(); ++p)
      normal.block<3, 3>(3 * p, 3 * p) += blocks.block<3, 3>(0, 3 * p) / variance;
    deviation += normal.llt().solve(pull - shape.precision() * deviation);
    if (pass >= 5) {
      // Frames that do not look like the others (a blink) are left out.
      std::vector<double> sorted = rms;
      std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
      worst = 1.5 * sorted[sorted.size() / 2];
    }
  }
  return makeNeutralFace(shape, points, deviation, observer.scale());
}

NeutralFace neutralFromTake(std::span<const LandmarkFrame> take, const TrackerOptions& options,
                            const rig::ExpressionTable& table) {
  return neutralFromTake(take, options, table, settingsFor(options), ExpressionPrior::standard());
}

NeutralFace neutralFromTake(std::span<const LandmarkFrame> take, const TrackerOptions& options,
                            const rig::ExpressionTable& table, const Settings& settings,
                            const ExpressionPrior& expression) {
  const MeasuredPoints points = measuredPoints(layoutTable(layoutOf(take)), options);
  const ShapePrior shape(points, settings);
  const ExpressionBasis basis(points, table);
  Observer observer(points, shape.mean(), {options.use_3d, options.focal_length_px});
  FrameFit fit(points, settings);
  fit.setFace(shape.mean(), basis);
  const std::vector<Face> faces = readFaces(take, static_cast<std::size_t>(settings.take_keyframes), observer, fit);

  NeutralEstimator estimator(points, shape, table, expression, settings, settings.take_keyframes + 1);
  for (const Face& face : faces) estimator.add(face.seen, face.pose, face.time_s);
  while (estimator.passes() < settings.take_passes || !estimator.hasResult()) estimator.work();
  NeutralFace face = makeNeutralFace(shape, points, estimator.neutralDeviation(), observer.scale());
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    face.usual[k] = static_cast<float>(estimator.usualExpression()[i]);
    face.deviation[k] = static_cast<float>(std::sqrt(estimator.habits()(i, i)));
  }
  return face;
}

}  // namespace volto::tracker
