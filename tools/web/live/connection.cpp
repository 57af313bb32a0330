#include "tools/web/live/connection.hpp"

#include <algorithm>
#include <array>

#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/stream_traits.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <unistd.h>

#include "base/loop/loop.hpp"
#include "tools/web/live/messages.hpp"

namespace millrace::tools::web::live {

namespace {

namespace asio = boost::asio;
using base::loop::quietly;
namespace beast = boost::beast;
using boost::system::error_code;

constexpr std::size_t most_header = std::size_t{16} * 1024;
/// Enough for a login or an action.
constexpr std::size_t most_body = std::size_t{16} * 1024;
constexpr std::size_t part_of_a_file = std::size_t{256} * 1024;
/// While a worker handles the request. The slowest work, reading a large recording, has no other
/// limit.
constexpr auto patience_for_work = std::chrono::minutes(10);
/// From the last byte to the end of the connection: time for the browser to read it.
constexpr auto patience_for_goodbye = std::chrono::seconds(2);

using Parser = beast::http::request_parser<beast::http::string_body>;

/// The response to a request that cannot be read; nothing if the connection is over.
std::optional<http::Response> answer_to(const error_code& error) {
  using Error = beast::http::error;
  if (error == Error::header_limit) {
    return http::error_response(431, "the header of this request is too long; it may have 16 KiB");
  }
  if (error == Error::body_limit) {
    return http::error_response(413, "this request is too long; it may have 16 KiB");
  }
  const bool is_over = error.category() != beast::http::make_error_code(Error()).category() ||
                       error == Error::end_of_stream || error == Error::partial_message;
  if (is_over) {
    return std::nullopt;  // The browser, a timeout or the network ended the connection.
  }
  return http::error_response(400, "this is not an HTTP request: " + error.message());
}

template <typename Stream>
class BrowserConnection : public Connection,
                          public std::enable_shared_from_this<BrowserConnection<Stream>> {
 public:
  template <typename... Arguments>
  BrowserConnection(Shared& shared, std::string peer, Arguments&&... arguments)
      : shared_(shared),
        peer_(std::move(peer)),
        stream_(std::forward<Arguments>(arguments)...),
        news_(stream_.get_executor()) {}

  asio::awaitable<void> run() override {
    bool go_on = true;
    if constexpr (is_tls) {
      tcp().expires_after(shared_.options.time_to_ask);
      const auto [error] =
          co_await stream_.async_handshake(asio::ssl::stream_base::server, quietly);
      go_on = !error;
    }
    while (go_on) {
      go_on = co_await answer_one();
    }
    co_await send_close();
    close();
  }

  void close() override {
    closed_ = true;
    tcp().close();
    news_.cancel();
  }

  [[nodiscard]] std::optional<std::chrono::steady_clock::time_point> idle_since() const override {
    return idle_since_;
  }
  [[nodiscard]] const std::string& peer() const override { return peer_; }

 private:
  static constexpr bool is_tls = !std::is_same_v<Stream, beast::tcp_stream>;

  beast::tcp_stream& tcp() { return beast::get_lowest_layer(stream_); }

  /// True if another request may follow.
  asio::awaitable<bool> answer_one() {
    Parser parser;
    parser.header_limit(most_header);
    parser.body_limit(most_body);
    idle_since_ = std::chrono::steady_clock::now();
    tcp().expires_after(shared_.options.time_to_ask);
    const auto [error, size] = co_await beast::http::async_read(stream_, buffer_, parser, quietly);
    idle_since_.reset();
    if (error) {
      if (const auto words = answer_to(error)) {
        const AnswerHead last{.keep_alive = false};
        co_await write(*words, last);
      }
      co_return false;
    }
    ++shared_.counts.requests;
    const Message message = parser.release();
    if (!has_known_length(message)) {
      const AnswerHead last{.keep_alive = false};
      co_await write(http::error_response(501, "only Transfer-Encoding: chunked is understood"),
                     last);
      co_return false;
    }
    client_ = client_of(message, peer_, shared_.options.trusted_proxies);
    const http::Request request = request_of(message, client_);
    const AnswerHead head{.keep_alive = message.keep_alive(),
                          .with_body = message.method() != beast::http::verb::head};
    const fabric::Moment now{std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
    http::Outcome outcome = shared_.site.answer(request, now);
    if (auto* later = std::get_if<http::Later>(&outcome)) {
      http::Later work = std::move(*later);
      http::Response response = co_await wait_for(std::move(work));
      outcome = std::move(response);
    }
    if (auto* download = std::get_if<http::Download>(&outcome)) {
      const bool sent = co_await send(std::move(*download), head);
      co_return sent;
    }
    if (std::holds_alternative<http::StreamLive>(outcome)) {
      co_await stream_live(head);
      co_return false;
    }
    const bool written = co_await write(std::get<http::Response>(outcome), head);
    co_return written;
  }

  asio::awaitable<http::Response> wait_for(http::Later later) {
    auto answer = std::make_shared<std::optional<http::Response>>();
    asio::steady_timer& news = news_;
    news.expires_after(patience_for_work);
    tcp().expires_never();
    const auto self = this->shared_from_this();
    const bool taken =
        shared_.workers.run(std::move(later), [answer, self](http::Response response) {
          *answer = std::move(response);
          self->news_.cancel();
        });
    if (!taken) {
      co_return http::error_response(503, "the server is busy; try again in a few seconds");
    }
    co_await news.async_wait(quietly);
    if (!*answer) {
      co_return http::error_response(503, "the request took too long; try again later");
    }
    co_return std::move(**answer);
  }

  asio::awaitable<bool> write(http::Response response, AnswerHead head) {
    head.length = response.body->size();
    const std::string text = head_text(response, head);
    std::array<asio::const_buffer, 2> parts{
        asio::buffer(text), head.with_body ? asio::buffer(*response.body) : asio::const_buffer()};
    tcp().expires_after(shared_.options.time_to_read);
    const auto [error, size] = co_await asio::async_write(stream_, parts, quietly);
    co_return !error && head.keep_alive;
  }

  asio::awaitable<bool> send(http::Download download, AnswerHead head) {
    const http::Response response{
        .content_type = "application/octet-stream",
        .headers = {{"Content-Disposition", attachment_header(download.name)},
                    {"Cache-Control", "no-store"}}};
    head.length = download.size;
    const std::string text = head_text(response, head);
    tcp().expires_after(shared_.options.time_to_read);
    const auto [error, size] = co_await asio::async_write(stream_, asio::buffer(text), quietly);
    std::uint64_t sent = error || !head.with_body ? download.size : 0;
    std::string part(part_of_a_file, '\0');
    while (sent < download.size) {
      const ssize_t got = ::pread(
          download.file.get(), part.data(),
          static_cast<std::size_t>(std::min<std::uint64_t>(part.size(), download.size - sent)),
          static_cast<off_t>(sent));
      if (got <= 0) {
        co_return false;  // The file was truncated: the browser sees that bytes are missing.
      }
      tcp().expires_after(shared_.options.time_to_read);
      const auto bytes = asio::buffer(part.data(), static_cast<std::size_t>(got));
      const auto [failed, written] = co_await asio::async_write(stream_, bytes, quietly);
      if (failed) {
        co_return false;
      }
      sent += static_cast<std::uint64_t>(got);
    }
    co_return !error && head.keep_alive;
  }

  asio::awaitable<void> stream_live(AnswerHead head) {
    const std::shared_ptr<Feed> feed = shared_.feeds.open(client_);
    if (!feed) {
      const http::Response full =
          http::error_response(503, "too many browsers are connected; close some of them");
      co_await write(full, head);
      co_return;
    }
    http::Response response{.content_type = "text/event-stream",
                            .headers = {{"Cache-Control", "no-store"},
                                        // A buffering proxy would deliver late.
                                        {"X-Accel-Buffering", "no"}}};
    head.keep_alive = false;
    head.is_endless = true;
    const std::string beginning =
        head_text(response, head) + "retry: 1000\n\n" + shared_.greeting();
    feed->on_news([this] { news_.cancel(); });
    bool well = co_await write_bytes(asio::buffer(beginning));
    while (well && head.with_body && !closed_) {
      const Feed::Text text = feed->take();
      if (text) {
        well = co_await write_bytes(asio::buffer(*text));
      } else if (feed->has_ended()) {
        break;
      } else {
        news_.expires_after(std::chrono::hours(1));
        co_await news_.async_wait(quietly);
      }
    }
    feed->on_news(nullptr);
  }

  asio::awaitable<bool> write_bytes(asio::const_buffer bytes) {
    tcp().expires_after(shared_.options.time_to_read);
    const auto [error, size] = co_await asio::async_write(stream_, bytes, quietly);
    if (error == beast::error::timeout) {
      ++shared_.counts.dropped;
      shared_.log->info("{}: the browser does not read its events; the connection is closed",
                        client_);
    }
    co_return !error;
  }

  /// Reads on until the browser closes: with unread bytes the kernel would reset the connection,
  /// and the browser would lose the response.
  asio::awaitable<void> send_close() {
    if (closed_) {
      co_return;
    }
    tcp().expires_after(patience_for_goodbye);
    if constexpr (is_tls) {
      co_await stream_.async_shutdown(quietly);
    }
    error_code ignored;
    tcp().socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    std::array<char, 4096> rest{};
    std::size_t read = 0;
    while (read < most_header * 64) {
      const auto [error, size] = co_await tcp().async_read_some(asio::buffer(rest), quietly);
      if (error) {
        co_return;
      }
      read += size;
    }
  }

  Shared& shared_;
  std::string peer_;
  /// Of the last request: the peer, or the client of a trusted proxy.
  std::string client_;
  Stream stream_;
  beast::flat_buffer buffer_;
  /// Expires early when there is an event or a response.
  asio::steady_timer news_;
  /// A handshake counts.
  std::optional<std::chrono::steady_clock::time_point> idle_since_ =
      std::chrono::steady_clock::now();
  bool closed_ = false;
};

using PlainStream = beast::tcp_stream;
using TlsStream = asio::ssl::stream<beast::tcp_stream>;

}  // namespace

std::shared_ptr<Connection> make_connection(asio::ip::tcp::socket socket, asio::ssl::context* tls,
                                            Shared& shared) {
  error_code error;
  const auto endpoint = socket.remote_endpoint(error);
  std::string peer = error ? std::string("unknown address") : endpoint.address().to_string();
  if (tls == nullptr) {
    return std::make_shared<BrowserConnection<PlainStream>>(shared, std::move(peer),
                                                            std::move(socket));
  }
  return std::make_shared<BrowserConnection<TlsStream>>(shared, std::move(peer),
                                                        beast::tcp_stream(std::move(socket)), *tls);
}

}  // namespace millrace::tools::web::live
