// Which of the 52 shapes the measured points can show at all. Internal to the tracker.
#pragma once

#include "frames/arkit_blendshapes.h"
#include "tracker/expression_prior.h"
#include "tracker/face_model.h"

namespace volto::tracker {

// For each shape: the share of its usual variance that one frame of a face looking into the camera takes away, head pose and all other
// shapes being unknown too. 0: the points say nothing about it, 1: they say all.
ShapeVector observability(const MeasuredPoints& points, const rig::ExpressionTable& table, const ExpressionPrior& expression,
                          const Settings& settings);

// Shapes that are reported. Not among them: a shape with an observability under kLeastObservability, and one whose points would move
// with it only because muscles go together: eyeLookIn and eyeLookOut turn the eyeball, which no point of the mask lies on.
inline constexpr double kLeastObservability = 0.25;
ArkitObserved observableShapes(const MeasuredPoints& points, const rig::ExpressionTable& table, const ExpressionPrior& expression,
                               const Settings& settings);

}  // namespace volto::tracker
