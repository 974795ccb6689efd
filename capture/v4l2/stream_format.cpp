#include "capture/v4l2/stream_format.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <linux/videodev2.h>

#include "capture/image_source.h"

namespace volto::capture::v4l2 {

namespace {

constexpr int kUsualWidth = 640, kUsualHeight = 480;
constexpr double kUsualRate = 30.0;

bool codingOf(std::uint32_t code, Coding& coding) {
  switch (code) {
    case V4L2_PIX_FMT_MJPEG:
    case V4L2_PIX_FMT_JPEG:
      coding = Coding::mjpg;
      return true;
    case V4L2_PIX_FMT_YUYV:
      coding = Coding::yuyv;
      return true;
    case V4L2_PIX_FMT_NV12:
      coding = Coding::nv12;
      return true;
    case V4L2_PIX_FMT_GREY:
      coding = Coding::grey;
      return true;
    default:
      return false;
  }
}

std::string nameOf(Coding coding) {
  switch (coding) {
    case Coding::mjpg:
      return "MJPG";
    case Coding::yuyv:
      return "YUYV";
    case Coding::nv12:
      return "NV12";
    case Coding::grey:
      return "GREY";
  }
  return {};
}

std::string listOffered(const std::vector<PixelFormat>& offered) {
  std::string names;
  for (const PixelFormat& format : offered) names += (names.empty() ? "" : ", ") + format.fourcc;
  return names.empty() ? "nothing" : names;
}

// 0: exactly that size; grows with every doubling of the area and with a different shape.
double sizeCost(int width, int height, int wanted_width, int wanted_height) {
  const double area =
      std::abs(std::log2(static_cast<double>(width) * height / (static_cast<double>(wanted_width) * wanted_height)));
  const double shape =
      std::abs(std::log2(static_cast<double>(width) * wanted_height / (static_cast<double>(height) * wanted_width)));
  return area + shape;
}

// The nearest rate that is not faster than wanted, else the slowest there is; `wanted` where the driver does not say.
double nearestRate(const std::vector<double>& rates, double wanted) {
  if (rates.empty()) return wanted;
  constexpr double kSame = 1.001;  // 30000/1001 is 30
  for (const double rate : rates) {
    if (rate <= wanted * kSame) return rate;
  }
  return rates.back();
}

double codingCost(Coding coding) {
  switch (coding) {
    case Coding::yuyv:
      return 0.00;
    case Coding::nv12:
      return 0.01;
    case Coding::mjpg:
      return 0.02;
    case Coding::grey:
      return 0.05;  // a face has colours
  }
  return 1.0;
}

YuvMatrix matrixOf(const v4l2_pix_format& pix) {
  const std::uint32_t encoding = pix.ycbcr_enc != V4L2_YCBCR_ENC_DEFAULT
                                     ? pix.ycbcr_enc
                                     : static_cast<std::uint32_t>(V4L2_MAP_YCBCR_ENC_DEFAULT(pix.colorspace));
  const std::uint32_t range =
      pix.quantization != V4L2_QUANTIZATION_DEFAULT
          ? pix.quantization
          : static_cast<std::uint32_t>(V4L2_MAP_QUANTIZATION_DEFAULT(false, pix.colorspace, encoding));
  const bool bt709 = encoding == V4L2_YCBCR_ENC_709 || encoding == V4L2_YCBCR_ENC_XV709;
  if (range == V4L2_QUANTIZATION_FULL_RANGE) return bt709 ? kBt709Full : kBt601Full;
  return bt709 ? kBt709Limited : kBt601Limited;
}

double agreeOnRate(const Handle& handle, double wanted_hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  // Thousandths: 29.97 is asked for as 1000/29970.
  parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(wanted_hz * 1000.0))};
  if (handle.ioctl(VIDIOC_S_PARM, &parameters) != 0) {
    parameters = {};
    parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (handle.ioctl(VIDIOC_G_PARM, &parameters) != 0) return 0.0;
  }
  const v4l2_fract& interval = parameters.parm.capture.timeperframe;
  if (interval.numerator == 0 || interval.denominator == 0) return 0.0;
  return static_cast<double>(interval.denominator) / interval.numerator;
}

}  // namespace

bool isReadable(std::uint32_t code) {
  Coding coding{};
  return codingOf(code, coding);
}

FormatWish chooseFormat(const std::vector<PixelFormat>& offered, const CameraOptions& options, const std::string& path,
                        bool mjpg_only) {
  // Half a size is a size with the other half at the usual shape.
  int width = options.width, height = options.height;
  if (width <= 0) width = height > 0 ? height * kUsualWidth / kUsualHeight : kUsualWidth;
  if (height <= 0) height = options.width > 0 ? width * kUsualHeight / kUsualWidth : kUsualHeight;
  const double rate = options.rate_hz > 0 ? options.rate_hz : kUsualRate;

  FormatWish best;
  double best_cost = std::numeric_limits<double>::infinity();
  bool any_readable = false;
  for (const PixelFormat& format : offered) {
    Coding coding{};
    if (!codingOf(format.code, coding)) continue;
    any_readable = true;
    if (mjpg_only && coding != Coding::mjpg) continue;
    if (!options.format.empty() && options.format != nameOf(coding)) continue;
    const auto consider = [&](int w, int h, const std::vector<double>& rates) {
      const double nearest = nearestRate(rates, rate);
      const double slow = std::max(0.0, 1.0 - nearest / rate);
      const double cost = 10.0 * sizeCost(w, h, width, height) + slow + 0.1 * codingCost(coding);
      // A driver that has half the rate at the wanted size still beats one of another size; asking for the rate decides
      // among formats.
      if (cost < best_cost) {
        best_cost = cost;
        best = {format.code, w, h, nearest};
      }
    };
    if (format.sizes.empty()) consider(width, height, {});
    for (const FrameSize& size : format.sizes) consider(size.width, size.height, size.rates_hz);
  }
  if (best.code == 0) {
    if (!any_readable || options.format.empty())
      throw DeviceError(path + " offers " + listOffered(offered) +
                        ", and Volto reads MJPG, YUYV, NV12 and GREY; use another camera");
    throw DeviceError(path + " has no " + options.format + "; it offers " + listOffered(offered));
  }
  return best;
}

StreamFormat agreeOnFormat(const Handle& handle, const FormatWish& wish, const std::string& path) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(wish.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(wish.height);
  format.fmt.pix.pixelformat = wish.code;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int error = handle.ioctl(VIDIOC_S_FMT, &format); error != 0) {
    if (error == -EBUSY) throw DeviceError(path + " is " + describeUse(handle.system(), path) + "; close that first");
    if (error == -ENODEV) throw DeviceError(path + ": the device behind it is gone; plug it in again");
    throw DeviceError(path + " refuses " + fourccName(wish.code) + " " + std::to_string(wish.width) + "x" +
                      std::to_string(wish.height) + ": " + std::strerror(-error) +
                      "; see volto cameras for what it has");
  }

  const v4l2_pix_format& pix = format.fmt.pix;
  StreamFormat out;
  out.code = pix.pixelformat;
  const std::string answer =
      fourccName(pix.pixelformat) + " " + std::to_string(pix.width) + "x" + std::to_string(pix.height);
  if (!codingOf(pix.pixelformat, out.coding))
    throw DeviceError(path + " answers " + answer + ", and Volto reads MJPG, YUYV, NV12 and GREY; use another camera");
  if (pix.width < 1 || pix.height < 1 || pix.width > kMaxImageSide || pix.height > kMaxImageSide)
    throw DeviceError(path + " answers " + answer + ", which is no size of a picture; use another camera");
  if (pix.field == V4L2_FIELD_TOP || pix.field == V4L2_FIELD_BOTTOM || pix.field == V4L2_FIELD_ALTERNATE)
    throw DeviceError(path + " sends half pictures (interlaced fields); use another camera");
  out.fourcc = nameOf(out.coding);
  out.width = static_cast<int>(pix.width);
  out.height = static_cast<int>(pix.height);
  out.matrix = matrixOf(pix);

  const std::size_t width = pix.width;
  const std::size_t least_stride = out.coding == Coding::yuyv ? (width + 1) / 2 * 4 : width;
  if (out.coding == Coding::mjpg) {
    out.least_bytes = 1;
  } else {
    // Old drivers leave it empty.
    out.stride = pix.bytesperline == 0 ? least_stride : pix.bytesperline;
    if (out.stride < least_stride || out.stride > 16 * least_stride + 65536)
      throw DeviceError(path + " answers rows of " + std::to_string(out.stride) + " bytes for " + answer +
                        ", which cannot be; use another camera");
    out.least_bytes = out.coding == Coding::yuyv   ? yuyvBytes(out.width, out.height, out.stride)
                      : out.coding == Coding::nv12 ? nv12Bytes(out.width, out.height, out.stride)
                                                   : greyBytes(out.width, out.height, out.stride);
  }
  out.rate_hz = agreeOnRate(handle, wish.rate_hz);
  return out;
}

}  // namespace volto::capture::v4l2
