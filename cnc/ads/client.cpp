#include "cnc/ads/client.hpp"

#include <utility>

#include <boost/asio/co_spawn.hpp>

#include "base/messages/catalogue.hpp"
#include "base/program/barrier.hpp"
#include "cnc/ads/link.hpp"
#include "cnc/ads/request.hpp"
#include "cnc/ads/requester.hpp"
#include "cnc/ads/response.hpp"
#include "cnc/ads/secure_handshake.hpp"
#include "cnc/ads/stream.hpp"
#include "cnc/ads/subscriptions.hpp"
#include "cnc/ads/sum_codec.hpp"
#include "cnc/ads/symbols.hpp"

namespace millrace::cnc::ads {

namespace asio = boost::asio;
namespace messages = base::messages;

struct Client::Impl final : Requester {
  Impl(asio::any_io_executor executor, ClientOptions wanted)
      : Requester(std::move(executor), wanted), options(std::move(wanted)) {}

  using Self = std::shared_ptr<Impl>;
  using Connected = tl::expected<DeviceState, LinkError>;

  static asio::awaitable<Connected> connect(Self self);
  static asio::awaitable<tl::expected<Transport, base::messages::Message>> make_transport(
      Self self, asio::ip::tcp::socket socket);
  static asio::awaitable<Connected> first_answer(Self self);
  // Sends a request and decodes its response to a T.
  template <typename T>
  static asio::awaitable<Result<T>> ask(Self self, std::uint16_t port, Command command,
                                        Bytes payload, Result<T> (*decode)(BytesView));
  // Sends a request whose response carries data.
  static asio::awaitable<Result<Bytes>> fetch(Self self, std::uint16_t port, Command command,
                                              Bytes payload, std::uint32_t asked);
  using Handles = std::vector<std::uint32_t>;
  static asio::awaitable<std::vector<Result<std::uint32_t>>> subscribe(
      Self self, std::uint16_t port, std::vector<AddNotificationRequest> wanted,
      NotificationHandler handler);
  static asio::awaitable<Result<std::vector<Result<std::uint32_t>>>> add_in_a_sum(
      Self self, std::uint16_t port, std::vector<AddNotificationRequest> wanted);
  static asio::awaitable<std::vector<Result<std::uint32_t>>> add_singly(
      Self self, std::uint16_t port, std::vector<AddNotificationRequest> wanted);
  static asio::awaitable<void> unsubscribe(Self self, std::uint16_t port, Handles handles);
  static asio::awaitable<void> delete_notifications(Self self, std::uint16_t port, Handles handles);
  void leave(const Resources& belongings);
  void on_notification(const Packet& packet) override;
  void on_end(const LinkEnd& end) override;
  void close();

  ClientOptions options;
  NotificationInbox inbox;
  std::function<void(const LinkError&)> on_down;
  LinkEnd last_end;
  // A second client with our address is recognized by this sequence: again and again the controller
  // closes our connection and accepts the next one at once. One that ends, or is restarted, refuses
  // it, or needs some time.
  struct Closures {
    std::optional<std::chrono::steady_clock::time_point> last{};
    /// Connections in a row.
    unsigned accepted_at_once = 0;
  } closures;
  // A Secure ADS connection before its first frame.
  std::weak_ptr<Stream> handshaking;
  // Counts the calls of close(), so that connect() notices a close() during its wait.
  std::size_t closed = 0;
  // The controller accepted notifications in a sum request.
  bool sums = false;
  bool connecting = false;
  bool up = false;
};

namespace {

// Resets a flag at the end of its scope, also when the coroutine is destroyed.
class Flag {
 public:
  explicit Flag(bool& flag) : flag_(flag) { flag_ = true; }
  ~Flag() { flag_ = false; }
  Flag(const Flag&) = delete;
  Flag& operator=(const Flag&) = delete;

 private:
  bool& flag_;
};

// A sum that deletes notifications; its response has a code for each.
ReadWriteRequest deletion_of(const std::vector<std::uint32_t>& handles, const Bytes& numbers) {
  const auto count = static_cast<std::uint32_t>(handles.size());
  return {{sum::delete_notifications, count}, count * 4, numbers};
}

Bytes numbers_of(const std::vector<std::uint32_t>& handles) {
  ByteWriter out;
  for (const std::uint32_t handle : handles) {
    out.u32(handle);
  }
  return out.take();
}

}  // namespace

asio::awaitable<Client::Impl::Connected> Client::Impl::connect(Self self) {
  if (self->is_open() || self->connecting) {
    co_return tl::make_unexpected(LinkError{ErrorCode::invalid_state, "already connected"});
  }
  const Flag connecting(self->connecting);
  const auto& options = self->options;
  const auto closed = self->closed;
  auto socket = co_await dial(options.host, options.tcp_port, options.connect_timeout);
  if (!socket) {
    self->closures = {};
    co_return tl::make_unexpected(explain_no_connection(
        options, options.security ? messages::secure_ads_needs(socket.error()) : socket.error()));
  }
  if (self->closed != closed) {
    co_return tl::make_unexpected(
        explain_no_connection(options, messages::closed_while_connecting()));
  }
  auto transport = co_await make_transport(self, std::move(*socket));
  if (self->closed != closed) {
    co_return tl::make_unexpected(
        explain_no_connection(options, messages::closed_while_connecting()));
  }
  if (!transport) {
    co_return tl::make_unexpected(explain_no_connection(options, transport.error()));
  }
  self->last_end = {};
  self->open(std::move(*transport));
  auto state = co_await first_answer(self);
  const auto& last = self->closures.last;
  const bool at_once = last && std::chrono::steady_clock::now() - *last < options.timeout / 4;
  if (!state || !at_once) {
    self->closures = {};
  } else {
    ++self->closures.accepted_at_once;
  }
  co_return state;
}

asio::awaitable<tl::expected<Transport, base::messages::Message>> Client::Impl::make_transport(
    Self self, asio::ip::tcp::socket socket) {
  const auto& options = self->options;
  if (!options.security) {
    co_return plain_transport(std::move(socket));
  }
  SecureHello hello{*options.security, options.source.net_id, options.handshake_timeout};
  std::function<void(std::weak_ptr<Stream>)> opened = [self](std::weak_ptr<Stream> stream) {
    self->handshaking = std::move(stream);
  };
  auto transport =
      co_await connect_securely(std::move(socket), std::move(hello), std::move(opened));
  co_return transport;
}

// A TCP connection alone proves nothing: without a route to us, a TwinCAT accepts it and closes it
// upon the first request, or does not respond.
asio::awaitable<Client::Impl::Connected> Client::Impl::first_answer(Self self) {
  const auto local_address = self->local_address();
  const auto response =
      co_await request(self, self->options.probe_port, Command::read_state, Bytes());
  const auto state = response.and_then([](const Bytes& payload) { return decode_state(payload); });
  const bool unknown = !state && state.error() == ErrorCode::service_not_supported;
  if (self->is_open() && (state || unknown)) {
    self->up = true;
    co_return state.value_or(DeviceState{});
  }
  self->disconnect();
  const auto answer = state ? ErrorCode::link_lost : state.error();
  co_return tl::make_unexpected(
      explain_no_state(self->options, answer, self->last_end, local_address));
}

template <typename T>
asio::awaitable<Result<T>> Client::Impl::ask(Self self, std::uint16_t port, Command command,
                                             Bytes payload, Result<T> (*decode)(BytesView)) {
  if (!self->up) {
    co_return tl::make_unexpected(ErrorCode::link_down);
  }
  const auto response = co_await request(self, port, command, std::move(payload));
  co_return response.and_then(decode);
}

asio::awaitable<Result<Bytes>> Client::Impl::fetch(Self self, std::uint16_t port, Command command,
                                                   Bytes payload, std::uint32_t asked) {
  if (!self->up) {
    co_return tl::make_unexpected(ErrorCode::link_down);
  }
  const auto response = co_await request(self, port, command, std::move(payload));
  const auto data =
      response.and_then([asked](const Bytes& bytes) { return decode_data(bytes, asked); });
  co_return data.map([](BytesView view) { return Bytes(view.begin(), view.end()); });
}

asio::awaitable<std::vector<Result<std::uint32_t>>> Client::Impl::subscribe(
    Self self, std::uint16_t port, std::vector<AddNotificationRequest> wanted,
    NotificationHandler handler) {
  self->inbox.expect();
  const auto closed = self->closed;
  auto answers = co_await add_in_a_sum(self, port, wanted);
  self->sums = answers.has_value();
  if (!answers && refuses_sums(answers.error())) {
    answers = co_await add_singly(self, port, wanted);
  }
  Handles handles;
  for (std::size_t i = 0; i < wanted.size() && answers; ++i) {
    handles.push_back((*answers)[i].value_or(0));
  }
  if (!self->up || self->closed != closed) {
    handles.clear();  // handles of a connection that has ended
  }
  self->inbox.add(port, handles, handler);
  if (!answers) {
    co_return std::vector<Result<std::uint32_t>>(wanted.size(),
                                                 tl::make_unexpected(answers.error()));
  }
  co_return std::move(*answers);
}

asio::awaitable<Result<std::vector<Result<std::uint32_t>>>> Client::Impl::add_in_a_sum(
    Self self, std::uint16_t port, std::vector<AddNotificationRequest> wanted) {
  const auto count = static_cast<std::uint32_t>(wanted.size());
  // The error code and the handle of one notification.
  constexpr std::uint32_t of_one = 2 * sizeof(std::uint32_t);
  const std::uint32_t length = count * of_one;
  const Bytes items = encode(wanted);
  Bytes payload = encode(ReadWriteRequest{{sum::add_notifications, count}, length, items});
  const auto answer = co_await fetch(self, port, Command::read_write, std::move(payload), length);
  co_return answer.and_then([count](const Bytes& bytes) { return decode_handles(bytes, count); });
}

asio::awaitable<std::vector<Result<std::uint32_t>>> Client::Impl::add_singly(
    Self self, std::uint16_t port, std::vector<AddNotificationRequest> wanted) {
  std::vector<Result<std::uint32_t>> answers;
  for (const AddNotificationRequest& request : wanted) {
    Bytes payload = encode(request);
    auto handle = co_await ask<std::uint32_t>(self, port, Command::add_notification,
                                              std::move(payload), &decode_handle);
    answers.push_back(handle);
    const bool for_all =
        !handle && (handle.error() == ErrorCode::service_not_supported ||
                    handle.error() == ErrorCode::no_more_handles || !is_refusal(handle.error()));
    if (for_all) {
      answers.resize(wanted.size(), handle);
      break;
    }
  }
  co_return answers;
}

asio::awaitable<void> Client::Impl::unsubscribe(Self self, std::uint16_t port, Handles handles) {
  self->inbox.remove(port, handles);
  co_await delete_notifications(self, port, std::move(handles));
}

asio::awaitable<void> Client::Impl::delete_notifications(Self self, std::uint16_t port,
                                                         Handles handles) {
  const Bytes numbers = numbers_of(handles);
  const ReadWriteRequest deletion = deletion_of(handles, numbers);
  Bytes payload = encode(deletion);
  const auto together =
      co_await fetch(self, port, Command::read_write, std::move(payload), deletion.read_length);
  if (together || !is_refusal(together.error())) {
    co_return;
  }
  for (const std::uint32_t handle : handles) {
    const DeleteNotificationRequest request{handle};
    Bytes encoded = encode(request);
    const auto deleted = co_await ask<void>(self, port, Command::delete_notification,
                                            std::move(encoded), &decode_result);
    if (!deleted && !is_refusal(deleted.error())) {
      co_return;
    }
  }
}

void Client::Impl::leave(const Resources& belongings) {
  std::vector<Requester::LastRequest> farewells;
  const auto add = [&](Command command, Bytes payload) {
    farewells.push_back({belongings.port, command, std::move(payload)});
  };
  // While the connection is down there is no peer to return the handles to.
  if (up && sums) {
    const Bytes numbers = numbers_of(belongings.notifications);
    add(Command::read_write, encode(deletion_of(belongings.notifications, numbers)));
  } else if (up) {
    for (const std::uint32_t handle : belongings.notifications) {
      add(Command::delete_notification, encode(DeleteNotificationRequest{handle}));
    }
  }
  // One by one: a controller that grants notifications in a sum may know no other sums.
  for (std::size_t i = 0; up && i < belongings.symbols.size(); ++i) {
    const Bytes data = numbers_of({belongings.symbols[i]});
    add(Command::write, encode(WriteRequest{{symbol::release_handle, 0}, data}));
  }
  ++closed;
  up = false;
  inbox.clear();
  disconnect(farewells);
}

void Client::Impl::on_notification(const Packet& packet) {
  const auto stamps = decode_notification(packet.data);
  if (!stamps || !up) {
    return;  // a malformed sample carries no value; the next one does
  }
  const auto self = std::static_pointer_cast<Impl>(shared_from_this());
  inbox.receive(packet.header.source.port, *stamps);
  // Handles of an earlier connection, or of another client with our address. Without deletion the
  // controller would send their samples for ever.
  for (const NotificationInbox::Handle& stranger : inbox.take_strangers()) {
    Handles handles(1, stranger.number);
    asio::co_spawn(executor(), delete_notifications(self, stranger.port, std::move(handles)),
                   base::program::rethrow_from_loop);
  }
}

void Client::Impl::on_end(const LinkEnd& end) {
  last_end = end;
  inbox.clear();
  const bool was_up = std::exchange(up, false);
  if (!was_up) {
    return;
  }
  // A virtual CNC that runs one NC program after the other is restarted as fast, a few times.
  constexpr unsigned suspicious = 4;
  const bool again = closures.accepted_at_once >= suspicious;
  if (end.cause == LinkEnd::Cause::closed_by_peer) {
    closures.last = std::chrono::steady_clock::now();
  } else {
    closures = {};
  }
  if (on_down) {
    on_down(explain_end(options, end, again));
  }
}

void Client::Impl::close() {
  ++closed;
  if (const auto stream = handshaking.lock(); stream && connecting) {
    boost::system::error_code ignored;
    stream->socket().close(ignored);
  }
  up = false;
  inbox.clear();
  disconnect();
}

Client::Client(asio::any_io_executor executor, ClientOptions options)
    : impl_(std::make_shared<Impl>(std::move(executor), std::move(options))) {}

Client::~Client() {
  close();
}

asio::awaitable<tl::expected<DeviceState, LinkError>> Client::connect() {
  return Impl::connect(impl_);
}

asio::awaitable<Result<DeviceInfo>> Client::info(std::uint16_t port) {
  return Impl::ask(impl_, port, Command::read_device_info, Bytes(), &decode_info);
}

asio::awaitable<Result<DeviceState>> Client::state(std::uint16_t port) {
  return Impl::ask(impl_, port, Command::read_state, Bytes(), &decode_state);
}

asio::awaitable<Result<Bytes>> Client::read(std::uint16_t port, Index index, std::uint32_t length) {
  return Impl::fetch(impl_, port, Command::read, encode(ReadRequest{index, length}), length);
}

asio::awaitable<Result<void>> Client::write(std::uint16_t port, Index index, Bytes data) {
  return Impl::ask(impl_, port, Command::write, encode(WriteRequest{index, data}), &decode_result);
}

asio::awaitable<Result<Bytes>> Client::read_write(std::uint16_t port, Index index,
                                                  std::uint32_t read_length, Bytes data) {
  return Impl::fetch(impl_, port, Command::read_write,
                     encode(ReadWriteRequest{index, read_length, data}), read_length);
}

asio::awaitable<std::vector<Result<std::uint32_t>>> Client::subscribe(
    std::uint16_t port, std::vector<AddNotificationRequest> wanted, NotificationHandler handler) {
  return Impl::subscribe(impl_, port, std::move(wanted), std::move(handler));
}

asio::awaitable<void> Client::unsubscribe(std::uint16_t port, std::vector<std::uint32_t> handles) {
  return Impl::unsubscribe(impl_, port, std::move(handles));
}

bool Client::up() const {
  return impl_->up;
}

void Client::leave(const Resources& belongings) {
  impl_->leave(belongings);
}

void Client::on_down(std::function<void(const LinkError&)> handler) {
  impl_->on_down = std::move(handler);
}

void Client::close() {
  impl_->close();
}

const Client::Counters& Client::counters() const {
  return impl_->counters();
}

}  // namespace millrace::cnc::ads
