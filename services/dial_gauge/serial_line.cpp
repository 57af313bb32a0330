#include "services/dial_gauge/serial_line.hpp"

#include <array>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/serial_port.hpp>
#include <boost/asio/steady_timer.hpp>

namespace millrace::services::dial_gauge {

namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// 8 data bits, no parity, 1 stop bit, no flow control, as receivers of this kind use.
error_code configure(asio::serial_port& port, unsigned baud_rate) {
  using Port = asio::serial_port_base;
  error_code error;
  port.set_option(Port::baud_rate(baud_rate), error);
  if (!error) {
    port.set_option(Port::character_size(8), error);
  }
  if (!error) {
    port.set_option(Port::parity(Port::parity::none), error);
  }
  if (!error) {
    port.set_option(Port::stop_bits(Port::stop_bits::one), error);
  }
  if (!error) {
    port.set_option(Port::flow_control(Port::flow_control::none), error);
  }
  return error;
}

}  // namespace

/// Outlives the SerialLine until its last handler has run; a stopped session calls no listener.
class SerialLine::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(const asio::any_io_executor& executor, LineConfig config, SerialLineListener& listener)
      : config_(std::move(config)), listener_(&listener), port_(executor), timer_(executor) {}

  void open() {
    if (listener_ == nullptr) {
      return;
    }
    error_code error;
    port_.open(config_.device, error);
    if (!error) {
      error = configure(port_, config_.baud_rate);
    }
    if (error) {
      fail(error);
      return;
    }
    reported_closed_ = false;
    listener_->on_opened();
    read();
  }

  void stop() {
    listener_ = nullptr;
    error_code ignored;
    port_.close(ignored);
    timer_.cancel();
  }

 private:
  void read() {
    port_.async_read_some(asio::buffer(bytes_),
                          [self = shared_from_this()](const error_code& error, std::size_t size) {
                            self->on_read(error, size);
                          });
  }

  void on_read(const error_code& error, std::size_t size) {
    if (listener_ == nullptr) {
      return;
    }
    if (error) {
      fail(error);
      return;
    }
    listener_->on_bytes({bytes_.data(), size});
    read();
  }

  void fail(const error_code& error) {
    error_code ignored;
    port_.close(ignored);
    if (!std::exchange(reported_closed_, true)) {
      listener_->on_closed(config_.device + ": " + error.message());
    }
    timer_.expires_after(config_.reopen);
    timer_.async_wait([self = shared_from_this()](const error_code& cancelled) {
      if (!cancelled) {
        self->open();
      }
    });
  }

  LineConfig config_;
  SerialLineListener* listener_;
  asio::serial_port port_;
  asio::steady_timer timer_;
  std::array<char, 256> bytes_{};
  bool reported_closed_ = false;
};

SerialLine::SerialLine(const asio::any_io_executor& executor, LineConfig config,
                       SerialLineListener& listener)
    : session_(std::make_shared<Session>(executor, std::move(config), listener)) {
  asio::post(executor, [session = session_] { session->open(); });
}

SerialLine::~SerialLine() {
  session_->stop();
}

}  // namespace millrace::services::dial_gauge
