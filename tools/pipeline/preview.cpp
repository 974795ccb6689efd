#include "tools/pipeline/preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <Eigen/Geometry>

#include "capture/detection/crop.h"
#include "tools/picture/contact_sheet.h"
#include "tools/picture/head_renderer.h"
#include "tools/picture/png.h"
#include "tools/picture/rig_look.h"
#include "tools/picture/text.h"
#include "tools/pipeline/pacer.h"
#include "tools/pipeline/preview_window.h"
#include "tools/pipeline/slot.h"

namespace volto::pipeline {
namespace {

using namespace std::chrono_literals;

constexpr picture::Colour kPoint{120, 255, 90}, kPupil{255, 70, 70};
constexpr picture::Colour kLeftAxis{255, 80, 80}, kUpAxis{90, 230, 90}, kOutAxis{90, 150, 255};
constexpr double kFaceShare = 0.62;   // of the picture that the landmarks fill
constexpr float kAxisLength = 0.28F;  // of the picture

// First and last point of each line of iBUG's layout, and whether it is closed.
struct Stroke {
  int first, last;
  bool closed;
};
constexpr std::array<Stroke, 9> kStrokes = {{{0, 16, false},
                                             {17, 21, false},
                                             {22, 26, false},
                                             {27, 30, false},
                                             {31, 35, false},
                                             {36, 41, true},
                                             {42, 47, true},
                                             {48, 59, true},
                                             {60, 67, true}}};

struct Seen {
  capture::Image image;
  bool has_image = false;
  LandmarkFrame landmarks;
  std::int64_t t_ns = 0;
  HeadPose head;
  std::vector<std::array<float, 3>> vertices;
  bool tracked = false;
  float jaw_open = 0, blink_left = 0, blink_right = 0, smile = 0;
};

float weightOf(const MaskFrame& mask, const char* name) {
  const auto index = arkitBlendshapeIndex(name);
  return index ? mask.arkit_weights[*index] : 0.0F;
}

void copyInto(const LiveFrame& frame, std::int64_t t_ns, Seen& out) {
  out.has_image = frame.image != nullptr && frame.image->width > 0;
  if (out.has_image) out.image = *frame.image;
  out.landmarks = frame.landmarks;
  out.t_ns = t_ns;
  out.head = frame.mask.head;
  out.tracked = frame.mask.state == TrackingState::tracking;
  out.vertices = frame.avatar.vertices;
  out.jaw_open = weightOf(frame.mask, "jawOpen");
  out.blink_left = weightOf(frame.mask, "eyeBlinkLeft");
  out.blink_right = weightOf(frame.mask, "eyeBlinkRight");
  out.smile = 0.5F * (weightOf(frame.mask, "mouthSmileLeft") + weightOf(frame.mask, "mouthSmileRight"));
}

// The square of the image that is shown.
capture::ImageFromCrop viewOf(const capture::Image* image, const LandmarkFrame& landmarks, int size_px) {
  double x = 0.5 * landmarks.image_width_px, y = 0.5 * landmarks.image_height_px;
  double side = std::max(landmarks.image_width_px, landmarks.image_height_px);
  if (side <= 0 && image != nullptr) {
    x = 0.5 * image->width, y = 0.5 * image->height;
    side = std::max(image->width, image->height);
  }
  if (landmarks.face_present && !landmarks.points_px.empty()) {
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (const auto& p : landmarks.points_px) {
      left = std::min<double>(left, p[0]), right = std::max<double>(right, p[0]);
      top = std::min<double>(top, p[1]), bottom = std::max<double>(bottom, p[1]);
    }
    x = 0.5 * (left + right), y = 0.5 * (top + bottom);
    side = std::max({right - left, bottom - top, 8.0}) / kFaceShare;
  }
  capture::ImageFromCrop view;
  view.a = std::max(side, 1.0) / size_px;
  view.tx = x - 0.5 * side;
  view.ty = y - 0.5 * side;
  return view;
}

}  // namespace

picture::Picture drawFace(const capture::Image* image, const LandmarkFrame& landmarks, const HeadPose& head,
                          int size_px) {
  picture::Picture out(size_px, size_px, {24, 25, 28});
  const capture::ImageFromCrop view = viewOf(image, landmarks, size_px);
  const auto pixels = static_cast<std::size_t>(size_px) * static_cast<std::size_t>(size_px);
  if (image != nullptr && image->width > 0) {
    std::vector<float> planes(3 * pixels);
    capture::sampleCrop(*image, view, size_px, size_px, {.rgb = true}, true, planes);
    for (std::size_t i = 0; i < pixels; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        out.rgb[3 * i + c] = static_cast<std::uint8_t>(std::clamp(planes[c * pixels + i] + 0.5F, 0.0F, 255.0F));
  }
  if (!landmarks.face_present || landmarks.points_px.empty()) return out;
  const auto place = [&](const std::array<float, 2>& p) { return view.inverse(p[0], p[1]); };
  if (landmarks.layout == LandmarkLayout::ibug68) {
    for (const Stroke& stroke : kStrokes) {
      for (int i = stroke.first; i < stroke.last + (stroke.closed ? 1 : 0); ++i) {
        const auto a = place(landmarks.points_px[static_cast<std::size_t>(i)]);
        const auto b = place(landmarks.points_px[static_cast<std::size_t>(i == stroke.last ? stroke.first : i + 1)]);
        picture::drawLine(out, a[0], a[1], b[0], b[1], kPoint, 1.0F, 0.45F);
      }
    }
  }
  for (const auto& point : landmarks.points_px) {
    const auto at = place(point);
    picture::drawDisc(out, at[0], at[1], 1.5F, kPoint);
  }
  for (const Pupil& pupil : landmarks.pupils) {
    if (!(pupil.confidence > 0)) continue;
    const auto at = place({pupil.x_px, pupil.y_px});
    picture::drawDisc(out, at[0], at[1], 2.5F, kPupil, 0.4F + 0.6F * pupil.confidence);
  }
  if (head.observed) {
    const auto& q = head.rotation;
    const Eigen::Matrix3f r = Eigen::Quaternionf(q[3], q[0], q[1], q[2]).toRotationMatrix();
    const auto nose = place(capture::anchorsOf(landmarks.layout, landmarks.points_px)[2]);
    const float length = kAxisLength * static_cast<float>(size_px);
    const std::array<picture::Colour, 3> colours = {kLeftAxis, kUpAxis, kOutAxis};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      picture::drawLine(out, nose[0], nose[1], nose[0] + length * r(0, axis), nose[1] - length * r(1, axis),
                        colours[static_cast<std::size_t>(axis)], 2.0F);
    }
  }
  return out;
}

struct Preview::State {
  State(const rig::Rig& rig, const PreviewOptions& o) : options(o), renderer(rig.neutral, picture::lookOfRig(rig)) {
    view = picture::frontView(options.size_px);
    const auto row = [&](Eigen::Index i) {
      const Eigen::Vector3f r = rig.mesh_from_head.col(i).cast<float>();  // a row of the transpose
      return picture::Vec3{r.x(), r.y(), r.z()};
    };
    view.head_from_mesh = {row(0), row(1), row(2)};
    if (!options.window.empty()) window.emplace(options.window, 2 * options.size_px, options.size_px);
  }

  bool isLive() const { return !options.live.empty() || window; }
  std::int64_t interval() const {
    return static_cast<std::int64_t>((window ? options.window_interval_s : options.interval_s) * 1e9);
  }

  picture::Picture draw(const Seen& seen) {
    picture::Picture out(2 * options.size_px, options.size_px, {24, 25, 28});
    picture::paste(out, drawFace(seen.has_image ? &seen.image : nullptr, seen.landmarks, seen.head, options.size_px), 0,
                   0);
    if (!seen.vertices.empty()) {
      view.head_rotation = seen.head.rotation;
      picture::paste(out, renderer.render(seen.vertices, view).picture, options.size_px, 0);
    }
    return out;
  }

  void drawLive() {
    Seen seen;
    for (;;) {
      const auto taken = slot.take(seen, 200ms);
      if (taken == Slot<Seen>::Taken::closed) return;
      if (taken == Slot<Seen>::Taken::nothing) continue;
      const picture::Picture drawn = draw(seen);
      if (window && !window_closed) window_closed = !window->show(drawn);
      const std::int64_t now = monotonicNow();
      if (options.live.empty() || now < next_file_ns) continue;
      next_file_ns = now + static_cast<std::int64_t>(options.interval_s * 1e9);
      try {
        picture::writePng(options.live, drawn);
      } catch (const std::exception&) {  // a full disk must not stop the show; finish() tries again and tells
      }
    }
  }

  PreviewOptions options;
  picture::HeadRenderer renderer;
  picture::ViewOptions view;
  std::optional<PreviewWindow> window;
  // The drawing thread's own.
  bool window_closed = false;
  std::int64_t next_file_ns = 0;
  Slot<Seen> slot{SlotPolicy::newest_wins};
  std::thread thread;
  Seen next, last;
  std::int64_t next_live_ns = 0;
  std::int64_t first_ns = -1;
  // Moments of the sheet: when there is no more room every second one is forgotten and the spacing doubled.
  std::vector<Seen> moments;
  std::uint64_t frames = 0, spacing = 1;
};

Preview::Preview(const rig::Rig& rig, const PreviewOptions& options) : state_(std::make_unique<State>(rig, options)) {
  State& s = *state_;
  if (s.isLive()) s.thread = std::thread([&s] { s.drawLive(); });
}

Preview::~Preview() {
  State& s = *state_;
  s.slot.close();
  if (s.thread.joinable()) s.thread.join();
}

void Preview::look(const LiveFrame& frame) {
  State& s = *state_;
  if (s.first_ns < 0) s.first_ns = frame.t_source_ns;
  const std::int64_t t_ns = frame.t_source_ns - s.first_ns;
  if (s.isLive()) {
    if (const std::int64_t now = monotonicNow(); now >= s.next_live_ns) {
      s.next_live_ns = now + s.interval();
      copyInto(frame, t_ns, s.next);
      s.slot.put(s.next);
    }
  }
  if (!s.options.sheet.empty() && s.frames++ % s.spacing == 0) {
    if (s.moments.size() == 2 * s.options.moments) {
      for (std::size_t i = 1; i < s.options.moments; ++i) s.moments[i] = std::move(s.moments[2 * i]);
      s.moments.resize(s.options.moments);
      s.spacing *= 2;
    }
    copyInto(frame, t_ns, s.moments.emplace_back());
  }
}

void Preview::finish() {
  State& s = *state_;
  s.slot.close();
  if (s.thread.joinable()) s.thread.join();
  if (s.options.sheet.empty() || s.moments.empty()) return;
  std::vector<picture::Cell> cells;
  const std::size_t count = std::min(s.moments.size(), s.options.moments);
  for (std::size_t i = 0; i < count; ++i) {
    const Seen& seen = s.moments[i * s.moments.size() / count];
    char caption[96];
    std::snprintf(caption, sizeof caption, "%.2f s  jaw %.2f  blink %.2f %.2f  smile %.2f",
                  static_cast<double>(seen.t_ns) * 1e-9, static_cast<double>(seen.jaw_open),
                  static_cast<double>(seen.blink_right), static_cast<double>(seen.blink_left),
                  static_cast<double>(seen.smile));
    cells.push_back({s.draw(seen), !seen.landmarks.face_present ? "no face"
                                   : seen.tracked               ? caption
                                                                : "a face, not tracked"});
  }
  picture::writePng(s.options.sheet, picture::contactSheet(cells, std::min<std::size_t>(4, cells.size())));
}

}  // namespace volto::pipeline
