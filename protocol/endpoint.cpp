#include "protocol/endpoint.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace volto::protocol {
namespace {

constexpr std::string_view kSnapshotSuffix = ".snapshot";
constexpr std::size_t kMaxIpcPath = sizeof(sockaddr_un::sun_path) - 1;  // 107

SetupError badEndpoint(std::string_view text, const std::string& why) {
  return {SetupError::Kind::usage,
          std::string(text) + ": " + why + "; an endpoint is ipc://NAME, ipc:///PATH or tcp://HOST:PORT"};
}

bool isLoopbackHost(std::string_view host) { return host == "localhost" || host == "::1" || host.starts_with("127."); }

void makeRuntimeDirectory(const std::string& directory, const std::string& address) {
  const auto refuse = [&](const std::string& why) {
    throw SetupError(SetupError::Kind::unavailable, address + ": the folder " + directory + " " + why);
  };
  if (::mkdir(directory.c_str(), 0700) != 0 && errno != EEXIST)
    refuse(std::string("cannot be made: ") + std::strerror(errno));
  struct stat info {};
  if (::lstat(directory.c_str(), &info) != 0 || !S_ISDIR(info.st_mode)) refuse("is not a folder");
  if (info.st_uid != ::geteuid()) refuse("belongs to another user");
  if ((info.st_mode & 077U) != 0 && ::chmod(directory.c_str(), 0700) != 0) refuse("is open to other users");
}

// Somebody who knows nothing of our lock may listen there all the same.
bool somebodyListens(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return false;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), std::min(path.size(), kMaxIpcPath));
  const bool answered =
      ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 || errno == EAGAIN;
  ::close(fd);
  return answered;
}

}  // namespace

std::string Endpoint::address() const {
  if (transport == Transport::ipc) return "ipc://" + path;
  const bool v6 = host.find(':') != std::string::npos;
  return "tcp://" +
         (v6                    ? "[" + host + "]"
          : host == "localhost" ? std::string("127.0.0.1")
                                : host) +
         ":" + (port == 0 ? std::string("*") : std::to_string(port));
}

Endpoint Endpoint::snapshot() const {
  Endpoint e = *this;
  if (transport == Transport::ipc) {
    e.path += kSnapshotSuffix;
  } else if (port != 0) {
    e.port = static_cast<std::uint16_t>(port + 1);
  }
  return e;
}

Endpoint parseEndpoint(std::string_view text) {
  Endpoint e;
  if (text.starts_with("ipc://")) {
    const std::string_view path = text.substr(6);
    if (path.empty()) throw badEndpoint(text, "names no path");
    if (path.front() == '@') throw badEndpoint(text, "abstract sockets have no owner and no permissions");
    if (path.find('\0') != std::string_view::npos) throw badEndpoint("ipc://...", "the path contains a zero byte");
    e.path =
        path.find('/') == std::string_view::npos ? runtimeDirectory() + "/" + std::string(path) : std::string(path);
    if (e.path.size() + kSnapshotSuffix.size() > kMaxIpcPath) {
      throw SetupError(SetupError::Kind::usage, "ipc://" + e.path + ": the path has " + std::to_string(e.path.size()) +
                                                    " bytes; a Unix socket takes " +
                                                    std::to_string(kMaxIpcPath - kSnapshotSuffix.size()) +
                                                    ": choose a shorter one");
    }
    return e;
  }
  if (!text.starts_with("tcp://")) throw badEndpoint(text.empty() ? "''" : text, "not an endpoint");
  e.transport = Endpoint::Transport::tcp;
  const std::string_view rest = text.substr(6);
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos || colon == 0) throw badEndpoint(text, "host and port are missing");
  std::string_view host = rest.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  if (host.empty() || host.find_first_of("[]/ ;") != std::string_view::npos) throw badEndpoint(text, "not a host");
  e.host = host;
  e.loopback = isLoopbackHost(host);
  const std::string_view port = rest.substr(colon + 1);
  if (port == "*") return e;
  unsigned value = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), value);
  // One port above is the snapshot socket's.
  if (error != std::errc() || end != port.data() + port.size() || value > 65534)
    throw badEndpoint(text, "the port is not in 0..65534");
  e.port = static_cast<std::uint16_t>(value);
  return e;
}

std::string runtimeDirectory() {
  if (const char* xdg = std::getenv("XDG_RUNTIME_DIR"); xdg != nullptr && xdg[0] == '/')
    return std::string(xdg) + "/volto";
  return "/tmp/volto-" + std::to_string(::geteuid());
}

EndpointLock::EndpointLock(const Endpoint& endpoint) {
  if (endpoint.transport != Endpoint::Transport::ipc) return;
  const std::string address = endpoint.address();
  if (endpoint.path.starts_with(runtimeDirectory() + "/")) makeRuntimeDirectory(runtimeDirectory(), address);
  const std::string lock_path = endpoint.path + ".lock";
  fd_ = ::open(lock_path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (fd_ < 0) {
    throw SetupError(SetupError::Kind::unavailable,
                     address + ": " + lock_path + " cannot be made: " + std::strerror(errno));
  }
  const auto refuse = [&](SetupError::Kind kind, const std::string& why) {
    ::close(fd_);
    throw SetupError(kind, address + ": " + why);
  };
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    std::array<char, 16> pid{};
    const ssize_t n = ::pread(fd_, pid.data(), pid.size() - 1, 0);
    refuse(SetupError::Kind::unavailable,
           n > 0 ? "in use by process " + std::string(pid.data()) + "; stop it or choose another endpoint"
                 : std::string("in use; choose another endpoint"));
  }
  struct stat info {};
  if (::lstat(endpoint.path.c_str(), &info) == 0) {
    if (!S_ISSOCK(info.st_mode))
      refuse(SetupError::Kind::usage, "there is a file of that name, and it is not a socket");
    if (somebodyListens(endpoint.path))
      refuse(SetupError::Kind::unavailable, "in use by another program; choose another endpoint");
  }
  const std::string pid = std::to_string(::getpid());
  if (::ftruncate(fd_, 0) != 0 ||
      ::pwrite(fd_, pid.data(), pid.size(), 0) < 0) { /* the pid is only there to be shown */
  }
}

EndpointLock::~EndpointLock() {
  // The file stays: removing it would let a third process lock a file that a second one has already opened.
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace volto::protocol
