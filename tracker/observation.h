// From a LandmarkFrame to the points that the fit works on: camera, missing points, scale of 3D input. Internal to the
// tracker.
#pragma once

#include "frames/landmark_frame.h"
#include "tracker/frame_fit.h"

namespace volto::tracker {

struct ObserverOptions {
  bool use_3d = true;
  double focal_length_px = 0;  // 0: as the input says, else guessed
};

// One per stream: the guesses are made on the first face and kept.
class Observer {
 public:
  Observer(const MeasuredPoints& points, const Eigen::VectorXd& mean_face, const ObserverOptions& options);

  // False when the frame shows no face, has arrays of the wrong length, or more than a quarter of its points are not
  // finite or not believed by the detector. A single bad point is marked missing. Allocates nothing.
  bool read(const LandmarkFrame& frame, Observation& out);

  // Size of this face relative to the mean face: 1 for 2D input, where size and distance cannot be told apart.
  double scale() const { return scale_; }
  // The size is known, from the actor's neutral. 3D input that is far from it overrules it.
  void expectScale(double scale);
  double focalLength_px() const { return focal_px_; }

 private:
  void chooseCamera(const LandmarkFrame& frame);
  bool read3d(const LandmarkFrame& frame, Observation& out);
  bool read2d(const LandmarkFrame& frame, Observation& out) const;

  MeasuredPoints points_;
  Eigen::VectorXd mean_face_;
  ObserverOptions options_;
  bool camera_known_ = false;
  double focal_px_ = 0, centre_x_px_ = 0, centre_y_px_ = 0;
  double scale_ = 1;
  bool scale_known_ = false, scale_checked_ = false;
};

// Observations with room for that many points.
Observation makeObservation(int points);

}  // namespace volto::tracker
