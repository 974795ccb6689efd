// Asks a camera driver what the camera code relies on and prints its answers, one a line: the same lines from the
// kernel's own test driver (tests/guest) and from the fake (preloaded) say that the fake tells the truth.
//
//   v4l2_answers /dev/video0 [--disconnect]    with the driver's "Disconnect" button, which unplugs the camera
//   v4l2_answers /dev/video0 --press           presses that button and does nothing else
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <string>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

namespace {

int g_fd = -1;

int ask(unsigned long request, void* argument) { return ioctl(g_fd, request, argument) == 0 ? 0 : errno; }

std::string errorName(int error) {
  switch (error) {
    case 0:
      return "0";
    case EAGAIN:
      return "EAGAIN";
    case EBUSY:
      return "EBUSY";
    case EINVAL:
      return "EINVAL";
    case EIO:
      return "EIO";
    case ENODEV:
      return "ENODEV";
    case ENOENT:
      return "ENOENT";
    case ENOTTY:
      return "ENOTTY";
    case ENXIO:
      return "ENXIO";
    default:
      return std::to_string(error);
  }
}

void say(const char* what, int error) { std::printf("%-44s %s\n", what, errorName(error).c_str()); }
void say(const char* what, const std::string& answer) { std::printf("%-44s %s\n", what, answer.c_str()); }

v4l2_buffer emptyBuffer(unsigned index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

std::string pollNow(int timeout_ms) {
  pollfd device{g_fd, POLLIN | POLLPRI, 0};
  const int result = poll(&device, 1, timeout_ms);
  if (result == 0) return "timeout";
  std::string events;
  if ((device.revents & POLLIN) != 0) events += "IN ";
  if ((device.revents & POLLERR) != 0) events += "ERR ";
  if ((device.revents & POLLHUP) != 0) events += "HUP ";
  return events.empty() ? "?" : events.substr(0, events.size() - 1);
}

int dequeue(v4l2_buffer& buffer) {
  buffer = emptyBuffer(0);
  return ask(VIDIOC_DQBUF, &buffer);
}

int queue(unsigned index) {
  v4l2_buffer buffer = emptyBuffer(index);
  return ask(VIDIOC_QBUF, &buffer);
}

bool pressDisconnect(const char* path) {
  const int fd = open(path, O_RDWR | O_NONBLOCK);
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  bool pressed = false;
  while (!pressed && ioctl(fd, VIDIOC_QUERYCTRL, &query) == 0) {
    if (std::strcmp(reinterpret_cast<const char*>(query.name), "Disconnect") == 0) {
      v4l2_control control{query.id, 1};
      pressed = ioctl(fd, VIDIOC_S_CTRL, &control) == 0;
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  close(fd);
  if (!pressed) std::fprintf(stderr, "%s has no Disconnect button\n", path);
  return pressed;
}

int setFormat(int fd, unsigned width, unsigned height, unsigned fourcc, v4l2_format& format) {
  format = {};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = width;
  format.fmt.pix.height = height;
  format.fmt.pix.pixelformat = fourcc;
  return ioctl(fd, VIDIOC_S_FMT, &format) == 0 ? 0 : errno;
}

int requestBuffers(int fd, unsigned count, unsigned& got) {
  v4l2_requestbuffers request{};
  request.count = count;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  const int error = ioctl(fd, VIDIOC_REQBUFS, &request) == 0 ? 0 : errno;
  got = request.count;
  return error;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const char* const path = argv[1];
  const bool disconnect = argc > 2 && std::strcmp(argv[2], "--disconnect") == 0;
  if (argc > 2 && std::strcmp(argv[2], "--press") == 0) return pressDisconnect(path) ? 0 : 1;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  g_fd = open(path, O_RDWR | O_NONBLOCK);
  if (g_fd < 0) {
    say("open", errno);
    return 1;
  }
  v4l2_capability capability{};
  say("QUERYCAP", ask(VIDIOC_QUERYCAP, &capability));
  say("captures and streams",
      (capability.device_caps & V4L2_CAP_VIDEO_CAPTURE) != 0 && (capability.device_caps & V4L2_CAP_STREAMING) != 0
          ? "yes"
          : "no");
  v4l2_fmtdesc description{};
  description.index = 999;
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  say("ENUM_FMT past the end", ask(VIDIOC_ENUM_FMT, &description));
  v4l2_buffer buffer{};
  say("DQBUF before REQBUFS", dequeue(buffer));
  say("STREAMON before REQBUFS", ask(VIDIOC_STREAMON, &type));

  v4l2_format format{};
  say("S_FMT of no format", setFormat(g_fd, 123, 77, v4l2_fourcc('Z', 'Z', 'Z', 'Z'), format));
  say("  is adjusted to another",
      format.fmt.pix.pixelformat != v4l2_fourcc('Z', 'Z', 'Z', 'Z') && format.fmt.pix.width != 123 ? "yes" : "no");
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = {1, 1000};
  say("S_PARM 1/1000", ask(VIDIOC_S_PARM, &parameters));
  say("  is adjusted to a slower rate",
      parameters.parm.capture.timeperframe.denominator < 1000 * parameters.parm.capture.timeperframe.numerator ? "yes"
                                                                                                               : "no");
  say("S_FMT YUYV 320x180", setFormat(g_fd, 320, 180, V4L2_PIX_FMT_YUYV, format));
  say("  sizeimage covers the picture",
      format.fmt.pix.sizeimage >= format.fmt.pix.bytesperline * format.fmt.pix.height ? "yes" : "no");

  const unsigned picture_bytes = format.fmt.pix.sizeimage;
  unsigned count = 0;
  say("REQBUFS 4", requestBuffers(g_fd, 4, count));
  say("  gives", std::to_string(count));
  std::vector<std::pair<void*, std::size_t>> maps;
  bool aligned = true, long_enough = true;
  for (unsigned i = 0; i < count; ++i) {
    v4l2_buffer described = emptyBuffer(i);
    if (const int error = ask(VIDIOC_QUERYBUF, &described); error != 0) say("QUERYBUF", error);
    aligned = aligned && described.m.offset % 4096 == 0;
    long_enough = long_enough && described.length >= format.fmt.pix.sizeimage;
    void* const address = mmap(nullptr, described.length, PROT_READ | PROT_WRITE, MAP_SHARED, g_fd, described.m.offset);
    if (address == MAP_FAILED) say("mmap", errno);
    maps.emplace_back(address, described.length);
  }
  say("offsets are page aligned", aligned ? "yes" : "no");
  say("buffers hold sizeimage", long_enough ? "yes" : "no");
  v4l2_buffer past = emptyBuffer(99);
  say("QUERYBUF 99", ask(VIDIOC_QUERYBUF, &past));
  say("QBUF 99", queue(99));
  say("QBUF 0", queue(0));
  say("QBUF 0 again", queue(0));
  for (unsigned i = 1; i < count; ++i) say("QBUF", queue(i));
  say("DQBUF before STREAMON", dequeue(buffer));

  const int other = open(path, O_RDWR | O_NONBLOCK);
  say("second opener: open", other < 0 ? errno : 0);
  v4l2_format others_format{};
  others_format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  say("second opener: G_FMT", ioctl(other, VIDIOC_G_FMT, &others_format) == 0 ? 0 : errno);
  say("second opener: S_FMT", setFormat(other, 320, 180, V4L2_PIX_FMT_YUYV, others_format));
  unsigned others_count = 0;
  say("second opener: REQBUFS", requestBuffers(other, 2, others_count));
  say("second opener: STREAMON", ioctl(other, VIDIOC_STREAMON, &type) == 0 ? 0 : errno);
  close(other);

  say("STREAMON", ask(VIDIOC_STREAMON, &type));
  say("STREAMON again", ask(VIDIOC_STREAMON, &type));
  // On a slow machine pictures may have come already: they are taken and given back until none is ready.
  int ready = dequeue(buffer);
  for (int i = 0; i < 100 && ready == 0; ++i) {
    queue(buffer.index);
    ready = dequeue(buffer);
  }
  say("DQBUF, nothing ready", ready);
  say("S_FMT while streaming", setFormat(g_fd, 320, 180, V4L2_PIX_FMT_YUYV, format));
  say("REQBUFS while streaming", requestBuffers(g_fd, 4, count));
  say("poll", pollNow(10'000));
  say("DQBUF", dequeue(buffer));
  char flags[16];
  std::snprintf(flags, sizeof(flags), "0x%x", buffer.flags);
  say("  flags", flags);
  say("  bytesused is sizeimage", buffer.bytesused == picture_bytes ? "yes" : "no");
  // All buffers in our hands: the driver has none.
  unsigned held = 1;
  unsigned last_index = buffer.index;
  while (held < 4) {
    pollNow(10'000);
    if (dequeue(buffer) != 0) break;
    last_index = buffer.index;
    ++held;
  }
  const unsigned last_sequence = buffer.sequence;
  say("all held: poll", pollNow(500));
  say("all held: DQBUF", dequeue(buffer));
  queue(last_index);
  pollNow(10'000);
  dequeue(buffer);
  say("then the sequence jumps", buffer.sequence > last_sequence + 1 ? "yes" : "no");
  say("STREAMOFF", ask(VIDIOC_STREAMOFF, &type));
  say("poll after STREAMOFF", pollNow(200));
  for (unsigned i = 0; i < 4; ++i) queue(i);
  say("STREAMON once more", ask(VIDIOC_STREAMON, &type));
  pollNow(10'000);
  dequeue(buffer);
  say("  sequence starts at 0", buffer.sequence <= 1 ? "yes" : "no");

  if (disconnect) {
    if (!pressDisconnect(path)) return 1;
    const std::string events = pollNow(10'000);
    say("unplugged: poll", events);
    say("unplugged: DQBUF", dequeue(buffer));
    say("unplugged: QBUF", queue(0));
    say("unplugged: QUERYCAP", ask(VIDIOC_QUERYCAP, &capability));
    say("unplugged: STREAMOFF", ask(VIDIOC_STREAMOFF, &type));
    volatile unsigned char byte = *static_cast<unsigned char*>(maps[0].first);
    (void)byte;
    say("unplugged: buffers can be read", "yes");
  } else {
    say("STREAMOFF", ask(VIDIOC_STREAMOFF, &type));
  }
  for (const auto& [address, length] : maps) munmap(address, length);
  close(g_fd);
  return 0;
}
