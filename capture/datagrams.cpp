#include "capture/datagrams.h"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <optional>
#include <poll.h>
#include <stdexcept>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

namespace volto::capture {
namespace {

constexpr std::size_t kPoints = 66;
constexpr std::size_t kTime = 0, kFace = 8, kImageSize = 12, kRightOpen = 20, kConfidence = 73, kPositions = 345;
constexpr std::size_t kMaxDatagram = 65'536;
constexpr float kLargestSide = 65'535, kLargestPixel = 1e5F;
constexpr double kMostLag_s = 0.1;   // the sender's clock may put a frame at most so long before its arrival
constexpr double kSameFace_s = 1.0;  // a face id that was silent for longer is followed no more

static_assert(std::endian::native == std::endian::little, "records are little-endian");

template <typename T>
T read(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::int64_t monotonicNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

const char* readOpenSeeFace(std::span<const std::byte> record, LandmarkFrame& out, OpenSeeFaceRecord& about) {
  if (record.size() != kOpenSeeFaceRecordBytes) return "a record has 1785 bytes";
  about.time_s = read<double>(record, kTime);
  about.face = read<std::int32_t>(record, kFace);
  const auto width = read<float>(record, kImageSize), height = read<float>(record, kImageSize + 4);
  if (!(width >= 0 && width <= kLargestSide && height >= 0 && height <= kLargestSide))
    return "the image size is no number of pixels";
  out.layout = LandmarkLayout::openseeface66;
  out.image_width_px = static_cast<int>(width);
  out.image_height_px = static_cast<int>(height);
  out.focal_length_px = 0;
  out.points_camera_mm.clear();
  out.points_px.resize(kPoints);
  out.point_confidence.resize(kPoints);
  const auto point = [&](std::size_t i) {
    return std::array{read<float>(record, kPositions + 8 * i), read<float>(record, kPositions + 8 * i + 4)};
  };
  const auto confidence = [&](std::size_t i) { return read<float>(record, kConfidence + 4 * i); };
  double sum = 0;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const auto at = point(i);
    const float c = confidence(i);
    if (!(std::abs(at[0]) < kLargestPixel && std::abs(at[1]) < kLargestPixel)) return "a point is not finite";
    if (!std::isfinite(c)) return "a confidence is not finite";
    out.points_px[i] = at;
    out.point_confidence[i] = std::clamp(c, 0.0F, 1.0F);
    sum += out.point_confidence[i];
  }
  out.confidence = static_cast<float>(sum / static_cast<double>(kPoints));
  for (std::size_t eye = 0; eye < 2; ++eye) {
    const auto at = point(kPoints + eye);
    const float c = confidence(kPoints + eye), open = read<float>(record, kRightOpen + 4 * eye);
    const bool good = std::abs(at[0]) < kLargestPixel && std::abs(at[1]) < kLargestPixel && c > 0 && open > 0;
    out.pupils[eye] = good ? Pupil{at[0], at[1], std::min(c, 1.0F) * std::min(open, 1.0F)} : Pupil{};
  }
  out.face_present = true;
  return nullptr;
}

DatagramOptions parseDatagramAddress(const std::string& spec) {
  constexpr std::string_view kScheme = "udp://";
  DatagramOptions options;
  const auto fail = [&](const char* what) -> DatagramOptions {
    throw std::invalid_argument(spec + ": " + what + "; give udp://HOST:PORT, for instance udp://127.0.0.1:11573");
  };
  if (!spec.starts_with(kScheme)) return fail("does not begin with udp://");
  std::string rest = spec.substr(kScheme.size());
  if (rest.ends_with('/')) rest.pop_back();
  const std::size_t colon = rest.rfind(':');
  if (colon != std::string::npos) {
    const char* const end = rest.data() + rest.size();
    const auto result = std::from_chars(rest.data() + colon + 1, end, options.port);
    if (result.ec != std::errc() || result.ptr != end || options.port == 0)
      return fail("the port is no number from 1 to 65535");
    rest.resize(colon);
  }
  if (!rest.empty()) options.host = rest;
  return options;
}

struct LandmarkDatagrams::State {
  int socket = -1;
  std::uint16_t port = 0;
  FaceChoice choice;
  std::vector<std::byte> buffer = std::vector<std::byte>(kMaxDatagram);
  LandmarkFrame candidate, chosen;
  OpenSeeFaceRecord chosen_about;
  DatagramCounters counters;
  std::string notice;
  std::uint64_t seq = 0;
  std::optional<int> followed;
  std::int64_t followed_at_ns = 0;
  std::int64_t last_ns = 0;
  double last_sender_s = 0;

  ~State() {
    if (socket >= 0) ::close(socket);
  }

  // How well a face fits the choice; the highest is taken.
  double fitness(const LandmarkFrame& face, int id, std::int64_t now_ns) const {
    if (followed && *followed == id && static_cast<double>(now_ns - followed_at_ns) * 1e-9 < kSameFace_s) return 1e12;
    float left = 1e9F, right = -1e9F, top = 1e9F, bottom = -1e9F;
    for (const auto& p : face.points_px) {
      left = std::min(left, p[0]), right = std::max(right, p[0]);
      top = std::min(top, p[1]), bottom = std::max(bottom, p[1]);
    }
    if (choice.kind == FaceChoice::Kind::nearest_to) {
      return -std::hypot(0.5 * (left + right) - choice.x * static_cast<float>(face.image_width_px),
                         0.5 * (top + bottom) - choice.y * static_cast<float>(face.image_height_px));
    }
    return static_cast<double>(right - left) * static_cast<double>(bottom - top);
  }

  bool readDatagram(std::size_t size, std::int64_t now_ns) {
    ++counters.datagrams;
    if (size == 0 || size % kOpenSeeFaceRecordBytes != 0) {
      ++counters.wrong_size;
      notice = "a datagram of " + std::to_string(size) + " bytes is no OpenSeeFace record (1785 bytes a face)";
      return false;
    }
    bool any = false;
    double best = 0;
    for (std::size_t at = 0; at < size; at += kOpenSeeFaceRecordBytes) {
      OpenSeeFaceRecord about;
      const char* const problem =
          readOpenSeeFace(std::span(buffer).subspan(at, kOpenSeeFaceRecordBytes), candidate, about);
      if (problem != nullptr) {
        ++counters.refused;
        notice = std::string("an OpenSeeFace record was refused: ") + problem;
        continue;
      }
      double fit = fitness(candidate, about.face, now_ns);
      if (choice.kind == FaceChoice::Kind::number && fit < 1e12) {
        // OpenSeeFace numbers faces itself, from 0.
        fit = about.face == choice.number - 1 ? 1e11 : -1;
        if (fit < 0) continue;
      }
      if (any && fit <= best) continue;
      any = true;
      best = fit;
      std::swap(candidate, chosen);
      chosen_about = about;
    }
    if (any) {
      followed = chosen_about.face;
      followed_at_ns = now_ns;
      notice.clear();
    }
    return any;
  }

  std::int64_t timeOf(double sender_s, std::int64_t now_ns) {
    const double step_s = sender_s - last_sender_s;
    last_sender_s = sender_s;
    std::int64_t t = now_ns;
    if (last_ns > 0 && step_s > 1e-4 && step_s < 1) {
      t = std::clamp(last_ns + static_cast<std::int64_t>(step_s * 1e9),
                     now_ns - static_cast<std::int64_t>(kMostLag_s * 1e9), now_ns);
    }
    last_ns = std::max(t, last_ns + 1);
    return last_ns;
  }
};

LandmarkDatagrams::LandmarkDatagrams(const DatagramOptions& options) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.choice = options.choice;
  const std::string where = "udp://" + options.host + ":" + std::to_string(options.port);
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(options.host.c_str(), std::to_string(options.port).c_str(), &hints, &found);
      error != 0)
    throw DeviceError(where + ": no such address (" + ::gai_strerror(error) + "); give one of this machine");
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, &::freeaddrinfo);
  s.socket = ::socket(found->ai_family, found->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, found->ai_protocol);
  if (s.socket < 0 || ::bind(s.socket, found->ai_addr, found->ai_addrlen) != 0) {
    const int error = errno;
    throw DeviceError(where + ": cannot be listened at (" + std::strerror(error) + ")" +
                      (error == EADDRINUSE
                           ? "; another program receives OpenSeeFace there: close it or use another port"
                           : "; give an address of this machine"));
  }
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  ::getsockname(s.socket, reinterpret_cast<sockaddr*>(&bound), &size);
  s.port = ntohs(bound.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6*>(&bound)->sin6_port
                                             : reinterpret_cast<sockaddr_in*>(&bound)->sin_port);
}
LandmarkDatagrams::~LandmarkDatagrams() = default;

Next LandmarkDatagrams::next(LandmarkFrame& out, std::chrono::nanoseconds timeout) {
  State& s = *state_;
  const std::int64_t end_ns = monotonicNow() + timeout.count();
  bool have = false;
  for (;;) {
    const ssize_t size = ::recv(s.socket, s.buffer.data(), s.buffer.size(), 0);
    if (size < 0) {
      if (errno == EINTR) continue;
      if (have) break;
      const std::int64_t left_ns = end_ns - monotonicNow();
      if (left_ns <= 0) return Next::nothing;
      pollfd wait{s.socket, POLLIN, 0};
      const int woken = ::poll(&wait, 1, static_cast<int>((left_ns + 999'999) / 1'000'000));
      if (woken <= 0) return Next::nothing;  // a signal too: the caller looks whether to stop
      continue;
    }
    const std::int64_t now_ns = monotonicNow();
    if (!s.readDatagram(static_cast<std::size_t>(size), now_ns)) continue;
    if (have) ++s.counters.dropped;
    have = true;
    s.chosen.t_capture_ns = s.timeOf(s.chosen_about.time_s, now_ns);
    s.chosen.capture_seq = ++s.seq;
    std::swap(out, s.chosen);
  }
  ++s.counters.frames;
  return Next::frame;
}

std::uint16_t LandmarkDatagrams::port() const { return state_->port; }
const DatagramCounters& LandmarkDatagrams::counters() const { return state_->counters; }
const std::string& LandmarkDatagrams::notice() const { return state_->notice; }

}  // namespace volto::capture
