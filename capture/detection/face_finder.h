// FaceFinder: from images to the landmarks of one face, kept through time. The detector searches the whole image only
// while there is no face, or when the one that is followed has become doubtful; else the crop comes from the landmarks
// of the frame before.
#pragma once

#include <cstdint>
#include <memory>

#include "capture/detection/face_detector.h"
#include "capture/detection/landmark_model.h"
#include "capture/face_choice.h"
#include "capture/image.h"
#include "frames/landmark_frame.h"

namespace volto::capture {

struct FaceFinderOptions {
  FaceChoice choice;
  float found_score = 0.6F;        // the detector must be this sure to begin with a face ...
  float kept_score = 0.3F;         // ... and this sure to stay with it (turned away, blurred)
  int check_every = 3;             // frames between two looks whether the followed thing is still a face; 0: never
  double search_interval_s = 0.1;  // without a face for longer than two seconds: time between two searches
  double remember_s = 2.0;         // a face that comes back near its old place within this time is the same one
  bool pupils = true;
};

struct FaceFinderCounters {
  std::uint64_t frames = 0, faces = 0;
  std::uint64_t searches = 0;                                     // of the whole image
  std::uint64_t checks = 0;                                       // of the face's surroundings, on a small picture
  std::uint64_t networks = 0;                                     // runs of the landmark model
  std::uint64_t doubts = 0;                                       // times that the followed face became doubtful
  std::uint64_t losses = 0;                                       // times that it was lost
  std::int64_t detector_ns = 0, landmarks_ns = 0, pupils_ns = 0;  // spent, in total
  std::int64_t networks_ns = 0;                                   // of that, in the networks themselves
};

// Thread-bound. Same images, same landmarks.
class FaceFinder {
 public:
  FaceFinder(FaceDetector detector, LandmarkModel model, const FaceFinderOptions& options);
  ~FaceFinder();
  FaceFinder(FaceFinder&&) noexcept;

  // One image in, one frame out, in order of time; face_present false when there is none. Sets time, sequence number
  // and image size. Images may change their size. Throws InputError when a network fails.
  void push(const Image& image, LandmarkFrame& out);
  // Forgets the face: the next image is searched anew.
  void restart();

  const FaceFinderCounters& counters() const;
  LandmarkLayout layout() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::capture
