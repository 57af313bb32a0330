// The client side of HTTP, as simple as a test needs it: one connection, no TLS.
//
//   HttpClient client(port);
//   client.get("/api/about").body
//
//   HttpEvents events(port, "/api/live");                   // server-sent events
//   events.await([](const HttpEvent& event) { return event.name == "snapshot"; });
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "tests/support/process.hpp"

namespace millrace::tests {

struct HttpAnswer {
  int status = 0;
  /// The whole header, unchanged.
  std::string header{};
  std::string body{};

  /// The value of a field, whose name is written as it was sent; empty without such a field.
  [[nodiscard]] std::string field(const std::string& name) const;
};

/// Throws std::runtime_error for any failure, a timeout included.
class HttpClient {
 public:
  /// `from` is the last byte of its address, 127.0.0.x.
  explicit HttpClient(std::uint16_t port, std::chrono::milliseconds timeout = patience,
                      std::uint8_t from = 1);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  HttpAnswer get(const std::string& target, const std::string& fields = "");
  /// A JSON body; `fields` are further lines of the header, each with its "\r\n".
  HttpAnswer post(const std::string& target, const std::string& body,
                  const std::string& fields = "");

  /// Sends bytes unchanged.
  void send(std::string_view bytes) const;
  /// Receives one response.
  HttpAnswer receive();
  /// More bytes; empty when the other side has ended the connection.
  std::string receive_some() const;
  /// True when the other side has ended the connection, or ends it within the timeout.
  bool is_ended() const;

 private:
  int socket_ = -1;
  std::string rest_;
};

struct HttpEvent {
  std::string name{};
  std::string data{};
};

class HttpEvents {
 public:
  HttpEvents(std::uint16_t port, const std::string& target);

  /// The next event; throws std::runtime_error if the stream ends.
  HttpEvent next();
  /// The next event for which `is_it` returns true.
  HttpEvent await(const std::function<bool(const HttpEvent&)>& is_it);

 private:
  HttpClient client_;
  std::string text_;
};

}  // namespace millrace::tests
