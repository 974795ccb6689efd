#include "capture/video/video_source.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/imgutils.h>
#include <libswscale/swscale.h>
}

#include "capture/errors.h"

namespace volto::capture {
namespace {

using Clock = std::chrono::steady_clock;

template <auto Free>
struct Freed {
  template <typename T>
  void operator()(T* object) const {
    Free(&object);
  }
};
using Format = std::unique_ptr<AVFormatContext, Freed<avformat_close_input>>;
using Codec = std::unique_ptr<AVCodecContext, Freed<avcodec_free_context>>;
using Packet = std::unique_ptr<AVPacket, Freed<av_packet_free>>;
using Frame = std::unique_ptr<AVFrame, Freed<av_frame_free>>;
struct FreeScaler {
  void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};

std::string reasonOf(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

// The folder as a pattern: all files of the kind that is most frequent in it.
std::filesystem::path patternOf(const std::filesystem::path& folder) {
  constexpr std::array<std::string_view, 8> kImages = {".png",  ".jpg", ".jpeg", ".bmp",
                                                       ".webp", ".tif", ".tiff", ".ppm"};
  std::array<std::size_t, kImages.size()> count{};
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto found = std::find(kImages.begin(), kImages.end(), entry.path().extension().string());
    if (found != kImages.end()) ++count[static_cast<std::size_t>(found - kImages.begin())];
  }
  const auto most = std::max_element(count.begin(), count.end());
  if (*most == 0)
    throw InputError(folder.string() + ": a folder without images (.png, .jpg, ...); give a video or images");
  std::string escaped;
  for (const char c : folder.string()) {
    if (std::string_view("*?[]{}\\%").find(c) != std::string_view::npos) escaped += '\\';
    escaped += c;
  }
  return escaped + "/*" + std::string(kImages[static_cast<std::size_t>(most - count.begin())]);
}

class VideoSource final : public ImageSource {
 public:
  VideoSource(const std::filesystem::path& path, const VideoOptions& options)
      : path_(path.string()), options_(options) {
    av_log_set_level(AV_LOG_QUIET);  // what goes wrong is told here
    open();
    info_.name = path.filename().string();
    info_.location = path_;
    packet_.reset(av_packet_alloc());
    frame_.reset(av_frame_alloc());
    if (!packet_ || !frame_) throw std::bad_alloc();
    // The first picture tells whether there is any.
    if (!decode(first_)) {
      throw InputError(path_ + ": holds no picture that can be decoded" +
                       (counters_.corrupt > 0 ? " (all are damaged)" : "") + "; is the file whole?");
    }
    info_.width = first_.width;
    info_.height = first_.height;
    have_first_ = true;
  }

  Next next(Image& out, std::chrono::nanoseconds timeout) override {
    if (state_ == SourceState::ended) return Next::ended;
    if (!options_.realtime) return take(out) ? given(out) : atEnd();
    const auto give_up = Clock::now() + timeout;
    if (!started_) {
      started_ = true;
      start_ = Clock::now();
    }
    // Of the pictures that are due the newest, or the first that is not too late; decoding goes on while they are.
    bool have = false;
    for (;;) {
      if (!have_ahead_) {
        if (!take(ahead_)) return have ? given(out) : atEnd();
        have_ahead_ = true;
      }
      const auto due = start_ + std::chrono::nanoseconds(ahead_.t_capture_ns);
      const auto now = Clock::now();
      if (due > now) {
        if (have) return given(out);
        if (due > give_up) {
          std::this_thread::sleep_until(give_up);
          return Next::nothing;
        }
        std::this_thread::sleep_until(due);
      }
      if (have) ++counters_.dropped;
      std::swap(out, ahead_);
      have_ahead_ = false;
      have = true;
      if (now - due <= options_.patience) return given(out);
    }
  }

  SourceState state() const override { return state_; }
  const SourceCounters& counters() const override { return counters_; }
  const SourceInfo& info() const override { return info_; }
  const std::string& notice() const override { return notice_; }

 private:
  void open() {
    struct Wishes {
      AVDictionary* all = nullptr;
      ~Wishes() { av_dict_free(&all); }
    } wishes;
    av_dict_set(&wishes.all, "protocol_whitelist", "file", 0);  // a playlist must not fetch anything
    std::string name = path_;
    std::error_code error;
    const bool folder = std::filesystem::is_directory(path_, error);
    const bool pattern = !folder && path_.find('%') != std::string::npos && !std::filesystem::exists(path_, error);
    if (folder) {
      name = patternOf(path_).string();
      av_dict_set(&wishes.all, "pattern_type", "glob", 0);
    }
    if (folder || pattern) {
      char rate[32];
      std::snprintf(rate, sizeof rate, "%.6g", options_.sequence_rate_hz);
      av_dict_set(&wishes.all, "framerate", rate, 0);
    } else {
      std::FILE* const file = std::fopen(path_.c_str(), "rb");
      if (file == nullptr) throw std::system_error(errno, std::generic_category(), path_);
      std::fclose(file);
    }
    const AVInputFormat* const images = folder || pattern ? av_find_input_format("image2") : nullptr;
    AVFormatContext* format = nullptr;
    if (!folder && !pattern) {
      name.insert(0, "file:");  // whatever it is called, it is a file
      refuseLists(name);
    }
    const int opened = avformat_open_input(&format, name.c_str(), images, &wishes.all);
    if (opened < 0) {
      throw InputError(path_ + ": is no video that can be read (" + reasonOf(opened) +
                       "); give a video, an animated GIF, an image or an image sequence (frames/%04d.png)");
    }
    format_.reset(format);
    if (const int found = avformat_find_stream_info(format, nullptr); found < 0)
      throw InputError(path_ + ": is damaged (" + reasonOf(found) + ")");
    const AVCodec* codec = nullptr;
    stream_ = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_ < 0 || codec == nullptr) {
      throw InputError(path_ + (stream_ == AVERROR_DECODER_NOT_FOUND
                                    ? ": its video is of a kind that FFmpeg here cannot decode; convert it to H.264"
                                    : ": holds no video stream (sound only?); give a file with pictures"));
    }
    const AVStream& stream = *format->streams[stream_];
    if (stream.codecpar->width > kMaxImageSide || stream.codecpar->height > kMaxImageSide)
      throw InputError(path_ + ": pictures larger than " + std::to_string(kMaxImageSide) + " pixels; scale it down");
    codec_.reset(avcodec_alloc_context3(codec));
    if (!codec_) throw std::bad_alloc();
    codec_->thread_count = 1;
    codec_->pkt_timebase = stream.time_base;
    codec_->max_pixels = static_cast<std::int64_t>(kMaxImageSide) * kMaxImageSide;
    if (avcodec_parameters_to_context(codec_.get(), stream.codecpar) < 0 ||
        avcodec_open2(codec_.get(), codec, nullptr) < 0)
      throw InputError(path_ + ": its video cannot be decoded (" + std::string(codec->name) + ")");
    for (unsigned i = 0; i < format->nb_streams; ++i)
      if (static_cast<int>(i) != stream_) format->streams[i]->discard = AVDISCARD_ALL;
    info_.format = codec->name;
    const AVRational rate = stream.avg_frame_rate.num > 0 ? stream.avg_frame_rate : stream.r_frame_rate;
    info_.rate_hz = rate.num > 0 && rate.den > 0 ? av_q2d(rate) : options_.sequence_rate_hz;
    step_ns_ = std::clamp<std::int64_t>(std::llround(1e9 / info_.rate_hz), 1'000'000, 10'000'000'000);
    announced_ = stream.nb_frames;
    turn_ = quarterTurns(stream);
  }

  // Playlists open other files, or ask for them again and again without end.
  void refuseLists(const std::string& url) const {
    AVIOContext* bytes = nullptr;
    if (avio_open2(&bytes, url.c_str(), AVIO_FLAG_READ, nullptr, nullptr) < 0) return;  // said where it is opened
    const AVInputFormat* kind = nullptr;
    const int probed = av_probe_input_buffer2(bytes, &kind, url.c_str(), nullptr, 0, 0);
    avio_closep(&bytes);
    if (probed < 0 || kind == nullptr) return;
    constexpr std::array<std::string_view, 7> kLists = {"hls", "dash", "webm_dash_manifest", "concat", "imf",
                                                        "sdp", "rtsp"};
    if (std::find(kLists.begin(), kLists.end(), kind->name) != kLists.end())
      throw InputError(path_ + ": is a list of other files (" + kind->name + "), not a video; give the video itself");
  }

  static int quarterTurns(const AVStream& stream) {
    const std::uint8_t* const matrix = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
    if (matrix == nullptr) return 0;
    const double degrees = av_display_rotation_get(reinterpret_cast<const std::int32_t*>(matrix));
    if (!std::isfinite(degrees)) return 0;
    return ((static_cast<int>(std::lround(-degrees / 90)) % 4) + 4) % 4;  // clockwise
  }

  // The next picture, from the one that was decoded when the file was opened on.
  bool take(Image& out) {
    if (have_first_) {
      have_first_ = false;
      std::swap(out, first_);
      return true;
    }
    return decode(out);
  }

  Next given(const Image& out) {
    state_ = SourceState::streaming;
    ++counters_.captured;
    info_.width = out.width;
    info_.height = out.height;
    return Next::frame;
  }

  Next atEnd() {
    state_ = SourceState::ended;
    // Some files announce a few more than they hold.
    const std::int64_t missing = announced_ - static_cast<std::int64_t>(seq_);
    if (announced_ > 0 && missing > 2 + announced_ / 100 && !options_.loop) {
      notice_ = path_ + ": ended after " + std::to_string(seq_) + " of " + std::to_string(announced_) +
                " pictures; the file is cut off or damaged";
    }
    return Next::ended;
  }

  bool decode(Image& out) {
    for (;;) {
      const int received = avcodec_receive_frame(codec_.get(), frame_.get());
      if (received == 0) {
        const bool good = convert(out);
        av_frame_unref(frame_.get());
        if (good) return true;
        ++counters_.corrupt;
        continue;
      }
      if (received == AVERROR_EOF) {
        if (!options_.loop || seq_ == 0 || !rewind()) return false;
        continue;
      }
      if (received != AVERROR(EAGAIN)) ++counters_.corrupt;
      if (!feed()) return false;
    }
  }

  // One more packet of the video into the decoder; at the end of the file it is told so.
  bool feed() {
    for (;;) {
      const int read = av_read_frame(format_.get(), packet_.get());
      if (read < 0) {
        if (flushed_) return false;
        flushed_ = true;
        return avcodec_send_packet(codec_.get(), nullptr) >= 0;
      }
      const bool ours = packet_->stream_index == stream_;
      int sent = 0;
      if (ours) sent = avcodec_send_packet(codec_.get(), packet_.get());
      av_packet_unref(packet_.get());
      if (!ours) continue;
      if (sent < 0 && sent != AVERROR(EAGAIN)) {
        ++counters_.corrupt;
        continue;
      }
      return true;
    }
  }

  bool rewind() {
    if (av_seek_frame(format_.get(), stream_, 0, AVSEEK_FLAG_BACKWARD) < 0) return false;
    avcodec_flush_buffers(codec_.get());
    flushed_ = false;
    round_start_ns_ = last_ns_ + step_ns_;
    round_first_pts_ = AV_NOPTS_VALUE;
    return true;
  }

  bool convert(Image& out) {
    const AVFrame& f = *frame_;
    if (f.width <= 0 || f.height <= 0 || f.width > kMaxImageSide || f.height > kMaxImageSide) return false;
    if ((f.flags & AV_FRAME_FLAG_CORRUPT) != 0) return false;
    scaler_.reset(sws_getCachedContext(scaler_.release(), f.width, f.height, static_cast<AVPixelFormat>(f.format),
                                       f.width, f.height, AV_PIX_FMT_BGR24, SWS_BILINEAR, nullptr, nullptr, nullptr));
    if (!scaler_) return false;
    Image& upright = turn_ == 0 ? out : lying_;
    upright.resize(f.width, f.height);
    // FFmpeg's converters write whole vectors, at the end of a row beyond it: after the last row into what is not ours.
    constexpr int kVector = 32;  // pixels
    const std::size_t row = 3 * static_cast<std::size_t>(f.width);
    const bool fits = f.width % kVector == 0;
    const std::size_t stride = fits ? row : 3 * static_cast<std::size_t>((f.width / kVector + 1) * kVector);
    if (!fits) padded_.resize(stride * static_cast<std::size_t>(f.height));
    std::uint8_t* const rows[4] = {fits ? upright.bgr.data() : padded_.data(), nullptr, nullptr, nullptr};
    const int strides[4] = {static_cast<int>(stride), 0, 0, 0};
    if (sws_scale(scaler_.get(), f.data, f.linesize, 0, f.height, rows, strides) != f.height) return false;
    for (std::size_t y = 0; !fits && y < static_cast<std::size_t>(f.height); ++y)
      std::copy_n(padded_.data() + y * stride, row, upright.bgr.data() + y * row);
    if (turn_ != 0) turnUpright(lying_, out);
    out.t_capture_ns = timeOf(f);
    out.capture_seq = ++seq_;
    return true;
  }

  void turnUpright(const Image& from, Image& out) const {
    const bool swaps = turn_ % 2 == 1;
    out.resize(swaps ? from.height : from.width, swaps ? from.width : from.height);
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        const int sx = turn_ == 1 ? y : turn_ == 2 ? from.width - 1 - x : from.width - 1 - y;
        const int sy = turn_ == 1 ? from.height - 1 - x : turn_ == 2 ? from.height - 1 - y : x;
        const auto at = [](const Image& image, int px, int py) {
          return 3 *
                 (static_cast<std::size_t>(py) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(px));
        };
        std::copy_n(from.bgr.data() + at(from, sx, sy), 3, out.bgr.data() + at(out, x, y));
      }
    }
  }

  // Always later than the one before, whatever the file says.
  std::int64_t timeOf(const AVFrame& f) {
    std::int64_t t = seq_ == 0 ? 0 : last_ns_ + step_ns_;
    if (f.best_effort_timestamp != AV_NOPTS_VALUE) {
      if (round_first_pts_ == AV_NOPTS_VALUE) round_first_pts_ = f.best_effort_timestamp;
      const AVRational base = format_->streams[stream_]->time_base;
      const std::int64_t said = round_start_ns_ + av_rescale_q(f.best_effort_timestamp - round_first_pts_, base,
                                                               AVRational{1, 1'000'000'000});
      if (seq_ == 0 || (said > last_ns_ && said - last_ns_ < 3600 * 1'000'000'000LL)) {
        t = said;
      } else {
        ++counters_.bad_timestamps;
      }
    }
    last_ns_ = t;
    return t;
  }

  std::string path_;
  VideoOptions options_;
  Format format_;
  Codec codec_;
  Packet packet_;
  Frame frame_;
  std::unique_ptr<SwsContext, FreeScaler> scaler_;
  int stream_ = -1;
  int turn_ = 0;  // quarter turns clockwise that make pictures upright
  std::int64_t announced_ = 0;
  std::int64_t step_ns_ = 40'000'000, last_ns_ = 0, round_start_ns_ = 0, round_first_pts_ = AV_NOPTS_VALUE;
  std::uint64_t seq_ = 0;
  bool flushed_ = false;

  std::vector<std::uint8_t> padded_;  // a picture whose rows have room after them
  Image first_, lying_, ahead_;
  bool have_first_ = false, have_ahead_ = false;
  bool started_ = false;
  Clock::time_point start_;

  SourceState state_ = SourceState::streaming;
  SourceCounters counters_;
  SourceInfo info_;
  std::string notice_;
};

}  // namespace

std::unique_ptr<ImageSource> openVideo(const std::filesystem::path& path, const VideoOptions& options) {
  return std::make_unique<VideoSource>(path, options);
}

}  // namespace volto::capture
