// Any bytes, taken for a take: refused with a reason, or read; whatever comes out is a message that decodes.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fcntl.h>
#include <string>
#include <unistd.h>

#include "protocol/take_reader.h"

using namespace volto::protocol;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string path = "/tmp/volto-take-fuzz-" + std::to_string(getpid());
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0) return 0;
  const bool written = write(fd, data, size) == static_cast<ssize_t>(size);
  close(fd);
  if (written) {
    try {
      TakeReader reader(path);
      TakeRow row;
      std::uint64_t rows = 0;
      while (reader.next(row)) {
        Stamp stamp;
        if (!checkMessage(row.payload, stamp).ok()) std::abort();
        if (++rows > size) std::abort();  // more rows than bytes: it does not end
      }
      if (reader.counters().delivered != rows) std::abort();
    } catch (const SetupError& e) {
      if (std::string(e.what()).find(path) == std::string::npos) std::abort();
    }
  }
  unlink(path.c_str());
  return 0;
}
