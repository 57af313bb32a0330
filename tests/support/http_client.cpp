#include "tests/support/http_client.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

namespace millrace::tests {

namespace {

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::generic_category().message(errno));
}

timeval timeval_of(std::chrono::milliseconds time) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(time);
  return {.tv_sec = seconds.count(), .tv_usec = std::chrono::microseconds(time - seconds).count()};
}

}  // namespace

std::string HttpAnswer::field(const std::string& name) const {
  const std::string mark = "\r\n" + name + ": ";
  const auto from = header.find(mark);
  if (from == std::string::npos) {
    return {};
  }
  const auto value = from + mark.size();
  return header.substr(value, header.find("\r\n", value) - value);
}

HttpClient::HttpClient(std::uint16_t port, std::chrono::milliseconds timeout, std::uint8_t from)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + from);
  if (from != 1 &&
      ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(socket_);
    fail("cannot bind to 127.0.0." + std::to_string(from));
  }
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval limit = timeval_of(timeout);
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    ::close(socket_);
    errno = error;
    fail("cannot connect to port " + std::to_string(port));
  }
}

HttpClient::~HttpClient() {
  ::close(socket_);
}

void HttpClient::send(std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0) {
      fail("cannot send");
    }
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
}

std::string HttpClient::receive_some() const {
  std::array<char, 65536> part{};
  const ssize_t got = ::recv(socket_, part.data(), part.size(), 0);
  if (got < 0) {
    fail("nothing was received");
  }
  return {part.data(), static_cast<std::size_t>(got)};
}

bool HttpClient::is_ended() const {
  std::array<char, 4096> part{};
  for (;;) {
    const ssize_t got = ::recv(socket_, part.data(), part.size(), 0);
    if (got == 0 || (got < 0 && errno == ECONNRESET)) {
      return true;
    }
    if (got < 0) {
      return false;
    }
  }
}

HttpAnswer HttpClient::receive() {
  constexpr std::string_view end_of_header = "\r\n\r\n";
  const auto more = [&] {
    const std::string part = receive_some();
    if (part.empty()) {
      throw std::runtime_error("the connection ended before the answer did: " + rest_);
    }
    rest_ += part;
  };
  while (rest_.find(end_of_header) == std::string::npos) {
    more();
  }
  HttpAnswer answer;
  answer.header = rest_.substr(0, rest_.find(end_of_header) + 2);
  rest_.erase(0, answer.header.size() + 2);
  answer.status = std::stoi(answer.header.substr(answer.header.find(' ') + 1));
  const std::string length = answer.field("Content-Length");
  const std::size_t size =
      length.empty() || answer.status == 304 ? 0 : static_cast<std::size_t>(std::stoull(length));
  while (rest_.size() < size) {
    more();
  }
  answer.body = rest_.substr(0, size);
  rest_.erase(0, size);
  return answer;
}

HttpAnswer HttpClient::get(const std::string& target, const std::string& fields) {
  send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + fields + "\r\n");
  return receive();
}

HttpAnswer HttpClient::post(const std::string& target, const std::string& body,
                            const std::string& fields) {
  send("POST " + target +
       " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: " +
       std::to_string(body.size()) + "\r\n" + fields + "\r\n" + body);
  return receive();
}

HttpEvents::HttpEvents(std::uint16_t port, const std::string& target) : client_(port) {
  client_.send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  while (text_.find("\r\n\r\n") == std::string::npos) {
    text_ += client_.receive_some();
  }
  text_.erase(0, text_.find("\r\n\r\n") + 4);
}

HttpEvent HttpEvents::next() {
  for (;;) {
    const auto end = text_.find("\n\n");
    if (end == std::string::npos) {
      const std::string part = client_.receive_some();
      if (part.empty()) {
        throw std::runtime_error("the stream of events has ended");
      }
      text_ += part;
      continue;
    }
    const std::string block = text_.substr(0, end);
    text_.erase(0, end + 2);
    const auto data = block.find("\ndata: ");
    if (block.starts_with("event: ") && data != std::string::npos) {
      return {block.substr(7, data - 7), block.substr(data + 7)};
    }
  }
}

HttpEvent HttpEvents::await(const std::function<bool(const HttpEvent&)>& is_it) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < end) {
    HttpEvent event = next();
    if (is_it(event)) {
      return event;
    }
  }
  throw std::runtime_error("the event that was waited for did not come");
}

}  // namespace millrace::tests
