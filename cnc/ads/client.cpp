#include "cnc/ads/client.hpp"

#include <utility>

#include "cnc/ads/dial.hpp"
#include "cnc/ads/link_words.hpp"
#include "cnc/ads/request.hpp"
#include "cnc/ads/requester.hpp"
#include "cnc/ads/response.hpp"

namespace millrace::cnc::ads {

namespace asio = boost::asio;

struct Client::Impl : std::enable_shared_from_this<Impl> {
  Impl(asio::any_io_executor executor, ClientOptions wanted)
      : options(std::move(wanted)),
        requester(std::make_shared<Requester>(std::move(executor), options)) {}

  using Self = std::shared_ptr<Impl>;
  using Connected = tl::expected<DeviceState, LinkError>;

  static asio::awaitable<Connected> connect(Self self);
  static asio::awaitable<Connected> first_answer(Self self);
  // A request whose answer is decoded to a T.
  template <typename T>
  static asio::awaitable<Result<T>> ask(Self self, std::uint16_t port, Command command,
                                        Bytes payload, Result<T> (*decode)(BytesView));
  // A request whose answer brings data.
  static asio::awaitable<Result<Bytes>> fetch(Self self, std::uint16_t port, Command command,
                                              Bytes payload, std::uint32_t asked);
  void watch_link();
  void close();

  ClientOptions options;
  std::shared_ptr<Requester> requester;
  std::function<void(const LinkError&)> on_down;
  LinkEnd last_end;
  // Counts the calls of close(), so that a connect() notices one that came while it waited.
  std::size_t closed = 0;
  bool connecting = false;
  bool up = false;
};

namespace {

// Sets a flag back when its scope is left, also when the coroutine is destroyed.
class Flag {
 public:
  explicit Flag(bool& flag) : flag_(flag) { flag_ = true; }
  ~Flag() { flag_ = false; }
  Flag(const Flag&) = delete;
  Flag& operator=(const Flag&) = delete;

 private:
  bool& flag_;
};

}  // namespace

asio::awaitable<Client::Impl::Connected> Client::Impl::connect(Self self) {
  if (self->requester->is_open() || self->connecting) {
    co_return tl::make_unexpected(LinkError{ErrorCode::invalid_state, "already connected"});
  }
  const Flag connecting(self->connecting);
  const auto& options = self->options;
  const auto closed = self->closed;
  auto socket = co_await dial(options.host, options.tcp_port, options.connect_timeout);
  if (!socket) {
    co_return tl::make_unexpected(explain_no_connection(options, socket.error()));
  }
  if (self->closed != closed) {
    co_return tl::make_unexpected(explain_no_connection(options, "closed while connecting"));
  }
  self->watch_link();
  self->requester->open(std::move(*socket));
  auto state = co_await first_answer(self);
  co_return state;
}

// The connection alone says nothing: without a route for us, a TwinCAT accepts it and closes it
// upon the first request, or stays silent.
asio::awaitable<Client::Impl::Connected> Client::Impl::first_answer(Self self) {
  const auto local_address = self->requester->local_address();
  const auto response = co_await Requester::request(self->requester, self->options.probe_port,
                                                    Command::read_state, Bytes());
  const auto state = response.and_then([](const Bytes& payload) { return decode_state(payload); });
  const bool unknown = !state && state.error() == ErrorCode::service_not_supported;
  if (self->requester->is_open() && (state || unknown)) {
    self->up = true;
    co_return state.value_or(DeviceState{});
  }
  self->requester->close();
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
  const auto response =
      co_await Requester::request(self->requester, port, command, std::move(payload));
  co_return response.and_then(decode);
}

asio::awaitable<Result<Bytes>> Client::Impl::fetch(Self self, std::uint16_t port, Command command,
                                                   Bytes payload, std::uint32_t asked) {
  if (!self->up) {
    co_return tl::make_unexpected(ErrorCode::link_down);
  }
  const auto response =
      co_await Requester::request(self->requester, port, command, std::move(payload));
  const auto data =
      response.and_then([asked](const Bytes& bytes) { return decode_data(bytes, asked); });
  co_return data.map([](BytesView view) { return Bytes(view.begin(), view.end()); });
}

void Client::Impl::watch_link() {
  last_end = {};
  requester->on_end([weak = weak_from_this()](const LinkEnd& end) {
    const auto self = weak.lock();
    if (!self) {
      return;
    }
    self->last_end = end;
    const bool was_up = std::exchange(self->up, false);
    if (was_up && self->on_down) {
      self->on_down(explain_end(self->options, end));
    }
  });
}

void Client::Impl::close() {
  ++closed;
  up = false;
  requester->close();
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

bool Client::up() const {
  return impl_->up;
}

void Client::on_down(std::function<void(const LinkError&)> handler) {
  impl_->on_down = std::move(handler);
}

void Client::close() {
  impl_->close();
}

const Client::Counters& Client::counters() const {
  return impl_->requester->counters();
}

}  // namespace millrace::cnc::ads
