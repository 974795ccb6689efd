#include "tools/pipeline/frame_path.h"

#include <utility>

#include "tools/pipeline/pacer.h"

namespace volto::pipeline {

std::optional<tracker::NeutralFace> neutralOf(const Performance& performance, const tracker::TrackerOptions& options) {
  if (performance.landmarks.empty()) return std::nullopt;
  return tracker::neutralFromTake(performance.landmarks, options);
}

Tracking::Tracking(TrackingOptions options) : options_(std::move(options)), tracker_(makeTracker()) {}

tracker::Tracker Tracking::makeTracker() const {
  tracker::Tracker tracker(options_.tracker);
  if (options_.neutral) tracker.setNeutral(*options_.neutral);
  return tracker;
}

void Tracking::push(const Performance& performance, std::size_t frame, MaskFrame& out) {
  if (performance.landmarks.empty()) {
    out = performance.masks[frame];
  } else {
    push(performance.landmarks[frame], out);
  }
}

void Tracking::restart() { tracker_ = makeTracker(); }

FramePath::FramePath(const rig::Rig& rig, TrackingOptions tracking, const retarget::RetargetOptions& retarget)
    : tracking_(std::move(tracking)), retargeter_(rig, retarget) {
  for (const rig::Blendshape& shape : rig.blendshapes) arkit_index_.push_back(arkitBlendshapeIndex(shape.name));
}

void FramePath::push(const LandmarkFrame& in) {
  tracking_.push(in, mask_);
  retarget();
  translate();
}

void FramePath::push(const Performance& performance, std::size_t frame) {
  tracking_.push(performance, frame, mask_);
  retarget();
  if (performance.format == PerformanceFormat::live_link_csv) passWeightsOn();
  translate();
}

void FramePath::retarget() {
  tracked_at_ns_ = monotonicNow();
  retargeter_.push(mask_, avatar_);
  retargeted_at_ns_ = monotonicNow();
}

void FramePath::passWeightsOn() {
  for (std::size_t shape = 0; shape < avatar_.weights.size(); ++shape) {
    if (const auto index = arkit_index_[shape]) {
      avatar_.weights[shape] = mask_.arkit_weights[*index];
      avatar_.observed[shape] = mask_.arkit_observed[*index] ? 1 : 0;
    }
  }
}

void FramePath::translate() {
  if (!translation_) return;
  std::swap(avatar_.weights, untranslated_.weights);
  std::swap(avatar_.observed, untranslated_.observed);
  avatar_.weights.resize(translation_->to().shapes().size());
  avatar_.observed.resize(avatar_.weights.size());
  translation_->apply(untranslated_.weights, untranslated_.observed, avatar_.weights, avatar_.observed);
}

void FramePath::restart() {
  tracking_.restart();
  retargeter_.reset();
}

}  // namespace volto::pipeline
