// Cases of libcurl's callbacks that no real server causes; tests/integration/mail has the rest of
// SMTP.
#include "services/mail/smtp.hpp"

#include <future>
#include <ostream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "base/posix/system.hpp"
#include "services/mail/mail.hpp"
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
  /// Sends these to the first client: the first at once, each other one after a line of it; then
  /// closes the connection.
  void answer(const std::vector<std::string_view>& replies) const {
    const base::posix::Fd connection(::accept(socket_.get(), nullptr, nullptr));
    for (std::size_t i = 0; i < replies.size(); ++i) {
      char byte = 0;
      while (i > 0 && byte != '\n' && ::recv(connection.get(), &byte, 1, 0) == 1) {
      }
      EXPECT_EQ(::send(connection.get(), replies[i].data(), replies[i].size(), MSG_NOSIGNAL),
                static_cast<ssize_t>(replies[i].size()));
    }
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

struct RefusalCase {
  const char* name;
  /// The greeting, then the replies to each command.
  std::vector<std::string_view> replies;
};

void PrintTo(const RefusalCase& refusal, std::ostream* out) {
  *out << refusal.name;
}

class ATemporaryRefusalBeforeAMail : public testing::TestWithParam<RefusalCase> {};

TEST_P(ATemporaryRefusalBeforeAMail, LetsItBeSentLater) {
  const SilentServer server;
  Smtp sut({.host = "127.0.0.1",
            .port = server.port(),
            .security = Security::starttls,
            .timeout = std::chrono::seconds(10)});
  const Transport::Watch watch{.handing_over = [] { return true; },
                               .cancelled = [] { return false; }};
  const Mail mail{.from = "a@example.com", .to = {"b@example.com"}, .message = "text\r\n"};
  auto sending = std::async(std::launch::async, [&] { return sut.send(mail, watch); });
  server.answer(GetParam().replies);
  const Outcome outcome = sending.get();
  EXPECT_EQ(outcome.verdict, Verdict::later) << outcome.reply;
  EXPECT_EQ(outcome.reply, GetParam().replies.back().substr(0, outcome.reply.size()));
}

INSTANTIATE_TEST_SUITE_P(
    , ATemporaryRefusalBeforeAMail,
    testing::Values(RefusalCase{"Greeting", {"421 closed for lunch\r\n"}},
                    RefusalCase{"Ehlo", {"220 test\r\n", "421 too many\r\n"}},
                    RefusalCase{"StartTls",
                                {"220 test\r\n", "250-test\r\n250 STARTTLS\r\n",
                                 "454 TLS not available\r\n"}}),
    [](const testing::TestParamInfo<RefusalCase>& refusal) { return refusal.param.name; });

struct OutcomeCase {
  const char* what;
  Exchange exchange;
  Verdict verdict;
};

class MailOutcome : public testing::TestWithParam<OutcomeCase> {};

TEST_P(MailOutcome, FollowsFromTheResponsesOfTheServer) {
  EXPECT_EQ(outcome_of(GetParam().exchange).verdict, GetParam().verdict) << GetParam().what;
}

INSTANTIATE_TEST_SUITE_P(
    Exchanges, MailOutcome,
    testing::Values(
        OutcomeCase{
            "taken", {.handed_over = true, .code = 250, .replied_after = true}, Verdict::accepted},
        OutcomeCase{"no contact", {.trouble = ConnectionError::no_contact}, Verdict::later},
        OutcomeCase{
            "broken before", {.trouble = ConnectionError::broken, .code = 354}, Verdict::later},
        OutcomeCase{
            "greeting 421", {.trouble = ConnectionError::broken, .code = 421}, Verdict::later},
        OutcomeCase{
            "greeting 554", {.trouble = ConnectionError::broken, .code = 554}, Verdict::refused},
        OutcomeCase{
            "recipient 550", {.trouble = ConnectionError::broken, .code = 550}, Verdict::refused},
        OutcomeCase{"message 451",
                    {.trouble = ConnectionError::broken,
                     .handed_over = true,
                     .code = 451,
                     .replied_after = true},
                    Verdict::later},
        OutcomeCase{"message 554",
                    {.trouble = ConnectionError::broken,
                     .handed_over = true,
                     .code = 554,
                     .replied_after = true},
                    Verdict::refused},
        OutcomeCase{"broken behind the message",
                    {.trouble = ConnectionError::broken, .handed_over = true, .code = 354},
                    Verdict::doubt},
        OutcomeCase{"an earlier refusal says nothing about the message",
                    {.trouble = ConnectionError::broken, .handed_over = true, .code = 502},
                    Verdict::doubt},
        OutcomeCase{
            "certificate", {.trouble = ConnectionError::tls, .code = 220}, Verdict::insecure},
        OutcomeCase{"TLS for now", {.trouble = ConnectionError::tls, .code = 454}, Verdict::later},
        OutcomeCase{
            "no TLS at all", {.trouble = ConnectionError::tls, .code = 502}, Verdict::insecure},
        OutcomeCase{"password", {.trouble = ConnectionError::login, .code = 535}, Verdict::login},
        OutcomeCase{
            "login for now", {.trouble = ConnectionError::login, .code = 454}, Verdict::later},
        OutcomeCase{"no supported login method",
                    {.trouble = ConnectionError::login, .code = 354},
                    Verdict::login}));

TEST(MailOutcome, HasTheServersTextOrTheConnectionError) {
  EXPECT_EQ(outcome_of({.trouble = ConnectionError::broken,
                        .trouble_text = "RCPT failed",
                        .code = 550,
                        .reply = "550 unknown"})
                .reply,
            "550 unknown");
  const Outcome gone =
      outcome_of({.trouble = ConnectionError::no_contact, .trouble_text = "refused"});
  EXPECT_EQ(gone.reply, "refused");
  EXPECT_FALSE(gone.contact);
}

TEST(MailOutcome, DistinguishesAStalledServerFromAnUnreachableOne) {
  const Outcome stalled = outcome_of({.trouble = ConnectionError::timeout, .code = 250});
  EXPECT_EQ(stalled.verdict, Verdict::later);
  EXPECT_TRUE(stalled.contact);
  EXPECT_TRUE(stalled.stalled);
  const Outcome silent = outcome_of({.trouble = ConnectionError::timeout});
  EXPECT_EQ(silent.verdict, Verdict::later);
  EXPECT_FALSE(silent.contact);
  EXPECT_FALSE(silent.stalled);
}

}  // namespace
}  // namespace millrace::services::mail
