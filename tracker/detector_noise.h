// What is different when landmarks come from a detector that looked at pixels: they shake more, and they are wrong in
// the same way for long. Internal to the tracker.
#pragma once

#include "tracker/face_model.h"
#include "tracker/settings.h"
#include "tracker/tracker.h"

namespace volto::tracker {

// The constants for a tracker with these options: Settings{} for measured landmarks. Found on the landmarks that PFLD
// gives of a talking face (tests/tracker/README.md).
Settings settingsFor(const TrackerOptions& options);

// The landmarks of a layout, each as far as it can be believed: a detector draws the outline where hair and background
// lead it, and the brows it guesses under a fringe.
MeasuredPoints measuredPoints(const LayoutTable& layout, const TrackerOptions& options);

}  // namespace volto::tracker
