#include <random>
#include <sys/eventfd.h>

#include "protocol/publisher_state.h"

namespace volto::protocol {
namespace {

constexpr std::int64_t kMaxSubscriptionBytes = 256;  // what a subscriber may send us

}  // namespace

Publisher::State::State(const PublisherOptions& how)
    : options(how),
      endpoint(parseEndpoint(options.endpoint.empty() ? std::string(kDefaultEndpoint) : options.endpoint)),
      lock(endpoint) {
  readKeys();
  epoch = (static_cast<std::uint64_t>(std::random_device{}()) << 32U) | std::random_device{}();
  source_landmarks = addStream(MessageKind::landmarks, options.source);
  source_mask = addStream(MessageKind::mask, options.source);
  status = addStream(MessageKind::status, {});
  wake_fd = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wake_fd < 0) throw SetupError(SetupError::Kind::failed, "no eventfd: too many open files?");
  try {
    openSockets();
  } catch (...) {
    ::close(wake_fd);
    throw;
  }
  thread = std::thread([this] { run(); });
}

Publisher::State::~State() {
  {
    const std::lock_guard guard(mutex);
    stopping = true;
  }
  wakeUp();
  thread.join();
  ::close(wake_fd);
}

void Publisher::State::readKeys() {
  const bool has_keys = !options.curve_key_file.empty();
  const bool has_list = !options.curve_allow_file.empty();
  if (!endpoint.loopback && !(has_keys && has_list)) {
    throw SetupError(SetupError::Kind::usage,
                     endpoint.address() +
                         ": would be reachable from other machines; that wants CURVE keys and a "
                         "list of the subscribers that may connect, or use 127.0.0.1");
  }
  if (has_keys != has_list) throw SetupError(SetupError::Kind::usage, "CURVE wants both a key file and an allow-list");
  if (!has_keys) return;
  keys = readCurveKeys(options.curve_key_file);
  allowed = readCurveAllowList(options.curve_allow_file);
}

Stream* Publisher::State::addStream(MessageKind kind, std::string_view name) {
  streams.push_back(std::make_unique<Stream>(Stream{makeTopic(kind, name), kind}));
  return streams.back().get();
}

void Publisher::State::openSockets() {
  if (keys) {
    // Before the first peer can knock.
    zap = Socket(context, ZMQ_REP);
    zap.set(ZMQ_LINGER, 0);
    if (zmq_bind(zap.get(), "inproc://zeromq.zap.01") != 0)
      throw SetupError(SetupError::Kind::failed, "the access handler cannot start");
  }
  // A free pair of neighbouring ports may take several tries.
  const bool any_port = endpoint.transport == Endpoint::Transport::tcp && endpoint.port == 0;
  for (int tries = any_port ? 20 : 1;; --tries) {
    openPair();
    try {
      bindSocket(frames, endpoint);
      Endpoint bound = endpoint;
      if (any_port) {
        const std::string address = frames.lastEndpoint();
        bound.port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
        if (bound.port == 65535) continue;
      }
      bindSocket(snapshots, bound.snapshot());
      endpoint = bound;
      return;
    } catch (const SetupError&) {
      if (tries <= 1) throw;
    }
  }
}

void Publisher::State::openPair() {
  snapshots = Socket(context, ZMQ_ROUTER);
  monitor = Socket();
  frames = Socket(context, ZMQ_XPUB);
  for (Socket* socket : {&frames, &snapshots}) {
    setCommonOptions(*socket, endpoint);
    socket->set(ZMQ_MAXMSGSIZE, keys ? kMaxHandshakeBytes : kMaxSubscriptionBytes);
    socket->set(ZMQ_SNDHWM, options.send_high_water_mark);
    if (!keys) continue;
    socket->set(ZMQ_CURVE_SERVER, 1);
    socket->set(ZMQ_CURVE_SECRETKEY, std::string_view(keys->secret_key));
    socket->set(ZMQ_ZAP_DOMAIN, kZapDomain);
  }
  frames.set(ZMQ_LINGER, 250);
  // Every subscription and every end of one, not only the first: late joiners are served and wantsMesh is right.
  frames.set(ZMQ_XPUB_VERBOSER, 1);
  if (options.when_full == WhenFull::lossless) {
    frames.set(ZMQ_XPUB_NODROP, 1);
    frames.set(ZMQ_SNDTIMEO, 1000);
  }
  monitor = Socket::monitorOf(context, frames, "inproc://monitor-" + std::to_string(pairs_opened++),
                              ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED);
}

}  // namespace volto::protocol
