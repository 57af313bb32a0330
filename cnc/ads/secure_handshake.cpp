#include "cnc/ads/secure_handshake.hpp"

#include <algorithm>

#include <boost/asio/error.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include "base/loop/loop.hpp"
#include "base/messages/catalogue.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
namespace messages = base::messages;
using base::loop::quietly;
using boost::system::error_code;
using messages::Message;

/// Closes a stream at the end of its time, unless it is destroyed before.
class Deadline {
 public:
  Deadline(Stream& stream, std::chrono::milliseconds time)
      : state_(std::make_shared<State>(stream, time)) {
    state_->timer.async_wait([state = state_](error_code error) {
      if (!error && state->stream != nullptr) {
        state->passed = true;
        error_code ignored;
        state->stream->socket().close(ignored);
      }
    });
  }
  ~Deadline() {
    state_->stream = nullptr;
    state_->timer.cancel();
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  [[nodiscard]] bool passed() const { return state_->passed; }

 private:
  struct State {
    State(Stream& the_stream, std::chrono::milliseconds time)
        : stream(&the_stream), timer(the_stream.socket().get_executor(), time) {}
    Stream* stream;
    asio::steady_timer timer;
    bool passed = false;
  };
  std::shared_ptr<State> state_;
};

asio::awaitable<error_code> write_all(Stream& stream, Bytes bytes) {
  auto rest = asio::buffer(std::as_const(bytes));
  while (rest.size() > 0) {
    const auto [error, size] = co_await stream.write_some(rest);
    if (error) {
      co_return error;
    }
    rest += size;
  }
  co_return error_code{};
}

/// Reads until the buffer is full.
asio::awaitable<error_code> read_all(Stream& stream, asio::mutable_buffer rest) {
  while (rest.size() > 0) {
    const auto [error, size] = co_await stream.read_some(rest);
    if (error) {
      co_return error;
    }
    rest += size;
  }
  co_return error_code{};
}

std::string host_name() {
  error_code error;
  const auto name = asio::ip::host_name(error);
  return error ? std::string() : name;
}

bool closed(error_code error) {
  return error == asio::error::eof || error == asio::error::connection_reset ||
         error == asio::ssl::error::stream_truncated;
}

/// The TLS alert that the other side has sent; 0 if there is none.
int alert_of(error_code error) {
  if (error.category() != asio::error::get_ssl_category()) {
    return 0;
  }
  const int reason = ERR_GET_REASON(static_cast<unsigned long>(error.value()));
  return reason > SSL_AD_REASON_OFFSET ? reason - SSL_AD_REASON_OFFSET : 0;
}

Message message_of_alert(int alert) {
  switch (alert) {
    case SSL_AD_BAD_CERTIFICATE:
    case SSL_AD_UNSUPPORTED_CERTIFICATE:
    case SSL_AD_CERTIFICATE_UNKNOWN:
    case SSL_AD_UNKNOWN_CA:
      return messages::refuses_our_certificate();
    case SSL_AD_CERTIFICATE_EXPIRED:
      return messages::our_certificate_has_expired();
    case SSL_AD_HANDSHAKE_FAILURE:
    case SSL_AD_INSUFFICIENT_SECURITY:
      return messages::no_suite_for_certificates();
    default:
      return {};
  }
}

Message message_of_alert(int alert, const Psk& psk) {
  switch (alert) {
    case SSL_AD_UNKNOWN_PSK_IDENTITY:
      return messages::psk_identity_unknown(psk.identity);
    case SSL_AD_DECRYPT_ERROR:
    case SSL_AD_BAD_RECORD_MAC:
      return messages::psk_differs(psk.identity);
    case SSL_AD_HANDSHAKE_FAILURE:
    case SSL_AD_INSUFFICIENT_SECURITY:
      return messages::no_suite_for_psk();
    default:
      return {};
  }
}

Message why_no_tls(error_code error, const TlsStream& stream, const Security& security) {
  if (!stream.peer().refusal.empty()) {
    return stream.peer().refusal;
  }
  if (closed(error)) {
    return messages::closed_during_handshake();
  }
  const int alert = alert_of(error);
  const auto* const psk = std::get_if<Psk>(&security);
  const Message reason = psk != nullptr ? message_of_alert(alert, *psk) : message_of_alert(alert);
  return reason.empty() ? messages::no_tls(error.message()) : messages::tls_alert(reason, alert);
}

Message message_of(ConnectError error) {
  switch (error) {
    case ConnectError::version:
      return messages::other_secure_ads_version();
    case ConnectError::common_name:
      return messages::our_common_name_differs();
    case ConnectError::unknown_certificate:
      return messages::our_certificate_unknown();
    case ConnectError::unknown_user:
      return messages::host_unknown();
    default:
      return messages::host_refused();
  }
}

/// Why the controller refused our TlsConnectInfo; empty if frames may follow.
Message why_refused(BytesView bytes) {
  const auto answer = decode_connect_info(bytes);
  if (!answer) {
    return messages::broken_connect_info(answer.error().message);
  }
  if ((answer->flags & connect_flags::response) == 0) {
    return messages::no_connect_info();
  }
  return answer->error == ConnectError::none
             ? Message()
             : messages::tls_connect_info_error(message_of(answer->error), describe(answer->error));
}

ConnectInfo request_of(const SecureHello& hello) {
  ConnectInfo request{.net_id = hello.source, .host = host_name()};
  if (std::holds_alternative<SelfSigned>(hello.security)) {
    request.flags = connect_flags::self_signed;
  }
  if (hello.add_route) {
    // A route to our IP address, so that the controller need not resolve a name.
    request.flags |=
        connect_flags::add_route | connect_flags::ip_address | connect_flags::ignore_common_name;
    request.user = hello.add_route->user;
    request.password = hello.add_route->password;
  }
  return request;
}

/// The steps of a client after the TCP connection; returns an empty message on success.
asio::awaitable<Message> send_hello(TlsStream& stream, const SecureHello& hello) {
  const Deadline deadline(stream, hello.timeout);
  auto error = co_await stream.handshake();
  if (deadline.passed()) {
    co_return messages::no_handshake_in(hello.timeout.count());
  }
  if (error) {
    co_return why_no_tls(error, stream, hello.security);
  }
  Bytes request = encode(request_of(hello));
  error = co_await write_all(stream, std::move(request));
  Bytes answer(connect_info_size);
  if (!error) {
    const auto buffer = asio::buffer(answer);
    error = co_await read_all(stream, buffer);
  }
  if (deadline.passed()) {
    co_return messages::no_connect_info_in(hello.timeout.count());
  }
  if (error && !closed(error)) {
    co_return error.message();
  }
  if (error) {
    co_return messages::secure_route_missing(hello.source.to_string());
  }
  co_return why_refused(answer);
}

Bytes answer_to(ConnectError error, const SecureWelcome& welcome) {
  ConnectInfo answer{.flags = connect_flags::response,
                     .error = error,
                     .net_id = welcome.source,
                     .host = host_name()};
  if (welcome.faults.answer != ConnectError::none) {
    answer.error = welcome.faults.answer;
  }
  if (answer.error == ConnectError::none) {
    answer.flags |= connect_flags::ams_allowed;
  }
  Bytes bytes = encode(answer);
  if (welcome.faults.garbage) {
    std::ranges::fill(bytes, std::uint8_t{0xA5});
  }
  bytes.resize(bytes.size() - std::min(bytes.size(), welcome.faults.missing_bytes));
  return bytes;
}

asio::awaitable<tl::expected<ConnectInfo, std::string>> receive_hello(Stream& stream) {
  Bytes bytes(connect_info_size);
  auto buffer = asio::buffer(bytes);
  auto error = co_await read_all(stream, buffer);
  if (error) {
    co_return tl::make_unexpected(fmt::format("no TlsConnectInfo: {}", error.message()));
  }
  const auto size = connect_info_length(bytes);
  if (!size) {
    co_return tl::make_unexpected(size.error().message);
  }
  bytes.resize(*size);
  buffer = asio::buffer(bytes) + connect_info_size;
  error = co_await read_all(stream, buffer);
  if (error) {
    co_return tl::make_unexpected(fmt::format("half a TlsConnectInfo: {}", error.message()));
  }
  const auto info = decode_connect_info(bytes);
  if (!info) {
    co_return tl::make_unexpected(info.error().message);
  }
  co_return *info;
}

/// The steps of a server after the TCP connection.
asio::awaitable<tl::expected<NetId, std::string>> answer_hello(TlsStream& stream,
                                                               const SecureWelcome& welcome) {
  using Refused = tl::unexpected<std::string>;
  const Deadline deadline(stream, welcome.timeout);
  const auto late = fmt::format("no TLS and TlsConnectInfo in {} ms", welcome.timeout.count());
  if (welcome.faults.handshake_delay.count() > 0) {
    asio::steady_timer delay(stream.socket().get_executor(), welcome.faults.handshake_delay);
    co_await delay.async_wait(quietly);
  }
  auto error = co_await stream.handshake();
  if (error) {
    const std::string refusal = stream.peer().refusal;
    co_return Refused(deadline.passed() ? late
                      : refusal.empty() ? fmt::format("no TLS: {}", error.message())
                                        : refusal);
  }
  if (welcome.faults.close_after_handshake) {
    co_return Refused("closed after the handshake (fault)");
  }
  const auto request = co_await receive_hello(stream);
  if (!request) {
    co_return Refused(deadline.passed() ? late : request.error());
  }
  const auto decision = welcome.admit(*request, stream.peer());
  Bytes answer = answer_to(decision, welcome);
  const auto decoded = decode_connect_info(answer);
  error = co_await write_all(stream, std::move(answer));
  if (error) {
    co_return Refused(error.message());
  }
  if (!decoded) {
    std::uint8_t more = 0;  // the client waits for the missing bytes
    const auto buffer = asio::buffer(&more, 1);
    co_await read_all(stream, buffer);
    co_return Refused("answered with something other than a TlsConnectInfo (fault)");
  }
  if (decoded->error != ConnectError::none) {
    co_return Refused(fmt::format("refused with {}", describe(decoded->error)));
  }
  co_return request->net_id;
}

}  // namespace

asio::awaitable<tl::expected<Transport, Message>> connect_securely(
    Stream::Socket socket, SecureHello hello, std::function<void(std::weak_ptr<Stream>)> opened) {
  const auto context = TlsContext::client(hello.security);
  if (!context) {
    co_return tl::make_unexpected(Message(context.error()));
  }
  const std::shared_ptr<TlsStream> stream = context->stream(std::move(socket));
  opened(stream);
  const auto refused = co_await send_hello(*stream, hello);
  if (!refused.empty()) {
    co_return tl::make_unexpected(refused);
  }
  co_return Transport{stream, Framing::headerless};
}

asio::awaitable<tl::expected<std::string, Message>> ask_fingerprint(
    Stream::Socket socket, SelfSigned shown, std::chrono::milliseconds timeout) {
  shown.fingerprint.clear();  // matches no certificate, so the handshake fails
  const Security security = std::move(shown);
  const auto context = TlsContext::client(security);
  if (!context) {
    co_return tl::make_unexpected(Message(context.error()));
  }
  const auto stream = context->stream(std::move(socket));
  const Deadline deadline(*stream, timeout);
  const auto error = co_await stream->handshake();
  if (!stream->peer().fingerprint.empty()) {
    co_return stream->peer().fingerprint;
  }
  co_return tl::make_unexpected(why_no_tls(error, *stream, security));
}

asio::awaitable<tl::expected<AcceptedClient, std::string>> welcome_securely(Stream::Socket socket,
                                                                            SecureWelcome welcome) {
  const std::shared_ptr<TlsStream> stream = welcome.context.stream(std::move(socket));
  welcome.opened(stream);
  const auto client = co_await answer_hello(*stream, welcome);
  if (!client) {
    co_return tl::make_unexpected(client.error());
  }
  co_return AcceptedClient{Transport{stream, Framing::headerless}, *client};
}

}  // namespace millrace::cnc::ads
