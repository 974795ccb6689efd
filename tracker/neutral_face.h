// Between a NeutralFace and the deviation from the mean face that the fit works with. Internal to the tracker.
#pragma once

#include <span>

#include "tracker/expression_prior.h"
#include "tracker/face_model.h"
#include "tracker/settings.h"
#include "tracker/tracker.h"

namespace volto::tracker {

NeutralFace makeNeutralFace(const ShapePrior& shape, const MeasuredPoints& points, const Eigen::VectorXd& deviation,
                            double scale);

// The face turned, moved and scaled onto the mean face, less the mean face (3P), and its size relative to the mean
// face. Throws std::invalid_argument (Tracker::setNeutral).
struct Deviation {
  Eigen::VectorXd points;
  double scale;
};
Deviation deviationOf(const NeutralFace& face, const ShapePrior& shape, const MeasuredPoints& points);

// With settings and statistics of one's own, for measuring them.
NeutralFace neutralFromTake(std::span<const LandmarkFrame> take, const TrackerOptions& options,
                            const rig::ExpressionTable& table, const Settings& settings,
                            const ExpressionPrior& expression);

}  // namespace volto::tracker
