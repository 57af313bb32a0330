#include "cnc/ads/stream.hpp"

#include <boost/asio/connect.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <sys/socket.h>

#include "base/loop/loop.hpp"
#include "base/messages/catalogue.hpp"

namespace millrace::cnc::ads {

namespace {

namespace asio = boost::asio;
namespace messages = base::messages;
using base::loop::quietly;

class PlainStream final : public Stream {
 public:
  explicit PlainStream(Socket socket) : socket_(std::move(socket)) {}

  asio::awaitable<Moved> read_some(asio::mutable_buffer buffer) override {
    return socket_.async_read_some(buffer, quietly);
  }
  asio::awaitable<Moved> write_some(asio::const_buffer bytes) override {
    return socket_.async_write_some(bytes, quietly);
  }
  void send_now(BytesView bytes) override {
    constexpr int now = MSG_DONTWAIT | MSG_NOSIGNAL;
    static_cast<void>(::send(socket_.native_handle(), bytes.data(), bytes.size(), now));
  }
  Socket& socket() override { return socket_; }

 private:
  Socket socket_;
};

}  // namespace

std::unique_ptr<Stream> plain_stream(Stream::Socket socket) {
  boost::system::error_code ignored;  // the first read reports a closed socket
  socket.set_option(asio::ip::tcp::no_delay(true), ignored);
  return std::make_unique<PlainStream>(std::move(socket));
}

Transport plain_transport(Stream::Socket socket) {
  return {plain_stream(std::move(socket)), Framing::ams_tcp};
}

namespace {

using asio::ip::tcp;
using boost::system::error_code;

// State that a dial shares with the handlers of its steps. A resolver cannot be interrupted: its
// handler may run long after dial() has returned.
struct Dial {
  explicit Dial(const asio::any_io_executor& executor, std::chrono::milliseconds timeout)
      : resolver(executor), socket(executor), progress(executor, timeout) {}

  tcp::resolver resolver;
  tcp::socket socket;
  // Expires at the deadline; cancelled when a step is done.
  asio::steady_timer progress;
  bool done = false;
  error_code error;
  tcp::resolver::results_type endpoints;

  void step_done(error_code result) {
    done = true;
    error = result;
    progress.cancel();
  }
};

void resolve(const std::shared_ptr<Dial>& dial, const std::string& host, std::uint16_t tcp_port) {
  dial->done = false;
  dial->resolver.async_resolve(
      host, std::to_string(tcp_port),
      [dial](error_code error, const tcp::resolver::results_type& endpoints) {
        dial->endpoints = endpoints;
        dial->step_done(error);
      });
}

void connect(const std::shared_ptr<Dial>& dial) {
  dial->done = false;
  asio::async_connect(dial->socket, dial->endpoints,
                      [dial](error_code error, const tcp::endpoint&) { dial->step_done(error); });
}

}  // namespace

asio::awaitable<Dialled> dial(std::string host, std::uint16_t tcp_port,
                              std::chrono::milliseconds timeout) {
  const auto executor = co_await asio::this_coro::executor;
  const auto dial = std::make_shared<Dial>(executor, timeout);
  resolve(dial, host, tcp_port);
  co_await dial->progress.async_wait(quietly);
  if (!dial->done) {
    co_return tl::make_unexpected(messages::name_not_resolved_in(timeout.count()));
  }
  if (dial->error) {
    co_return tl::make_unexpected(messages::name_not_resolved(dial->error.message()));
  }
  connect(dial);
  co_await dial->progress.async_wait(quietly);
  if (!dial->done) {
    error_code ignored;
    dial->socket.close(ignored);
    co_return tl::make_unexpected(messages::no_connection_in(timeout.count()));
  }
  if (dial->error) {
    co_return tl::make_unexpected(messages::no_router(dial->error.message()));
  }
  co_return std::move(dial->socket);
}

}  // namespace millrace::cnc::ads
