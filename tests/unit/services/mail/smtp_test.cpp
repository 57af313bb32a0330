// Cases of libcurl's callbacks that no real server causes; tests/integration/mail has the rest of
// SMTP.
#include "services/mail/smtp.hpp"

#include <future>
#include <stdexcept>
#include <string_view>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "base/posix/system.hpp"
#include "tests/support/await.hpp"

namespace millrace::services::mail {
namespace {

/// Accepts connections and sends nothing.
class SilentServer {
 public:
  SilentServer() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof(address);
    EXPECT_EQ(::bind(socket_.get(), any, size), 0);
    EXPECT_EQ(::listen(socket_.get(), 1), 0);
    EXPECT_EQ(::getsockname(socket_.get(), any, &size), 0);
    port_ = ntohs(address.sin_port);
  }
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] bool is_connected() const {
    pollfd waiting{.fd = socket_.get(), .events = POLLIN, .revents = 0};
    return ::poll(&waiting, 1, 0) > 0;
  }
  /// Sends its greeting, and then nothing.
  [[nodiscard]] base::posix::Fd greet() const {
    base::posix::Fd connection(::accept(socket_.get(), nullptr, nullptr));
    const std::string_view greeting = "220 test\r\n";
    EXPECT_EQ(::send(connection.get(), greeting.data(), greeting.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(greeting.size()));
    return connection;
  }
  /// Waits for the end of the first connection.
  [[nodiscard]] bool sees_the_end() const {
    const base::posix::Fd connection(::accept(socket_.get(), nullptr, nullptr));
    const timeval limit{.tv_sec = tests::await_limit.count(), .tv_usec = 0};
    ::setsockopt(connection.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    char byte = 0;
    return ::recv(connection.get(), &byte, 1, 0) == 0;
  }

 private:
  base::posix::Fd socket_;
  std::uint16_t port_ = 0;
};

// The exception passed through libcurl, which then never finished the transfer: the connection
// stayed open.
TEST(Smtp, ThrowsWhatItsWatchThrowsThroughLibcurl) {
  const SilentServer server;
  Smtp sut({.host = "127.0.0.1", .port = server.port(), .security = Security::none});
  const Transport::Watch watch{.handing_over = [] { return true; },
                               .cancelled = [&]() -> bool {
                                 if (server.is_connected()) {
                                   throw std::runtime_error("on purpose, by a test");
                                 }
                                 return false;
                               }};
  const Mail mail{.from = "a@example.com", .to = {"b@example.com"}, .message = "text\r\n"};
  try {
    static_cast<void>(sut.send(mail, watch));
    FAIL() << "the exception is lost";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "on purpose, by a test");
  }
  EXPECT_TRUE(server.sees_the_end());
}

TEST(Smtp, CountsASilentServerAsUnreachable) {
  const SilentServer server;
  Smtp sut({.host = "127.0.0.1",
            .port = server.port(),
            .security = Security::none,
            .timeout = std::chrono::milliseconds(200)});
  const Transport::Watch watch{.handing_over = [] { return true; },
                               .cancelled = [] { return false; }};
  const Mail mail{.from = "a@example.com", .to = {"b@example.com"}, .message = "text\r\n"};
  const Outcome outcome = sut.send(mail, watch);
  EXPECT_EQ(outcome.verdict, Verdict::later);
  EXPECT_FALSE(outcome.contact);
}

TEST(Smtp, ReportsThatAServerStalls) {
  const SilentServer server;
  Smtp sut({.host = "127.0.0.1",
            .port = server.port(),
            .security = Security::none,
            .timeout = std::chrono::milliseconds(500)});
  const Transport::Watch watch{.handing_over = [] { return true; },
                               .cancelled = [] { return false; }};
  const Mail mail{.from = "a@example.com", .to = {"b@example.com"}, .message = "text\r\n"};
  auto sending = std::async(std::launch::async, [&] { return sut.send(mail, watch); });
  const base::posix::Fd connection = server.greet();
  const Outcome outcome = sending.get();
  EXPECT_EQ(outcome.verdict, Verdict::later) << outcome.reply;
  EXPECT_TRUE(outcome.contact);
  EXPECT_TRUE(outcome.stalled);
}

}  // namespace
}  // namespace millrace::services::mail
