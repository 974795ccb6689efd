#include "tools/picture/write_file.h"

#include <cerrno>
#include <fcntl.h>
#include <stdlib.h>
#include <string>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace volto::picture {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path) {
  throw std::system_error(errno, std::generic_category(), path.string() + ": cannot be written");
}

}  // namespace

void writeWholeFile(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::string temporary = path.string() + ".XXXXXX";
  const int file = ::mkostemp(temporary.data(), O_CLOEXEC);
  if (file < 0) fail(path);
  const auto giveUp = [&] {
    const int error = errno;
    ::close(file);
    ::unlink(temporary.c_str());
    errno = error;
    fail(path);
  };
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t written = ::write(file, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) giveUp();
    done += static_cast<std::size_t>(written);
  }
  const mode_t mask = ::umask(0);
  ::umask(mask);
  if (::fchmod(file, 0666 & ~mask) != 0) giveUp();
  if (::rename(temporary.c_str(), path.c_str()) != 0) giveUp();
  ::close(file);
}

}  // namespace volto::picture
