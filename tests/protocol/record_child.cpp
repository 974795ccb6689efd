// A program that records until it is told to stop, for tests that kill it or take its disk away.
// record_child PATH FRAMES RATE_HZ [FILE_SIZE_LIMIT]: FRAMES landmark frames; prints the number of the last frame that
// was appended.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>

#include "protocol/clock.h"
#include "protocol/take_writer.h"
#include "tests/protocol/samples.h"

int main(int argc, char** argv) {
  using namespace volto;
  using namespace volto::protocol;
  if (argc < 4) return 2;
  const auto frames = std::strtoull(argv[2], nullptr, 10);
  const double rate_hz = std::strtod(argv[3], nullptr);
  if (argc > 4) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlim_t limit = std::strtoull(argv[4], nullptr, 10);
    const rlimit both{limit, limit};
    if (setrlimit(RLIMIT_FSIZE, &both) != 0) return 3;
  }
  TakeHeader header;
  header.name = "child";
  TakeWriter writer(argv[1], header);
  const auto start = std::chrono::steady_clock::now();
  for (std::uint64_t n = 1; n <= frames; ++n) {
    LandmarkFrame frame = test::sampleLandmarks(n);
    frame.t_capture_ns = monotonicNs();
    if (!writer.append(frame, "camera").ok()) return 4;
    // Unbuffered, so that who kills us knows how far we were.
    const std::int64_t t = frame.t_capture_ns;
    if (write(STDOUT_FILENO, &t, sizeof(t)) != sizeof(t)) return 5;
    std::this_thread::sleep_until(start + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                              std::chrono::duration<double>(static_cast<double>(n) / rate_hz)));
  }
  const Result r = writer.finish();
  if (!r.ok()) std::fprintf(stderr, "%s\n", r.problem.c_str());
  return r.ok() ? 0 : 1;
}
