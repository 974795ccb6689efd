// Where publisher and subscriber meet.
//
//   ipc://NAME            a name without '/': $XDG_RUNTIME_DIR/volto/NAME, a folder of this user alone (0700)
//   ipc:///some/path      that path
//   tcp://127.0.0.1:5570  loopback; port 0 (publisher only) takes a free one. localhost and [::1] too
//   tcp://HOST:PORT       anything else wants CURVE keys (protocol/curve.h)
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/errors.h"

namespace volto::protocol {

struct Endpoint {
  enum class Transport { ipc, tcp };
  Transport transport = Transport::ipc;
  std::string path;        // ipc: absolute or relative path of the socket
  std::string host;        // tcp: without brackets
  std::uint16_t port = 0;  // tcp
  bool loopback = true;    // nothing leaves this machine

  // As ZeroMQ wants it.
  std::string address() const;
  // Where a late joiner asks for characters: ipc path + ".snapshot", tcp port + 1.
  Endpoint snapshot() const;
};

// Throws SetupError (usage): not an endpoint, a path longer than the 107 bytes of a Unix socket (".snapshot" included),
// a port out of range.
Endpoint parseEndpoint(std::string_view text);

// What publishers and subscribers use when nobody says: ipc://main.
inline constexpr std::string_view kDefaultEndpoint = "ipc://main";

// $XDG_RUNTIME_DIR/volto, or /tmp/volto-UID where there is no such variable. Not created here.
std::string runtimeDirectory();

// Holds an ipc path for one publisher: makes the folder (0700) where it is the runtime directory, takes PATH.lock.
// ZeroMQ itself would silently steal the path from a publisher that is running. Thread-bound.
class EndpointLock {
 public:
  // Throws SetupError (unavailable): "ipc:///...: in use by process 4711", or the folder cannot be made or belongs to
  // somebody else.
  explicit EndpointLock(const Endpoint& endpoint);
  ~EndpointLock();
  EndpointLock(const EndpointLock&) = delete;
  EndpointLock& operator=(const EndpointLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace volto::protocol
