#include "tools/picture/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <stdexcept>

#include "tools/picture/text.h"

namespace volto::picture {
namespace {

constexpr Colour kGround{17, 18, 21}, kPanel{25, 27, 31}, kGrid{52, 55, 62}, kText{200, 203, 210},
    kMarker{255, 255, 255};

// First and last landmark of each line of the 68-point annotation, and whether it is closed.
struct Line68 {
  std::size_t first, last;
  bool closed;
  Colour colour;
};
constexpr std::array<Line68, 9> kLines68{{{0, 16, false, {120, 130, 150}},
                                          {17, 21, false, {240, 190, 90}},
                                          {22, 26, false, {240, 190, 90}},
                                          {27, 30, false, {130, 210, 140}},
                                          {31, 35, false, {130, 210, 140}},
                                          {36, 41, true, {110, 190, 250}},
                                          {42, 47, true, {110, 190, 250}},
                                          {48, 59, true, {245, 120, 120}},
                                          {60, 67, true, {245, 150, 150}}}};

std::string numberText(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

// A step of 1, 2 or 5 times a power of ten that makes about `wanted` steps in `range`.
double niceStep(double range, double wanted) {
  const double raw = range / std::max(wanted, 1.0),
               power = std::pow(10.0, std::floor(std::log10(std::max(raw, 1e-12))));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw) return factor * power;
  }
  return 10.0 * power;
}

struct Frame {
  float left, top, right, bottom;
  double time0, time1;
  float low, high;
  float x(double t) const { return left + static_cast<float>((t - time0) / (time1 - time0)) * (right - left); }
  float y(float v) const { return bottom - (v - low) / (high - low) * (bottom - top); }
};

void check(const CurvePlot& plot) {
  for (const Curve& curve : plot.curves) {
    if (curve.values.size() != plot.time_s.size()) {
      throw std::invalid_argument("curve '" + curve.name + "' has " + std::to_string(curve.values.size()) +
                                  " values for " + std::to_string(plot.time_s.size()) + " times");
    }
  }
}

void fitAxes(const CurvePlot& plot, Frame& frame) {
  frame.time0 = plot.time_s.empty() ? 0.0 : plot.time_s.front();
  frame.time1 = plot.time_s.empty() ? 1.0 : plot.time_s.back();
  if (!(frame.time1 > frame.time0)) frame.time1 = frame.time0 + 1.0;
  frame.low = plot.low;
  frame.high = plot.high;
  if (!(frame.high > frame.low)) {
    frame.low = 1e30F, frame.high = -1e30F;
    for (const Curve& curve : plot.curves) {
      for (const float v : curve.values) {
        if (std::isfinite(v)) frame.low = std::min(frame.low, v), frame.high = std::max(frame.high, v);
      }
    }
    if (!(frame.high > frame.low)) frame.low = std::min(frame.low, 0.0F), frame.high = frame.low + 1.0F;
  }
}

void drawCurve(Picture& picture, const Curve& curve, const std::vector<double>& time_s, const Frame& frame,
               Colour colour, float thickness) {
  for (std::size_t i = 1; i < curve.values.size(); ++i) {
    const float a = curve.values[i - 1], b = curve.values[i];
    if (!std::isfinite(a) || !std::isfinite(b)) continue;
    drawLine(picture, frame.x(time_s[i - 1]), frame.y(std::clamp(a, frame.low, frame.high)), frame.x(time_s[i]),
             frame.y(std::clamp(b, frame.low, frame.high)), colour, thickness, 0.9F);
  }
}

void drawTimeAxis(Picture& picture, const Frame& frame, float label_y) {
  const double step = niceStep(frame.time1 - frame.time0, (frame.right - frame.left) / 90.0);
  for (double t = std::ceil(frame.time0 / step) * step; t <= frame.time1 + 1e-9; t += step) {
    const float x = frame.x(t);
    drawLine(picture, x, frame.top, x, frame.bottom, kGrid, 1.0F, 0.7F);
    drawText(picture, x, label_y, numberText(std::abs(t) < 1e-9 ? 0.0 : t) + " s", {7.0F, kText}, Align::centre);
  }
}

void drawMarker(Picture& picture, const CurvePlot& plot, const Frame& frame) {
  if (!plot.marker_s) return;
  const float x = frame.x(std::clamp(*plot.marker_s, frame.time0, frame.time1));
  drawLine(picture, x, frame.top, x, frame.bottom, kMarker, 1.5F, 0.85F);
}

Colour colourOf(const CurvePlot& plot, std::size_t i) {
  return plot.curves[i].colour.value_or(distinctColour(static_cast<int>(i)));
}

}  // namespace

ImageArea areaOf(std::span<const LandmarkFrame> frames) {
  ImageArea area{1e30F, 1e30F, -1e30F, -1e30F};
  for (const LandmarkFrame& frame : frames) {
    if (frame.image_width_px > 0 && frame.image_height_px > 0) {
      return {0.0F, 0.0F, static_cast<float>(frame.image_width_px), static_cast<float>(frame.image_height_px)};
    }
    if (!frame.face_present) continue;
    for (const auto& [x, y] : frame.points_px) {
      if (!std::isfinite(x) || !std::isfinite(y)) continue;
      area = {std::min(area.left, x), std::min(area.top, y), std::max(area.right, x), std::max(area.bottom, y)};
    }
  }
  if (area.left > area.right) return {};
  const float border = 0.08F * std::max({area.right - area.left, area.bottom - area.top, 1.0F});
  return {area.left - border, area.top - border, area.right + border, area.bottom + border};
}

Picture plotLandmarks(const LandmarkFrame& frame, int width_px, int height_px, const ImageArea& area) {
  Picture picture(width_px, height_px, kPanel);
  const float scale = std::min(static_cast<float>(width_px) / std::max(area.right - area.left, 1e-6F),
                               static_cast<float>(height_px) / std::max(area.bottom - area.top, 1e-6F));
  const float off_x = 0.5F * (static_cast<float>(width_px) - scale * (area.left + area.right));
  const float off_y = 0.5F * (static_cast<float>(height_px) - scale * (area.top + area.bottom));
  const auto at = [&](std::size_t i) {
    return std::array<float, 2>{off_x + scale * frame.points_px[i][0], off_y + scale * frame.points_px[i][1]};
  };
  if (!frame.face_present || frame.points_px.empty()) {
    drawText(picture, 0.5F * static_cast<float>(width_px), 0.5F * static_cast<float>(height_px), "no face",
             {10.0F, kText}, Align::centre);
    return picture;
  }
  const auto join = [&](std::size_t i, std::size_t j, Colour c) {
    const auto a = at(i), b = at(j);
    drawLine(picture, a[0], a[1], b[0], b[1], c, 1.4F, 0.9F);
  };
  std::vector<Colour> colours(frame.points_px.size(), Colour{230, 232, 236});
  if (frame.layout == LandmarkLayout::ibug68 && frame.points_px.size() == 68) {
    for (const Line68& line : kLines68) {
      for (std::size_t i = line.first; i < line.last; ++i) join(i, i + 1, line.colour);
      if (line.closed) join(line.last, line.first, line.colour);
    }
  }
  for (std::size_t i = 0; i < frame.points_px.size(); ++i) {
    const auto p = at(i);
    const float sure = i < frame.point_confidence.size() ? std::clamp(frame.point_confidence[i], 0.15F, 1.0F) : 1.0F;
    drawDisc(picture, p[0], p[1], frame.points_px.size() > 100 ? 1.0F : 1.8F, colours[i], sure);
  }
  return picture;
}

Picture plotCurves(const CurvePlot& plot, int width_px, int height_px) {
  check(plot);
  Picture picture(width_px, height_px, kGround);
  float legend = 0.0F;
  const TextStyle small{7.5F, kText};
  for (const Curve& curve : plot.curves) legend = std::max(legend, textWidth(curve.name, small) + 26.0F);
  Frame frame{40.0F,
              plot.title.empty() ? 12.0F : 28.0F,
              static_cast<float>(width_px) - legend - 12.0F,
              static_cast<float>(height_px) - 22.0F,
              0,
              1,
              0,
              1};
  frame.right = std::max(frame.right, frame.left + 10.0F);
  frame.bottom = std::max(frame.bottom, frame.top + 10.0F);
  fitAxes(plot, frame);
  fillRectangle(picture, static_cast<int>(frame.left), static_cast<int>(frame.top),
                static_cast<int>(frame.right - frame.left), static_cast<int>(frame.bottom - frame.top), kPanel);
  if (!plot.title.empty()) drawText(picture, frame.left, 18.0F, plot.title, {9.0F, {235, 236, 240}});
  drawTimeAxis(picture, frame, static_cast<float>(height_px) - 7.0F);
  const double step = niceStep(static_cast<double>(frame.high - frame.low), (frame.bottom - frame.top) / 40.0);
  for (double v = std::ceil(static_cast<double>(frame.low) / step) * step; v <= static_cast<double>(frame.high) + 1e-9;
       v += step) {
    const float y = frame.y(static_cast<float>(v));
    drawLine(picture, frame.left, y, frame.right, y, kGrid, 1.0F, 0.7F);
    drawText(picture, frame.left - 5.0F, y + 3.0F, numberText(std::abs(v) < 1e-9 ? 0.0 : v), {7.0F, kText},
             Align::right);
  }
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    drawCurve(picture, plot.curves[i], plot.time_s, frame, colourOf(plot, i), 1.5F);
    const float y = frame.top + 12.0F + 15.0F * static_cast<float>(i);
    drawLine(picture, frame.right + 8.0F, y - 3.0F, frame.right + 18.0F, y - 3.0F, colourOf(plot, i), 2.5F);
    drawText(picture, frame.right + 23.0F, y, plot.curves[i].name, small);
  }
  drawMarker(picture, plot, frame);
  return picture;
}

Picture plotStrips(const CurvePlot& plot, int width_px, int strip_px) {
  check(plot);
  const int top = plot.title.empty() ? 8 : 28, count = std::max<int>(1, static_cast<int>(plot.curves.size()));
  Picture picture(width_px, top + count * strip_px + 20, kGround);
  const TextStyle small{std::clamp(0.42F * static_cast<float>(strip_px), 5.0F, 9.0F), kText};
  float names = 0.0F;
  for (const Curve& curve : plot.curves) names = std::max(names, textWidth(curve.name, small) + 16.0F);
  Frame frame{names,
              static_cast<float>(top),
              static_cast<float>(width_px) - 10.0F,
              static_cast<float>(top + count * strip_px),
              0,
              1,
              0,
              1};
  frame.right = std::max(frame.right, frame.left + 10.0F);
  fitAxes(plot, frame);
  if (!plot.title.empty()) drawText(picture, 8.0F, 18.0F, plot.title, {9.0F, {235, 236, 240}});
  for (std::size_t i = 0; i < plot.curves.size(); i += 2) {
    fillRectangle(picture, static_cast<int>(frame.left), top + static_cast<int>(i) * strip_px,
                  static_cast<int>(frame.right - frame.left), strip_px, kPanel);
  }
  drawTimeAxis(picture, frame, static_cast<float>(picture.height) - 6.0F);
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    Frame strip = frame;
    strip.top = static_cast<float>(top + static_cast<int>(i) * strip_px) + 1.5F;
    strip.bottom = strip.top + static_cast<float>(strip_px) - 3.0F;
    drawCurve(picture, plot.curves[i], plot.time_s, strip, colourOf(plot, i), 1.3F);
    drawText(picture, frame.left - 8.0F, strip.bottom - 0.5F * (static_cast<float>(strip_px) - 3.0F - small.height_px),
             plot.curves[i].name, small, Align::right);
  }
  drawMarker(picture, plot, frame);
  return picture;
}

std::vector<std::size_t> liveliestCurves(std::span<const Curve> curves, std::size_t count) {
  std::vector<double> spread(curves.size(), 0.0);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    double n = 0, sum = 0, square = 0;
    for (const float v : curves[i].values) {
      if (!std::isfinite(v)) continue;
      n += 1, sum += static_cast<double>(v), square += static_cast<double>(v) * static_cast<double>(v);
    }
    if (n > 0) spread[i] = square / n - (sum / n) * (sum / n);
  }
  std::vector<std::size_t> order(curves.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return spread[a] > spread[b]; });
  order.resize(std::min(count, order.size()));
  return order;
}

}  // namespace volto::picture
