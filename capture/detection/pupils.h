// Where the pupils are, by the look of the eye image: the iris is a dark disc of known size between the lids.
//
// A matched filter: for each place within the lids, how much darker a disc of the iris' size is than the ring around
// it, counted over what the lids leave open. The irises of all people are nearly the same size (11.7 mm across, give or
// take half a millimetre; MediaPipe Iris measures distance by it), the eye about 30 mm from corner to corner, so the
// disc's size needs no search.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "capture/image.h"
#include "frames/landmark_frame.h"

namespace volto::capture {

// Thread-bound; keeps its buffers. Allocates nothing after the first eye.
class PupilFinder {
 public:
  PupilFinder();

  // Fills frame.pupils from the lids of the frame's points. MediaPipe's irises are taken as they are; OpenSeeFace's 66
  // points have lids as iBUG's. Confidence: contrast of the iris, times how open the eye is.
  void find(const Image& image, LandmarkFrame& frame);

 private:
  Pupil findOne(const Image& image, std::span<const std::array<float, 2>> lids);

  std::vector<float> grey_;  // upright patch around one eye
  // What lies between the lids, and its brightness, summed along each row of the patch up to each pixel.
  std::vector<float> seen_, bright_;
  // Half the width of each row of the disc (the iris), and of the disc with the ring around it.
  std::vector<int> disc_, ring_;
  int disc_pixels_ = 0;
};

}  // namespace volto::capture
