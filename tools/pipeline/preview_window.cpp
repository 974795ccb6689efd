#include "tools/pipeline/preview_window.h"

#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace volto::pipeline {
namespace {

// Where a colour's eight bits go in a pixel.
struct Channel {
  unsigned shift = 0;
  explicit Channel(unsigned long mask) : shift(static_cast<unsigned>(std::countr_zero(mask))) {}
  std::uint32_t operator()(std::uint8_t value) const { return static_cast<std::uint32_t>(value) << shift; }
};

bool hasEightBits(unsigned long mask) { return mask != 0 && (mask >> std::countr_zero(mask)) == 0xFF; }

// Xlib's own would print and end the process.
int passOver(Display*, XErrorEvent*) { return 0; }
int saySoLater(Display*) { return 0; }
void displayIsGone(Display*, void* gone) { *static_cast<bool*>(gone) = true; }

}  // namespace

struct PreviewWindow::State {
  Display* display = nullptr;
  Window window = 0;
  GC context = nullptr;
  Visual* visual = nullptr;
  int depth = 0;
  Atom closing = 0;
  bool gone = false;
  std::vector<std::uint32_t> pixels;

  ~State() {
    // On a display that is gone nothing can be given back; the process holds a closed socket and some memory more.
    if (display == nullptr || gone) return;
    if (context != nullptr) XFreeGC(display, context);
    if (window != 0) XDestroyWindow(display, window);
    XCloseDisplay(display);
  }
};

PreviewWindow::PreviewWindow(const std::string& title, int width, int height) : state_(std::make_unique<State>()) {
  State& s = *state_;
  XInitThreads();
  s.display = XOpenDisplay(nullptr);
  if (s.display == nullptr) {
    const char* const name = std::getenv("DISPLAY");
    throw NoDisplay(name == nullptr || *name == '\0' ? "no display to open a window on ($DISPLAY is not set)"
                                                     : "the display " + std::string(name) + " cannot be opened");
  }
  XSetErrorHandler(passOver);
  XSetIOErrorHandler(saySoLater);
  XSetIOErrorExitHandler(s.display, displayIsGone, &s.gone);
  const int screen = DefaultScreen(s.display);
  s.visual = DefaultVisual(s.display, screen);
  s.depth = DefaultDepth(s.display, screen);
  if (s.depth < 24 || !hasEightBits(s.visual->red_mask) || !hasEightBits(s.visual->green_mask) ||
      !hasEightBits(s.visual->blue_mask))
    throw NoDisplay("the display shows fewer than 8 bits of each colour");
  s.window = XCreateSimpleWindow(s.display, RootWindow(s.display, screen), 0, 0, static_cast<unsigned>(width),
                                 static_cast<unsigned>(height), 0, 0, BlackPixel(s.display, screen));
  XStoreName(s.display, s.window, title.c_str());
  s.closing = XInternAtom(s.display, "WM_DELETE_WINDOW", False);
  XSetWMProtocols(s.display, s.window, &s.closing, 1);
  s.context = XCreateGC(s.display, s.window, 0, nullptr);
  XMapWindow(s.display, s.window);
  XFlush(s.display);
}

PreviewWindow::~PreviewWindow() = default;

bool PreviewWindow::show(const picture::Picture& picture) {
  State& s = *state_;
  while (!s.gone && s.window != 0 && XPending(s.display) > 0) {
    XEvent event;
    XNextEvent(s.display, &event);
    if (event.type == ClientMessage && static_cast<Atom>(event.xclient.data.l[0]) == s.closing) {
      XDestroyWindow(s.display, s.window);
      XFlush(s.display);
      s.window = 0;
    }
  }
  if (s.gone || s.window == 0) return false;

  const Channel red(s.visual->red_mask), green(s.visual->green_mask), blue(s.visual->blue_mask);
  const std::size_t count = picture.rgb.size() / 3;
  s.pixels.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    s.pixels[i] = red(picture.rgb[3 * i]) | green(picture.rgb[3 * i + 1]) | blue(picture.rgb[3 * i + 2]);
  XImage image{};
  image.width = picture.width;
  image.height = picture.height;
  image.format = ZPixmap;
  image.data = reinterpret_cast<char*>(s.pixels.data());
  image.byte_order = std::endian::native == std::endian::little ? LSBFirst : MSBFirst;
  image.bitmap_bit_order = image.byte_order;
  image.bitmap_unit = image.bitmap_pad = image.bits_per_pixel = 32;
  image.depth = s.depth;
  image.bytes_per_line = 4 * picture.width;
  if (XInitImage(&image) == 0) return true;
  XPutImage(s.display, s.window, s.context, &image, 0, 0, 0, 0, static_cast<unsigned>(picture.width),
            static_cast<unsigned>(picture.height));
  XFlush(s.display);
  return !s.gone;
}

}  // namespace volto::pipeline
