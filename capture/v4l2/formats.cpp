#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <linux/videodev2.h>

#include "capture/image.h"
#include "capture/v4l2/discovery.h"
#include "capture/v4l2/stream_format.h"

namespace volto::capture::v4l2 {

namespace {

// No driver has more of anything; one that goes on for ever is stopped.
constexpr std::uint32_t kMostEntries = 256;

// Of a driver that takes any size or rate in a range, those that people use.
constexpr std::array<std::pair<int, int>, 7> kUsualSizes{
    {{1920, 1080}, {1280, 720}, {1024, 768}, {800, 600}, {640, 480}, {640, 360}, {320, 240}}};
constexpr std::array<double, 6> kUsualRates{60, 50, 30, 25, 15, 10};

double rateOf(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0.0 : static_cast<double>(interval.denominator) / interval.numerator;
}

void addOnce(std::vector<double>& rates, double rate) {
  if (rate > 0 && std::find(rates.begin(), rates.end(), rate) == rates.end()) rates.push_back(rate);
}

std::vector<double> enumerateRates(const Handle& handle, std::uint32_t code, int width, int height) {
  std::vector<double> rates;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmivalenum entry{};
    entry.index = i;
    entry.pixel_format = code;
    entry.width = static_cast<std::uint32_t>(width);
    entry.height = static_cast<std::uint32_t>(height);
    if (handle.ioctl(VIDIOC_ENUM_FRAMEINTERVALS, &entry) != 0) break;
    if (entry.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      addOnce(rates, rateOf(entry.discrete));
      continue;
    }
    const double fastest = rateOf(entry.stepwise.min), slowest = rateOf(entry.stepwise.max);
    addOnce(rates, fastest);
    for (const double rate : kUsualRates) {
      if (rate < fastest && rate >= slowest) addOnce(rates, rate);
    }
    break;
  }
  std::sort(rates.begin(), rates.end(), std::greater<>());
  return rates;
}

std::vector<FrameSize> enumerateSizes(const Handle& handle, std::uint32_t code) {
  std::vector<FrameSize> sizes;
  const auto add = [&](std::uint32_t width, std::uint32_t height) {
    if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide) return;
    const FrameSize size{static_cast<int>(width), static_cast<int>(height), {}};
    const auto same = [&](const FrameSize& s) { return s.width == size.width && s.height == size.height; };
    if (std::none_of(sizes.begin(), sizes.end(), same)) sizes.push_back(size);
  };
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmsizeenum entry{};
    entry.index = i;
    entry.pixel_format = code;
    if (handle.ioctl(VIDIOC_ENUM_FRAMESIZES, &entry) != 0) break;
    if (entry.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      add(entry.discrete.width, entry.discrete.height);
      continue;
    }
    const v4l2_frmsize_stepwise& range = entry.stepwise;
    const auto fits = [](std::uint32_t value, std::uint32_t least, std::uint32_t most, std::uint32_t step) {
      return value >= least && value <= most && (step == 0 || (value - least) % step == 0);
    };
    add(range.max_width, range.max_height);
    for (const auto& [w, h] : kUsualSizes) {
      const auto width = static_cast<std::uint32_t>(w), height = static_cast<std::uint32_t>(h);
      if (fits(width, range.min_width, range.max_width, range.step_width) &&
          fits(height, range.min_height, range.max_height, range.step_height))
        add(width, height);
    }
    break;
  }
  for (FrameSize& size : sizes) size.rates_hz = enumerateRates(handle, code, size.width, size.height);
  std::sort(sizes.begin(), sizes.end(), [](const FrameSize& a, const FrameSize& b) {
    return a.width * a.height != b.width * b.height ? a.width * a.height > b.width * b.height : a.width > b.width;
  });
  return sizes;
}

}  // namespace

std::vector<PixelFormat> enumerateFormats(const Handle& handle) {
  std::vector<PixelFormat> formats;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_fmtdesc entry{};
    entry.index = i;
    entry.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (handle.ioctl(VIDIOC_ENUM_FMT, &entry) != 0) break;
    PixelFormat format;
    format.code = entry.pixelformat;
    format.fourcc = fourccName(entry.pixelformat);
    const auto* const text = reinterpret_cast<const char*>(entry.description);
    format.description.assign(text, strnlen(text, sizeof(entry.description)));
    format.readable = isReadable(entry.pixelformat);
    format.sizes = enumerateSizes(handle, entry.pixelformat);
    formats.push_back(std::move(format));
  }
  return formats;
}

}  // namespace volto::capture::v4l2
