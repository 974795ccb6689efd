#include "protocol/sockets.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <pthread.h>
#include <sched.h>
#include <sys/stat.h>

namespace volto::protocol {

Context::Context() : context_(zmq_ctx_new()) {
  if (context_ == nullptr)
    throw SetupError(SetupError::Kind::failed, std::string("ZeroMQ cannot start: ") + zmq_strerror(zmq_errno()));
  // ZeroMQ's own thread, woken by what is sent, does not take the processor from the one that is sending. It aborts
  // where it may not have what it was told to: tried here first. A real-time program's threads stay real-time.
  const sched_param none{};
  if (sched_getscheduler(0) == SCHED_OTHER && pthread_setschedparam(pthread_self(), SCHED_BATCH, &none) == 0) {
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &none);
    zmq_ctx_set(context_, ZMQ_THREAD_SCHED_POLICY, SCHED_BATCH);
  }
}

Socket::Socket(const Context& context, int type) : socket_(zmq_socket(context.get(), type)) {
  if (socket_ == nullptr)
    throw SetupError(SetupError::Kind::failed, std::string("no ZeroMQ socket: ") + zmq_strerror(zmq_errno()));
}

Socket Socket::monitorOf(const Context& context, const Socket& socket, const std::string& name, int events) {
  Socket monitor(context, ZMQ_PAIR);
  if (zmq_socket_monitor(socket.get(), name.c_str(), events) != 0 || zmq_connect(monitor.get(), name.c_str()) != 0) {
    throw SetupError(SetupError::Kind::failed, std::string("a socket cannot be watched: ") + zmq_strerror(zmq_errno()));
  }
  return monitor;
}

void Socket::close() {
  if (socket_ != nullptr) zmq_close(socket_);
  socket_ = nullptr;
}

namespace {

void setOption(void* socket, int option, const void* value, std::size_t size) {
  if (zmq_setsockopt(socket, option, value, size) != 0) {
    throw SetupError(SetupError::Kind::failed,
                     "ZeroMQ refuses socket option " + std::to_string(option) + ": " + zmq_strerror(zmq_errno()));
  }
}

}  // namespace

void Socket::set(int option, int value) { setOption(socket_, option, &value, sizeof(value)); }
void Socket::set(int option, std::int64_t value) { setOption(socket_, option, &value, sizeof(value)); }
void Socket::set(int option, std::string_view value) { setOption(socket_, option, value.data(), value.size()); }

std::string Socket::lastEndpoint() const {
  std::array<char, 512> text{};
  std::size_t size = text.size();
  if (zmq_getsockopt(socket_, ZMQ_LAST_ENDPOINT, text.data(), &size) != 0) return {};
  return text.data();
}

int Socket::fd() const {
  int fd = -1;
  std::size_t size = sizeof(fd);
  if (socket_ != nullptr) zmq_getsockopt(socket_, ZMQ_FD, &fd, &size);
  return fd;
}

int Socket::events() const {
  int events = 0;
  std::size_t size = sizeof(events);
  if (socket_ != nullptr) zmq_getsockopt(socket_, ZMQ_EVENTS, &events, &size);
  return events;
}

Message::Message(std::string_view content) {
  if (zmq_msg_init_size(&message_, content.size()) != 0) throw std::bad_alloc();
  std::memcpy(zmq_msg_data(&message_), content.data(), content.size());
}

void setCommonOptions(Socket& socket, const Endpoint& endpoint) {
  socket.set(ZMQ_LINGER, 0);
  socket.set(ZMQ_HEARTBEAT_IVL, 1000);
  socket.set(ZMQ_HEARTBEAT_TIMEOUT, 3000);
  socket.set(ZMQ_HEARTBEAT_TTL, 3000);
  socket.set(ZMQ_HANDSHAKE_IVL, 5000);
  socket.set(ZMQ_RECONNECT_IVL, 100);
  socket.set(ZMQ_RECONNECT_IVL_MAX, 2000);
  socket.set(ZMQ_BACKLOG, 128);
  if (endpoint.transport == Endpoint::Transport::tcp) {
    // Small, so that a subscriber that stalled wakes up to the present and not to seconds of the past.
    socket.set(ZMQ_SNDBUF, 32 * 1024);
    socket.set(ZMQ_RCVBUF, 32 * 1024);
    if (endpoint.host.find(':') != std::string::npos) socket.set(ZMQ_IPV6, 1);
  }
}

void bindSocket(Socket& socket, const Endpoint& endpoint) {
  const std::string address = endpoint.address();
  const bool ipc = endpoint.transport == Endpoint::Transport::ipc;
  const mode_t before = ipc ? ::umask(0077) : 0;
  const int result = zmq_bind(socket.get(), address.c_str());
  const int error = zmq_errno();
  if (ipc) ::umask(before);
  if (result == 0) return;
  std::string why = zmq_strerror(error);
  if (error == EADDRINUSE) why = "in use; stop the program that holds it or choose another endpoint";
  if (error == EADDRNOTAVAIL || error == ENODEV) why = "no such address on this machine";
  if (error == EACCES) why = "not allowed; ports below 1024 are for the system";
  throw SetupError(SetupError::Kind::unavailable, address + ": " + why);
}

void connectSocket(Socket& socket, const Endpoint& endpoint) {
  if (zmq_connect(socket.get(), endpoint.address().c_str()) == 0) return;
  throw SetupError(SetupError::Kind::usage, endpoint.address() + ": " + zmq_strerror(zmq_errno()));
}

std::optional<MonitorEvent> nextEvent(const Socket& monitor) {
  Message head;
  if (!head.receive(monitor)) return std::nullopt;
  MonitorEvent event;
  if (head.size() >= 6) {
    std::memcpy(&event.event, head.data(), 2);
    std::memcpy(&event.value, head.data() + 2, 4);
  }
  while (head.more() && head.receive(monitor)) {
  }
  return event;
}

}  // namespace volto::protocol
