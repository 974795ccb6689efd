#include "tracker/observation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace volto::tracker {
namespace {

// A focal length for a camera that nobody described, as a multiple of the image's longer side. 1 is a horizontal field
// of view of 53 degrees, between webcams (60 to 80) and portrait lenses.
constexpr double kGuessedFocalLength = 1.0;
constexpr double kLargestPixel = 1e5;
constexpr double kLeastConfidence = 0.05;
constexpr double kOtherSize =
    0.15;  // a face this much larger or smaller than expected is not the one that was measured

// The smallest usual image that holds all points; for landmark files that do not say.
std::array<double, 2> guessImageSize(const LandmarkFrame& frame) {
  double right = 0, bottom = 0;
  for (const auto& p : frame.points_px) {
    if (std::isfinite(p[0])) right = std::max(right, static_cast<double>(p[0]));
    if (std::isfinite(p[1])) bottom = std::max(bottom, static_cast<double>(p[1]));
  }
  constexpr std::array<std::array<double, 2>, 5> kUsual = {
      {{640, 480}, {1280, 720}, {1920, 1080}, {2560, 1440}, {3840, 2160}}};
  for (const auto& size : kUsual)
    if (right <= 1.02 * size[0] && bottom <= 1.02 * size[1]) return size;
  return {right, bottom};
}

}  // namespace

Observation makeObservation(int points) {
  Observation o;
  o.ray.setZero(2, points);
  o.point.setZero(3, points);
  o.weight.setZero(points);
  return o;
}

Observer::Observer(const MeasuredPoints& points, const Eigen::VectorXd& mean_face, const ObserverOptions& options)
    : points_(points), mean_face_(mean_face), options_(options) {}

void Observer::chooseCamera(const LandmarkFrame& frame) {
  std::array<double, 2> size = {static_cast<double>(frame.image_width_px), static_cast<double>(frame.image_height_px)};
  if (!(size[0] > 0 && size[1] > 0)) size = guessImageSize(frame);
  centre_x_px_ = 0.5 * size[0];
  centre_y_px_ = 0.5 * size[1];
  focal_px_ = options_.focal_length_px;
  if (!(focal_px_ > 0 && std::isfinite(focal_px_))) focal_px_ = frame.focal_length_px;
  if (!(focal_px_ > 0 && std::isfinite(focal_px_))) focal_px_ = kGuessedFocalLength * std::max(size[0], size[1]);
  focal_px_ = std::max(focal_px_, 1.0);
  camera_known_ = true;
}

void Observer::expectScale(double scale) {
  scale_ = scale;
  scale_known_ = true;
  scale_checked_ = false;
}

bool Observer::read(const LandmarkFrame& frame, Observation& out) {
  if (!frame.face_present) return false;
  const std::size_t expected = landmarkCount(frame.layout);
  const bool has_2d = frame.points_px.size() == expected;
  const bool has_3d = options_.use_3d && frame.points_camera_mm.size() == expected;
  if (!has_2d && !has_3d) return false;
  if (!frame.point_confidence.empty() && frame.point_confidence.size() != expected) return false;
  if (has_2d && !camera_known_) chooseCamera(frame);
  out.has_depth = has_3d;
  const bool read = has_3d ? read3d(frame, out) : read2d(frame, out);
  if (!read) return false;
  int missing = 0;
  for (int p = 0; p < points_.count(); ++p) {
    if (!frame.point_confidence.empty()) {
      const float confidence =
          frame.point_confidence[static_cast<std::size_t>(points_.landmark[static_cast<std::size_t>(p)])];
      out.weight[p] *= confidence >= kLeastConfidence ? std::min(static_cast<double>(confidence), 1.0) : 0.0;
    }
    if (out.weight[p] <= 0) ++missing;
  }
  return 4 * missing <= points_.count();
}

bool Observer::read2d(const LandmarkFrame& frame, Observation& out) const {
  for (int p = 0; p < points_.count(); ++p) {
    const auto& at = frame.points_px[static_cast<std::size_t>(points_.landmark[static_cast<std::size_t>(p)])];
    const bool good = std::abs(at[0]) < kLargestPixel && std::abs(at[1]) < kLargestPixel;  // false for NaN too
    out.weight[p] = good ? 1 : 0;
    out.ray.col(p) << (good ? (at[0] - centre_x_px_) / focal_px_ : 0), (good ? (centre_y_px_ - at[1]) / focal_px_ : 0);
  }
  return true;
}

bool Observer::read3d(const LandmarkFrame& frame, Observation& out) {
  constexpr double kLargest_mm = 1e5;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), model_centre = Eigen::Vector3d::Zero();
  int good_points = 0;
  for (int p = 0; p < points_.count(); ++p) {
    const auto& at = frame.points_camera_mm[static_cast<std::size_t>(points_.landmark[static_cast<std::size_t>(p)])];
    const bool good = std::abs(at[0]) < kLargest_mm && std::abs(at[1]) < kLargest_mm && std::abs(at[2]) < kLargest_mm;
    out.weight[p] = good ? 1 : 0;
    out.point.col(p) << (good ? at[0] : 0), (good ? -at[1] : 0), (good ? -at[2] : 0);
    if (!good) continue;
    ++good_points;
    centre += out.point.col(p);
    model_centre += mean_face_.segment<3>(3 * p);
  }
  if (good_points * 4 < points_.count() * 3) return false;
  centre /= good_points;
  model_centre /= good_points;
  if (!scale_checked_) {
    double spread = 0, model_spread = 0;
    for (int p = 0; p < points_.count(); ++p) {
      if (out.weight[p] <= 0) continue;
      spread += (out.point.col(p) - centre).squaredNorm();
      model_spread += (mean_face_.segment<3>(3 * p) - model_centre).squaredNorm();
    }
    const double ratio = std::sqrt(spread / model_spread);
    if (!(ratio > 1e-3 && ratio < 1e3)) return false;
    // One size for the whole stream: what an expression adds to the first frame's, the neutral's estimate takes out
    // again.
    if (!scale_known_ || std::abs(ratio / scale_ - 1) > kOtherSize) scale_ = ratio;
    scale_checked_ = true;
  }
  out.point /= scale_;
  return true;
}

}  // namespace volto::tracker
