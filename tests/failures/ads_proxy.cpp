#include "tests/failures/ads_proxy.hpp"

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstring>
#include <list>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace millrace::tests {

namespace {

constexpr std::size_t tcp_header = 6;
constexpr std::size_t command_at = tcp_header + 16;
constexpr std::uint8_t write_command = 3;

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

bool matches(const Spot& spot, const std::string& frame) {
  if (spot.variable.empty()) {
    return true;
  }
  const std::string name = spot.variable + '\0';
  if (frame.size() <= command_at || frame.find(name) == std::string::npos ||
      (static_cast<std::uint8_t>(frame[command_at]) == write_command) != spot.write) {
    return false;
  }
  std::uint32_t value = 0;
  std::memcpy(&value, frame.data() + frame.size() - sizeof value, sizeof value);
  return !spot.value || *spot.value == value;
}

bool send_all(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) {
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

/// Cuts whole AMS/TCP frames off the front of `bytes`.
std::vector<std::string> frames_of(std::string& bytes) {
  std::vector<std::string> frames;
  while (bytes.size() >= tcp_header) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data() + 2, sizeof length);
    if (bytes.size() < tcp_header + length) {
      break;
    }
    frames.push_back(bytes.substr(0, tcp_header + length));
    bytes.erase(0, tcp_header + length);
  }
  return frames;
}

/// The response of a router at which nothing is registered for the request's AMS port: error 6, no
/// data.
std::string refusal_of(const std::string& request) {
  constexpr std::size_t ams_header = 32;
  std::string frame = request.substr(0, tcp_header + ams_header);
  const std::uint32_t length = ams_header;
  const std::uint16_t flags = 5;
  const std::array<std::uint32_t, 2> no_data_and_error{0, 6};
  std::memcpy(frame.data() + 2, &length, sizeof length);
  std::swap_ranges(frame.begin() + tcp_header, frame.begin() + tcp_header + 8,
                   frame.begin() + tcp_header + 8);
  std::memcpy(frame.data() + command_at + 2, &flags, sizeof flags);
  std::memcpy(frame.data() + command_at + 4, no_data_and_error.data(), sizeof no_data_and_error);
  return frame;
}

enum class Order {
  none,
  release,
  release_if_connected,
  cut_before,
  cut_after,
  silence,
  silence_after
};

struct Connection {
  int gateway = -1;
  int controller = -1;
  /// The gateway receives nothing any more.
  bool deaf = false;
  /// Bytes that the controller has sent since `deaf` was set.
  bool answered = false;
  /// The proxy forwards nothing in either direction.
  bool silent = false;
  /// The last frame of the gateway.
  std::string last_frame{};
  std::thread to_controller;
  std::thread to_gateway;

  void shut() const {
    ::shutdown(gateway, SHUT_RDWR);
    ::shutdown(controller, SHUT_RDWR);
  }
};

bool is_closed(int socket) {
  pollfd end{.fd = socket, .events = POLLRDHUP, .revents = 0};
  return ::poll(&end, 1, 0) == 1 && (end.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

}  // namespace

struct AdsProxy::Impl {
  Sees sees = Sees::frames;
  int listener = -1;
  std::uint16_t port = 0;
  std::uint16_t target = 0;
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<Spot> spot;
  bool held = false;
  bool ending = false;
  Order order = Order::none;
  std::optional<Chatter> chatter;
  std::list<Connection> connections;
  std::thread chatterer;
  std::thread acceptor;

  void accept();
  void send_chatter();
  void pass_to_controller(Connection& connection);
  void pass_to_gateway(Connection& connection);
  bool pass(Connection& connection, const std::string& frame);
  bool hold(Connection& connection, const std::string& frame, std::unique_lock<std::mutex>& lock);

  void command(Order what) {
    const std::lock_guard lock(mutex);
    order = what;
    held = false;
    changed.notify_all();
  }
};

void AdsProxy::Impl::accept() {
  while (true) {
    const int gateway = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
    if (gateway < 0) {
      return;
    }
    const std::lock_guard lock(mutex);
    const int controller = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in address = loopback(target);
    if (ending || target == 0 ||
        ::connect(controller, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      ::close(gateway);
      ::close(controller);
      continue;
    }
    const int yes = 1;
    ::setsockopt(gateway, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    ::setsockopt(controller, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    Connection& connection = connections.emplace_back();
    connection.gateway = gateway;
    connection.controller = controller;
    connection.to_controller = std::thread([this, &connection] { pass_to_controller(connection); });
    connection.to_gateway = std::thread([this, &connection] { pass_to_gateway(connection); });
  }
}

void AdsProxy::Impl::pass_to_controller(Connection& connection) {
  std::array<char, 4096> buffer{};
  std::string bytes;
  bool open = true;
  while (open) {
    const ssize_t got = ::recv(connection.gateway, buffer.data(), buffer.size(), 0);
    if (got <= 0) {
      break;
    }
    bytes.append(buffer.data(), static_cast<std::size_t>(got));
    const auto frames =
        sees == Sees::frames ? frames_of(bytes) : std::vector{std::exchange(bytes, {})};
    for (const std::string& frame : frames) {
      open = open && pass(connection, frame);
    }
  }
  connection.shut();
}

void AdsProxy::Impl::pass_to_gateway(Connection& connection) {
  std::array<char, 4096> buffer{};
  while (true) {
    const ssize_t got = ::recv(connection.controller, buffer.data(), buffer.size(), 0);
    if (got <= 0) {
      break;
    }
    const std::lock_guard lock(mutex);
    if (connection.deaf || connection.silent) {
      connection.answered = true;
      changed.notify_all();
    } else if (!chatter || *chatter == Chatter::router_errors) {
      send_all(connection.gateway, {buffer.data(), static_cast<std::size_t>(got)});
    }
  }
  bool silent = false;
  {
    const std::lock_guard lock(mutex);
    silent = connection.silent;
    connection.answered = true;
    changed.notify_all();
  }
  if (!silent) {
    connection.shut();
  }
}

void AdsProxy::Impl::send_chatter() {
  constexpr std::size_t addresses = 16;
  constexpr std::size_t net_id = 6;
  std::unique_lock lock(mutex);
  while (!changed.wait_for(lock, std::chrono::milliseconds(200), [&] { return ending; })) {
    for (const Connection& connection : connections) {
      if (!chatter || *chatter == Chatter::router_errors ||
          connection.last_frame.size() < command_at + addresses) {
        continue;
      }
      std::string frame = connection.last_frame;
      if (*chatter != Chatter::mirrored_frames) {
        // From the controller to the gateway: their addresses change places.
        const bool notifies = *chatter == Chatter::notifications;
        frame = frame.substr(0, tcp_header + 32);
        const std::uint32_t length = 32;
        std::memcpy(frame.data() + 2, &length, sizeof length);
        std::swap_ranges(frame.begin() + tcp_header, frame.begin() + tcp_header + 8,
                         frame.begin() + tcp_header + 8);
        if (!notifies) {
          const std::uint16_t router_port = 10000;
          std::memcpy(frame.data() + tcp_header + net_id, &router_port, sizeof router_port);
        }
        frame[command_at] = notifies ? 8 : 4;
        std::memset(frame.data() + tcp_header + 20, 0, 8);
      }
      send_all(connection.gateway, frame);
    }
  }
}

/// False if the connection is over.
bool AdsProxy::Impl::pass(Connection& connection, const std::string& frame) {
  std::unique_lock lock(mutex);
  connection.last_frame = frame;
  if (chatter && *chatter == Chatter::router_errors) {
    return send_all(connection.gateway, refusal_of(frame));
  }
  if (connection.silent || chatter) {
    return true;
  }
  if (spot && matches(*spot, frame) && --spot->occurrence == 0) {
    spot.reset();
    return hold(connection, frame, lock);
  }
  return send_all(connection.controller, frame);
}

bool AdsProxy::Impl::hold(Connection& connection, const std::string& frame,
                          std::unique_lock<std::mutex>& lock) {
  held = true;
  order = Order::none;
  changed.notify_all();
  changed.wait(lock, [&] { return order != Order::none || ending; });
  const bool executed = order == Order::cut_after || order == Order::silence_after;
  if (order == Order::release_if_connected && is_closed(connection.gateway)) {
    return false;
  }
  if (order == Order::release || order == Order::release_if_connected) {
    return send_all(connection.controller, frame);
  }
  if (executed) {
    connection.deaf = true;
    send_all(connection.controller, frame);
    changed.wait(lock, [&] { return connection.answered || ending; });
  }
  connection.silent = order == Order::silence || order == Order::silence_after;
  return connection.silent;
}

AdsProxy::AdsProxy(Sees sees) : impl_(std::make_unique<Impl>()) {
  impl_->sees = sees;
  impl_->listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  if (::bind(impl_->listener, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      ::listen(impl_->listener, 16) != 0 ||
      ::getsockname(impl_->listener, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("the proxy has no port to listen on");
  }
  impl_->port = ntohs(address.sin_port);
  impl_->acceptor = std::thread([this] { impl_->accept(); });
  impl_->chatterer = std::thread([this] { impl_->send_chatter(); });
}

AdsProxy::~AdsProxy() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
    impl_->changed.notify_all();
    for (const Connection& connection : impl_->connections) {
      connection.shut();
    }
  }
  ::shutdown(impl_->listener, SHUT_RDWR);
  impl_->acceptor.join();
  impl_->chatterer.join();
  ::close(impl_->listener);
  for (Connection& connection : impl_->connections) {
    connection.to_controller.join();
    connection.to_gateway.join();
    ::close(connection.gateway);
    ::close(connection.controller);
  }
}

std::uint16_t AdsProxy::port() const {
  return impl_->port;
}

void AdsProxy::lead_to(std::uint16_t port) {
  const std::lock_guard lock(impl_->mutex);
  impl_->target = port;
}

void AdsProxy::arm(Spot spot) {
  const std::lock_guard lock(impl_->mutex);
  impl_->spot = std::move(spot);
}

bool AdsProxy::await_held(std::chrono::milliseconds timeout) {
  std::unique_lock lock(impl_->mutex);
  return impl_->changed.wait_for(lock, timeout, [&] { return impl_->held; });
}

void AdsProxy::release() {
  impl_->command(Order::release);
}
void AdsProxy::release_if_connected() {
  impl_->command(Order::release_if_connected);
}
void AdsProxy::cut_before() {
  impl_->command(Order::cut_before);
}
void AdsProxy::cut_after() {
  impl_->command(Order::cut_after);
}
void AdsProxy::go_silent() {
  impl_->command(Order::silence);
}
void AdsProxy::go_silent_after() {
  impl_->command(Order::silence_after);
}

void AdsProxy::answer_nothing(Chatter chatter) {
  const std::lock_guard lock(impl_->mutex);
  impl_->chatter = chatter;
}
void AdsProxy::answer() {
  const std::lock_guard lock(impl_->mutex);
  impl_->chatter.reset();
}

}  // namespace millrace::tests
