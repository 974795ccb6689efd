// What the pipeline sees beside what it makes of it: the image with landmarks, pupils and the head's axes, and the
// avatar: in a window, as a file that is made anew again and again, and as a sheet of moments at the end.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "rig/rig.h"
#include "tools/picture/picture.h"
#include "tools/pipeline/live.h"

namespace volto::pipeline {

// The part of the image around the face (all of it without one), size_px square, with landmarks (lids, lips and brows
// joined), pupils, and the head's axes at the tip of the nose: red to the subject's left, green up, blue out of the
// face.
picture::Picture drawFace(const capture::Image* image, const LandmarkFrame& landmarks, const HeadPose& head,
                          int size_px);

struct PreviewOptions {
  std::filesystem::path live;   // a picture that is made anew again and again; empty: none
  std::filesystem::path sheet;  // moments spread over all that was seen, written by finish(); empty: none
  double interval_s = 0.5;      // of the live picture
  std::string window;           // title of a window that shows it; empty: none
  double window_interval_s = 0.1;
  std::size_t moments = 24;     // of the sheet
  int size_px = 256;
};

// look() is called from one thread and only copies now and then; a thread of its own draws. Memory is bounded.
class Preview {
 public:
  // Throws NoDisplay (preview_window.h).
  Preview(const rig::Rig& rig, const PreviewOptions& options);
  ~Preview();
  Preview(const Preview&) = delete;
  Preview& operator=(const Preview&) = delete;

  void look(const LiveFrame& frame);
  // Writes the sheet. Throws std::system_error.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::pipeline
