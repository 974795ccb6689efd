// ZeroMQ behind RAII, with the options that every socket of ours has (reliability: heartbeats, reconnects, buffers).
// Not for other folders.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <zmq.h>

#include "protocol/curve.h"
#include "protocol/endpoint.h"
#include "protocol/errors.h"

namespace volto::protocol {

class Context {
 public:
  Context();
  ~Context() { zmq_ctx_term(context_); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  void* get() const { return context_; }

 private:
  void* context_;
};

class Socket {
 public:
  Socket() = default;
  Socket(const Context& context, int type);
  ~Socket() { close(); }
  Socket(Socket&& other) noexcept : socket_(std::exchange(other.socket_, nullptr)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(socket_, other.socket_);
    return *this;
  }
  // What happens to `socket`, as messages for nextEvent. The name must be new in its context. Throws SetupError.
  static Socket monitorOf(const Context& context, const Socket& socket, const std::string& name, int events);
  void close();
  void* get() const { return socket_; }
  void set(int option, int value);
  void set(int option, std::int64_t value);
  void set(int option, std::string_view value);
  std::string lastEndpoint() const;
  // For poll(2). It tells of changes only: read the socket until nothing is left (and send nothing in between) before
  // waiting on it.
  int fd() const;
  // ZMQ_POLLIN, ZMQ_POLLOUT: what is possible now.
  int events() const;

 private:
  void* socket_ = nullptr;
};

class Message {
 public:
  Message() { zmq_msg_init(&message_); }
  explicit Message(std::string_view content);
  ~Message() { zmq_msg_close(&message_); }
  Message(Message&& other) noexcept : Message() { zmq_msg_move(&message_, &other.message_); }
  Message& operator=(Message&& other) noexcept {
    zmq_msg_move(&message_, &other.message_);
    return *this;
  }
  zmq_msg_t* get() { return &message_; }
  std::size_t size() const { return zmq_msg_size(&message_); }
  const char* data() { return static_cast<const char*>(zmq_msg_data(&message_)); }
  std::string_view text() { return {data(), size()}; }
  bool more() const { return zmq_msg_more(&message_) != 0; }

  // false: nothing there (or interrupted).
  bool receive(const Socket& socket, int flags = ZMQ_DONTWAIT) {
    return zmq_msg_recv(&message_, socket.get(), flags) >= 0;
  }
  bool send(const Socket& socket, int flags = 0) { return zmq_msg_send(&message_, socket.get(), flags) >= 0; }

 private:
  zmq_msg_t message_;
};

// Heartbeats, reconnect intervals, buffers, back-log, handshake limit, no linger.
void setCommonOptions(Socket& socket, const Endpoint& endpoint);

// Throws SetupError (unavailable) that names the address: in use, not ours, ...
void bindSocket(Socket& socket, const Endpoint& endpoint);
void connectSocket(Socket& socket, const Endpoint& endpoint);

// Domain under which the publisher's access handler is asked.
inline constexpr std::string_view kZapDomain = "volto";

// One event of a socket monitor; nothing when there is none.
struct MonitorEvent {
  std::uint16_t event = 0;
  std::uint32_t value = 0;
};
std::optional<MonitorEvent> nextEvent(const Socket& monitor);

}  // namespace volto::protocol
