// Which of the 52 shapes the measured points can show at all. Internal to the tracker.
#pragma once

#include "frames/arkit_blendshapes.h"
#include "rig/expression_table.h"
#include "tracker/expression_prior.h"
#include "tracker/face_model.h"

namespace volto::tracker {

// For each shape: the share of its motion (squared millimetres on the mean face, all 84 points) that the measured
// points show to a camera in front of the face: their x and y, and z too `with_depth`.
ShapeVector visibleShare(const MeasuredPoints& points, const rig::ExpressionTable& table, bool with_depth);

// A shape of which less than this is seen is not reported. On the 68 points without depth the shares fall apart
// clearly: jawForward 0.03, cheekPuff 0.07, tongueOut 0, then mouthPucker 0.14 and up. eyeLookIn and eyeLookOut are not
// reported either, whatever their lids do: they turn the eyeball, and no point of the mask lies on it.
inline constexpr double kLeastVisibleShare = 0.1;
ArkitObserved observableShapes(const MeasuredPoints& points, const rig::ExpressionTable& table, bool with_depth);

}  // namespace volto::tracker
