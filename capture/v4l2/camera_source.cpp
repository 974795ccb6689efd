#include "capture/v4l2/camera_source.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "capture/v4l2/buffer_queue.h"
#include "capture/v4l2/discovery.h"
#include "capture/v4l2/frame_clock.h"
#include "capture/v4l2/mjpeg_decoder.h"
#include "capture/v4l2/stream_format.h"
#include "capture/v4l2/system.h"

namespace volto::capture {

namespace v4l2 {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1000 * kMs;
// Nothing for so long, or for five pictures' time, is a stall; for so long, a reason to start the stream again.
constexpr std::int64_t kStallNs = 500 * kMs;
constexpr int kStallPeriods = 5;
constexpr std::int64_t kRestartNs = 2 * kSecond;
// More restarts than these in that time: the device is opened again.
constexpr int kRestarts = 3;
constexpr std::int64_t kRestartWindowNs = 10 * kSecond;
constexpr int kCorruptInARow = 30;
constexpr std::int64_t kFirstRetryNs = 250 * kMs;
constexpr std::int64_t kLastRetryNs = 5 * kSecond;
// While the camera is absent, its folder is looked at this often even if no event comes (containers, other /dev).
constexpr std::int64_t kLookNs = 500 * kMs;
// A camera that gives less of the agreed rate than this does so on purpose.
constexpr double kSlowShare = 0.8;
// No driver has more buffers than this ready at once; a device that always has one more does not keep us.
constexpr int kMostDrained = 64;
constexpr int kSpuriousWakeups = 10;
constexpr std::size_t kLongestWhy = 200;

class CameraSource final : public ImageSource {
 public:
  CameraSource(const CameraOptions& options, std::unique_ptr<System> own, System& system)
      : options_(options), own_system_(std::move(own)), system_(system), last_look_ns_(system.nowNs()) {
    notice_.reserve(512);
    corrupt_why_.reserve(kLongestWhy);
    try {
      open();
    } catch (const DeviceError& error) {
      closeDevice();
      if (!options_.wait_for_camera) throw;
      retryLater(error.what());
    }
  }
  ~CameraSource() override { closeDevice(); }

  Next next(Image& out, std::chrono::nanoseconds timeout) override;
  SourceState state() const override { return state_; }
  const SourceCounters& counters() const override { return counters_; }
  const SourceInfo& info() const override { return info_; }
  const std::string& notice() const override { return notice_; }

 private:
  // Opening, closing, trying again.
  void open();
  void openOn(FoundCamera found);
  void startStream(const std::vector<PixelFormat>& offered);
  void closeDevice();
  void lose(const std::string& why);
  void retryLater(const std::string& why);
  void restart(const std::string& why);
  void tryAgain();
  void waitForDevice(std::int64_t until_ns);

  // Pictures.
  bool takeNewest(Image& out);
  void fail(int error);
  bool decode(const Dequeued& buffer, Image& out);
  void countCorrupt(std::string_view why);
  void watch(std::int64_t now_ns);
  void waitForPicture(std::int64_t until_ns);
  void pictureArrived();
  std::int64_t stallAfterNs() const;
  void noteRate();

  CameraOptions options_;
  std::unique_ptr<System> own_system_;
  System& system_;

  std::optional<Identity> identity_;  // once it has been open
  std::string path_;
  Handle handle_;
  BufferQueue queue_;  // after handle_: it is stopped first
  StreamFormat format_;
  MjpegDecoder mjpeg_;
  FrameClock clock_;

  SourceState state_ = SourceState::no_signal;
  SourceCounters counters_;
  SourceInfo info_;
  std::string notice_;
  bool slow_noted_ = false;
  bool lost_before_ = false;

  std::int64_t last_look_ns_ = 0;     // when next() was last called
  std::int64_t last_arrival_ns_ = 0;  // of any buffer, or the start of the stream
  int corrupt_in_a_row_ = 0;
  std::string corrupt_why_;
  int spurious_ = 0;  // wake-ups without a buffer
  int errors_ = 0;    // of poll, without one of DQBUF
  int pending_error_ = 0;
  std::array<std::int64_t, kRestarts> restarts_ns_{};
  int restart_count_ = 0;

  std::vector<VideoNode> absent_nodes_;  // what was there when it was last tried
  bool absent_ = false;                  // the camera was not among them; else it was there and could not be used
  std::int64_t retry_at_ns_ = 0;
  std::int64_t next_look_ns_ = 0;
  std::int64_t backoff_ns_ = kFirstRetryNs;
  std::uint32_t jitter_ = 1;
};

void CameraSource::open() {
  absent_ = false;
  absent_nodes_ = system_.listNodes();
  if (!identity_) {
    openOn(findCamera(system_, options_.camera));
    return;
  }
  std::optional<FoundCamera> found = findAgain(system_, *identity_);
  if (!found) {
    absent_ = true;
    throw DeviceError(info_.name + " is gone; waiting for it to come back");
  }
  openOn(std::move(*found));
}

void CameraSource::openOn(FoundCamera found) {
  path_ = found.node.path;
  handle_ = std::move(found.handle);
  const std::vector<PixelFormat> offered = enumerateFormats(handle_);
  format_ = agreeOnFormat(handle_, chooseFormat(offered, options_, path_), path_);
  try {
    setControls(handle_, path_, options_.controls);
  } catch (const DeviceError&) {
    if (!identity_) throw;  // at the start somebody is there to read it
  }
  startStream(offered);
  // From here on it is ours, and is looked for when it goes.
  identity_ = found.identity;
  info_.name = found.identity.card;
  info_.location = path_;
  info_.format = format_.fourcc;
  info_.width = format_.width;
  info_.height = format_.height;
  info_.rate_hz = format_.rate_hz;
  info_.delivered_hz = 0;
  notice_.clear();
}

void CameraSource::startStream(const std::vector<PixelFormat>& offered) {
  int error = queue_.start(handle_);
  if (error == -ENOSPC && options_.format.empty() && format_.coding != Coding::mjpg) {
    // The USB bus has no room for raw pictures: compressed ones, if it has them.
    try {
      format_ = agreeOnFormat(handle_, chooseFormat(offered, options_, path_, true), path_);
      error = queue_.start(handle_);
    } catch (const DeviceError&) {
      // said below
    }
  }
  if (error == -EBUSY) throw DeviceError(path_ + " is " + describeUse(system_, path_) + "; close that first");
  if (error == -ENODEV) throw DeviceError(path_ + ": the device behind it is gone; plug it in again");
  if (error == -ENOSPC)
    throw DeviceError(path_ + ": the USB bus has no room for " + format_.fourcc + " " + std::to_string(format_.width) +
                      "x" + std::to_string(format_.height) + "; use MJPG, a smaller size or another port");
  if (error != 0) throw DeviceError(path_ + " " + queue_.problem() + "; plug it in again or use another camera");
  clock_.startStream();
  last_arrival_ns_ = system_.nowNs();
  corrupt_in_a_row_ = spurious_ = errors_ = pending_error_ = 0;
}

void CameraSource::closeDevice() {
  queue_.stop();
  handle_.close();
}

// At once, so that the node's number is free when the camera comes back.
void CameraSource::lose(const std::string& why) {
  closeDevice();
  ++counters_.losses;
  lost_before_ = true;
  restart_count_ = 0;
  retryLater(why);
}

void CameraSource::retryLater(const std::string& why) {
  state_ = SourceState::no_signal;
  info_.delivered_hz = 0;
  slow_noted_ = false;
  notice_ = why;
  const std::int64_t now = system_.nowNs();
  // Up to a tenth more, so that many programs do not come back at the same moment.
  jitter_ = jitter_ * 1664525U + 1013904223U;
  retry_at_ns_ = now + backoff_ns_ + backoff_ns_ / 10 * (jitter_ >> 24) / 256;
  next_look_ns_ = now + kLookNs;
  backoff_ns_ = std::min(2 * backoff_ns_, kLastRetryNs);
}

void CameraSource::restart(const std::string& why) {
  const std::int64_t now = system_.nowNs();
  if (restart_count_ == kRestarts && now - restarts_ns_.front() < kRestartWindowNs) {
    lose(path_ + " " + why + "; opening it again");
    return;
  }
  if (restart_count_ == kRestarts) {
    std::rotate(restarts_ns_.begin(), restarts_ns_.begin() + 1, restarts_ns_.end());
    --restart_count_;
  }
  restarts_ns_[static_cast<std::size_t>(restart_count_++)] = now;
  ++counters_.restarts;
  notice_ = path_ + " " + why + "; starting its stream again";
  if (const int error = queue_.start(handle_); error != 0) {
    lose(path_ + (error == -ENODEV ? std::string(" is gone; waiting for it to come back") : " " + queue_.problem()));
    return;
  }
  clock_.startStream();
  last_arrival_ns_ = system_.nowNs();
  corrupt_in_a_row_ = spurious_ = errors_ = pending_error_ = 0;
}

void CameraSource::tryAgain() {
  try {
    open();
  } catch (const DeviceError& error) {
    closeDevice();
    retryLater(error.what());
  }
}

// Looks without opening anything as long as the same nodes are there as when the camera was not.
void CameraSource::waitForDevice(std::int64_t until_ns) {
  const std::int64_t now = system_.nowNs();
  const std::int64_t wait_ns = std::max<std::int64_t>(std::min({until_ns, retry_at_ns_, next_look_ns_}) - now, 0);
  pollfd watched{system_.watch(), POLLIN, 0};
  const int events = system_.poll(&watched, watched.fd >= 0 ? 1 : 0,
                                  static_cast<int>(std::min<std::int64_t>((wait_ns + kMs - 1) / kMs, 1000)));
  if (events > 0) {
    system_.clearWatch();
    // Something was plugged in, or made accessible.
    if (!absent_ || system_.listNodes() != absent_nodes_) {
      backoff_ns_ = kFirstRetryNs;
      retry_at_ns_ = 0;
    }
  } else if (system_.nowNs() >= next_look_ns_) {
    next_look_ns_ = system_.nowNs() + kLookNs;
    if (system_.listNodes() != absent_nodes_) retry_at_ns_ = 0;
  }
}

Next CameraSource::next(Image& out, std::chrono::nanoseconds timeout) {
  const SourceState before = state_;
  std::int64_t now = system_.nowNs();
  const std::int64_t longest = std::numeric_limits<std::int64_t>::max() / 2;
  const std::int64_t deadline = now + std::clamp<std::int64_t>(timeout.count(), 0, longest - now);
  for (;;) {
    if (!handle_.isOpen()) {
      if (now >= retry_at_ns_)
        tryAgain();
      else if (now < deadline)
        waitForDevice(deadline);
    } else {
      const bool got = takeNewest(out);
      last_look_ns_ = system_.nowNs();
      if (got) return Next::frame;
      if (handle_.isOpen()) watch(last_look_ns_);
      if (handle_.isOpen() && state_ == before && last_look_ns_ < deadline) waitForPicture(deadline);
    }
    if (state_ != before) return Next::nothing;
    now = system_.nowNs();
    if (now >= deadline && !(handle_.isOpen() && last_look_ns_ < deadline)) return Next::nothing;
  }
}

bool CameraSource::takeNewest(Image& out) {
  const std::int64_t waited_ns = system_.nowNs() - last_look_ns_;
  if (const int error = std::exchange(pending_error_, 0); error != 0) {
    fail(error);
    return false;
  }
  std::optional<Dequeued> newest;
  std::uint64_t newest_seq = 0;
  int error = 0;
  for (int i = 0; i < kMostDrained; ++i) {
    Dequeued buffer;
    error = queue_.dequeue(buffer);
    if (error != 0) break;
    spurious_ = errors_ = 0;
    last_arrival_ns_ = system_.nowNs();
    const std::uint64_t seq = clock_.countSequence(buffer, counters_);
    std::optional<std::uint32_t> back;
    if (buffer.damaged || buffer.bytes.size() < format_.least_bytes) {
      countCorrupt(buffer.damaged ? "the driver says they are damaged" : "they are too short");
      back = buffer.index;
    } else {
      if (newest) {
        back = newest->index;
        ++counters_.dropped;
      }
      newest = buffer;
      newest_seq = seq;
    }
    if (back) {
      error = queue_.queue(*back);
      if (error != 0) break;
    }
  }

  bool got = false;
  if (newest) {
    got = decode(*newest, out);
    if (got) {
      out.capture_seq = newest_seq;
      out.t_capture_ns = clock_.timeOf(*newest, newest_seq, system_.nowNs(), waited_ns, counters_);
      pictureArrived();
    }
    const int back = queue_.queue(newest->index);
    if (error == 0 || error == -EAGAIN) error = back != 0 ? back : error;
  }
  if (error == 0 || error == -EAGAIN) return got;
  if (got)
    pending_error_ = error;  // the picture is given first
  else
    fail(error);
  return got;
}

void CameraSource::fail(int error) {
  if (error == -ENODEV || error == -ENXIO || error == -EBADF)
    lose(info_.name + " is gone; waiting for it to come back");
  else
    restart(std::string("fails: ") + std::strerror(-error));
}

bool CameraSource::decode(const Dequeued& buffer, Image& out) {
  out.resize(format_.width, format_.height);
  switch (format_.coding) {
    case Coding::yuyv:
      yuyvToBgr(buffer.bytes, format_.width, format_.height, format_.stride, format_.matrix, out.bgr);
      return true;
    case Coding::nv12:
      nv12ToBgr(buffer.bytes, format_.width, format_.height, format_.stride, format_.matrix, out.bgr);
      return true;
    case Coding::grey:
      greyToBgr(buffer.bytes, format_.width, format_.height, format_.stride, out.bgr);
      return true;
    case Coding::mjpg:
      break;
  }
  const MjpegDecoder::Result result = mjpeg_.decode(buffer.bytes, format_.width, format_.height, out.bgr);
  if (result == MjpegDecoder::Result::corrupt) {
    countCorrupt(mjpeg_.problem());
    return false;
  }
  if (result == MjpegDecoder::Result::good_with_warnings) ++counters_.decode_warnings;
  return true;
}

void CameraSource::countCorrupt(std::string_view why) {
  ++counters_.corrupt;
  ++corrupt_in_a_row_;
  corrupt_why_.assign(why.substr(0, kLongestWhy));
}

void CameraSource::pictureArrived() {
  ++counters_.captured;
  if (state_ != SourceState::streaming) {
    state_ = SourceState::streaming;
    notice_.clear();
    if (lost_before_) ++counters_.reconnects;
    lost_before_ = false;
    backoff_ns_ = kFirstRetryNs;
  }
  corrupt_in_a_row_ = 0;
  noteRate();
}

void CameraSource::noteRate() {
  info_.delivered_hz = clock_.deliveredHz();
  const bool slow = info_.delivered_hz > 0 && info_.delivered_hz < kSlowShare * info_.rate_hz;
  if (slow == slow_noted_) return;
  slow_noted_ = slow;
  notice_.clear();
  if (!slow) return;
  char text[192];
  std::snprintf(text, sizeof(text),
                "camera delivers %.1f of %.1f fps: auto exposure in low light? Give it light, or set "
                "exposure_dynamic_framerate=0",
                info_.delivered_hz, info_.rate_hz);
  notice_ = text;
}

std::int64_t CameraSource::stallAfterNs() const {
  const double hz = info_.delivered_hz > 0 ? info_.delivered_hz : info_.rate_hz;
  return hz > 0 ? std::max(kStallNs, static_cast<std::int64_t>(kStallPeriods * 1e9 / hz)) : kStallNs;
}

void CameraSource::watch(std::int64_t now_ns) {
  if (corrupt_in_a_row_ >= kCorruptInARow) {
    state_ = SourceState::no_signal;
    restart("sends nothing but broken pictures (" + corrupt_why_ + ")");
    return;
  }
  const std::int64_t silent_ns = now_ns - last_arrival_ns_;
  if (state_ == SourceState::streaming && silent_ns >= stallAfterNs()) {
    state_ = SourceState::stalled;
    ++counters_.stalls;
    notice_ = path_ + " is there and sends nothing";
  }
  if (silent_ns >= std::max(kRestartNs, stallAfterNs())) restart("sends nothing");
}

void CameraSource::waitForPicture(std::int64_t until_ns) {
  const std::int64_t watchdog_ns =
      last_arrival_ns_ + (state_ == SourceState::streaming ? stallAfterNs() : std::max(kRestartNs, stallAfterNs()));
  const std::int64_t wait_ns = std::max<std::int64_t>(std::min(until_ns, watchdog_ns) - system_.nowNs(), 0);
  const auto wait_ms = static_cast<int>(std::min<std::int64_t>((wait_ns + kMs - 1) / kMs, 10'000));
  pollfd device{handle_.fd(), POLLIN, 0};
  const int events = system_.poll(&device, 1, wait_ms);
  if (events <= 0) return;  // timeout, or a signal
  if ((device.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
    // What it is, the next DQBUF says; where that says nothing, the stream is restarted.
    if (++errors_ > 1) {
      errors_ = 0;
      restart("reports an error");
    }
    return;
  }
  // Woken for nothing again and again: do not run in circles.
  if (++spurious_ > kSpuriousWakeups) system_.poll(nullptr, 0, 2);
}

}  // namespace
}  // namespace v4l2

std::unique_ptr<ImageSource> openCamera(const CameraOptions& options) {
  std::unique_ptr<v4l2::System> system = v4l2::makeRealSystem();
  v4l2::System& reference = *system;
  return std::make_unique<v4l2::CameraSource>(options, std::move(system), reference);
}

std::unique_ptr<ImageSource> openCamera(const CameraOptions& options, v4l2::System& system) {
  return std::make_unique<v4l2::CameraSource>(options, nullptr, system);
}

}  // namespace volto::capture
