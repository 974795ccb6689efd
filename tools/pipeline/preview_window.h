// A window that shows a picture, by X11 itself: what Xlib needs is a few hundred kilobytes, where OpenCV's highgui
// would bring a desktop's worth of packages. Wayland's desktops show it through Xwayland.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "tools/picture/picture.h"

namespace volto::pipeline {

// There is no display, or one that cannot show colours. what() is one line.
struct NoDisplay : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Thread-bound, but for making it.
class PreviewWindow {
 public:
  // On the display that $DISPLAY names. Throws NoDisplay.
  PreviewWindow(const std::string& title, int width, int height);
  ~PreviewWindow();
  PreviewWindow(const PreviewWindow&) = delete;
  PreviewWindow& operator=(const PreviewWindow&) = delete;

  // Shows the picture in the window's upper left corner. False when the window has been closed or its display is gone:
  // it can show nothing any more, which is no error.
  bool show(const picture::Picture& picture);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::pipeline
