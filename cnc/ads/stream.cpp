#include "cnc/ads/stream.hpp"

#include <sys/socket.h>

#include "base/loop/quietly.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
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

}  // namespace millrace::cnc::ads
