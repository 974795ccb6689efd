#include "tracker/lid_range.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>

namespace volto::tracker {
namespace {

// Shares of the open eye.
constexpr float kUsuallyClosed = 0.6F;                     // until blinks have shown more
constexpr float kWavers = 0.12F;                           // an open eye may narrow by so much and is open
constexpr float kBegins = 0.85F, kDeepEnough = 0.78F;      // a blink may have begun; it was one
constexpr float kLeastClosed = 0.05F, kMostClosed = 0.8F;  // of what can be learned
// Of the range: closer than this is closed, since a picture now and then misses the moment.
constexpr float kNearlyClosed = 0.1F;

constexpr double kLongest_s = 0.6;                // longer is a closed or a narrowed eye, not a blink
constexpr float kDown = 0.6F, kUp = 0.15F;        // share by which one blink moves the range; a weaker one counts less
constexpr double kSoon_s = 2;                     // at first everything is new
constexpr double kWidens_s = 4, kNarrows_s = 16;  // an eye that opens wider is believed sooner
constexpr float kNarrowest = 0.04F, kWidest = 0.25F;  // that an open eye can be

// Upper and lower lid, in pairs; outer corners of right and left eye. -1: none.
struct Lids {
  std::array<std::array<std::array<int, 2>, 3>, 2> pairs;  // right, left
  std::array<int, 2> outer;
  int count;
};

const Lids* lidsOf(LandmarkLayout layout) {
  static const Lids ibug{{{{{{37, 41}, {38, 40}, {-1, -1}}}, {{{43, 47}, {44, 46}, {-1, -1}}}}}, {36, 45}, 2};
  static const Lids mediapipe{
      {{{{{160, 144}, {159, 145}, {158, 153}}}, {{{387, 373}, {386, 374}, {385, 380}}}}}, {33, 263}, 3};
  switch (layout) {
    case LandmarkLayout::ibug68:
    case LandmarkLayout::openseeface66:
      return &ibug;
    case LandmarkLayout::mediapipe478:
      return &mediapipe;
  }
  return nullptr;
}

}  // namespace

std::optional<float> eyeOpening(const LandmarkFrame& frame, std::size_t eye, const Eigen::Matrix3d& head_rotation) {
  const Lids* lids = lidsOf(frame.layout);
  if (lids == nullptr || frame.points_px.size() != landmarkCount(frame.layout)) return std::nullopt;
  // What lies in the plane of the face, seen askew: lengths there from lengths in the image. The common scale does not
  // matter.
  const Eigen::Matrix2d view = head_rotation.topLeftCorner<2, 2>();
  constexpr double kMostAskew = 0.5;
  if (!(view.determinant() > kMostAskew)) return std::nullopt;
  const Eigen::Matrix2d front = view.inverse();
  const auto between = [&](int a, int b) {
    const auto &p = frame.points_px[static_cast<std::size_t>(a)], &q = frame.points_px[static_cast<std::size_t>(b)];
    return Eigen::Vector2d(front * Eigen::Vector2d(q[0] - p[0], p[1] - q[1]));
  };
  const double width = between(lids->outer[0], lids->outer[1]).norm();
  double height = 0;
  for (int i = 0; i < lids->count; ++i) {
    const auto& pair = lids->pairs[eye][static_cast<std::size_t>(i)];
    height -= between(pair[0], pair[1]).y() / lids->count;
  }
  const double opening = height / width;
  if (!std::isfinite(opening)) return std::nullopt;
  return static_cast<float>(std::clamp(opening, 0.0, 1.0));
}

void LidCalibration::start(const LidRange& range) {
  if (!(range.open > range.closed && range.closed >= 0)) return;
  *this = {};
  range_ = range;
  seen_s_ = kSoon_s;
}

float LidCalibration::push(float opening, double dt_s) {
  learn(opening, dt_s);
  const float closed = range_.closed + kNearlyClosed * (range_.open - range_.closed);
  const float open = std::max((1 - kWavers) * range_.open, closed + 1e-4F);
  last_ = std::clamp((open - opening) / (open - closed), 0.0F, 1.0F);
  return last_;
}

void LidCalibration::learn(float opening, double dt_s) {
  if (range_.open <= 0) {
    range_.open = std::clamp(opening, kNarrowest, kWidest);
    range_.closed = kUsuallyClosed * range_.open;
  }
  seen_s_ += dt_s;
  if (!closing_ && opening < kBegins * range_.open) {
    closing_ = true;
    lowest_ = opening;
    closed_s_ = 0;
  }
  if (closing_) {
    closed_s_ += dt_s;
    lowest_ = std::min(lowest_, opening);
    if (opening >= kBegins * range_.open) {
      closing_ = false;
      if (lowest_ < kDeepEnough * range_.open && closed_s_ < kLongest_s)
        range_.closed += (lowest_ < range_.closed ? kDown : kUp) * (lowest_ - range_.closed);
    } else if (closed_s_ < kLongest_s) {
      return;  // it does not say how open this eye is
    }
  }
  const double memory_s = opening > range_.open ? (seen_s_ < kSoon_s ? kWidens_s / 20 : kWidens_s) : kNarrows_s;
  const float before = range_.open;
  range_.open += static_cast<float>(1 - std::exp(-dt_s / memory_s)) * (opening - range_.open);
  range_.open = std::clamp(range_.open, kNarrowest, kWidest);
  range_.closed *= range_.open / before;
  range_.closed = std::clamp(range_.closed, kLeastClosed * range_.open, kMostClosed * range_.open);
}

}  // namespace volto::tracker
