// millrace-mail as a process between callers on the fabric and a real mail server (aiosmtpd).
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/endpoints/data_endpoint.hpp"
#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/data.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string uuid = "b536e110-ca9e-4198-bddb-64331366bedb";

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Creates the file with its whole content at once.
void write(const fs::path& file, const std::string& text) {
  const fs::path part = file.string() + ".part";
  std::ofstream(part) << text;
  fs::rename(part, file);
}

/// A self-signed certificate for "localhost".
void make_certificate(const fs::path& certificate, const fs::path& key) {
  Process openssl({"/usr/bin/openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                   "ec_paramgen_curve:prime256v1", "-nodes", "-subj", "/CN=localhost", "-addext",
                   "subjectAltName=DNS:localhost", "-days", "2", "-keyout", key.string(), "-out",
                   certificate.string()});
  if (openssl.wait() != 0) {
    throw std::runtime_error(openssl.error_output());
  }
}

class Mail : public testing::Test {
 protected:
  Mail() {
    fs::create_directory(inbox);
    make_certificate(certificate, key);
    write(folder.path() / "password", "correct horse\n");
  }

  /// Starts the mail server; from the second time on with its previous port.
  void open_server(std::vector<std::string> options) {
    std::vector<std::string> command{"/usr/bin/python3", std::string(MILLRACE_SMTP_SERVER),
                                     inbox.string(), "--port", std::to_string(port)};
    command.insert(command.end(), options.begin(), options.end());
    server.emplace(command);
    port = std::stoi(server->await("^ready: (\\d+)").at(1));
  }
  void open_server() {
    open_server({"--cert", certificate.string(), "--key", key.string(), "--user", "press",
                 "--password", "correct horse"});
  }

  /// `more` goes into server { }.
  void configure(const std::string& more = "user: 'press' password_file: 'password'") {
    std::ostringstream text;
    text << "server { host: 'localhost' port: " << port << " ca_file: 'certificate' " << more
         << " }\n"
         << content(test_data("mail/plant.mail.textproto"));
    write(config, text.str());
  }
  void start_service() {
    sut.emplace(std::vector<std::string>{binary("millrace-mail"), "--config", config.string(),
                                         "--domain", std::to_string(domain.number())});
    sut->await("^ready: ");
    ASSERT_TRUE(caller.await_instance(uuid));
  }
  void start() {
    open_server();
    configure();
    start_service();
  }

  fabric::Reply call(const std::string& text) { return caller.call(uuid, text); }
  /// Sets the server's reply from now on; empty = it accepts.
  void answer(const std::string& what) { write(inbox / "answer", what); }

  [[nodiscard]] std::size_t accepted() const {
    std::size_t count = 0;
    while (fs::exists(inbox / (std::to_string(count + 1) + ".mail"))) {
      ++count;
    }
    return count;
  }
  std::string await_mail(std::size_t number) {
    await("mail " + std::to_string(number), [&] {
      if (!sut->running()) {
        throw std::runtime_error(sut->error_output());
      }
      return accepted() >= number;
    });
    return content(inbox / (std::to_string(number) + ".mail"));
  }

  TemporaryFolder folder;
  fs::path inbox = folder.path() / "inbox";
  fs::path config = folder.path() / "mail.textproto";
  fs::path certificate = folder.path() / "certificate";
  fs::path key = folder.path() / "key";
  int port = 0;
  Domain domain;
  Caller caller{domain.number()};
  std::optional<Process> server;
  std::optional<Process> sut;
};

TEST_F(Mail, AnswersOnceTheServerHasTheMail) {
  start();
  const fabric::Reply reply = call("done program=WELLE7 parts=12");
  EXPECT_EQ(reply.text, "OK");
  EXPECT_EQ(reply.state, 1U);
  ASSERT_EQ(accepted(), 1U);
  EXPECT_THAT(
      await_mail(1),
      AllOf(StartsWith("from press1@example.com\nto eva@example.com\nto bob@example.com\n\n"),
            HasSubstr("\r\nMessage-ID: <" + reply.call.to_string() + ".millrace@example.com>\r\n"),
            HasSubstr("\r\nSubject: WELLE7: 12 parts\r\n"),
            HasSubstr("\r\n\r\ncnc/1 has made 12 parts of WELLE7.\r\n")));
}

constexpr const char* rules =
    "rule { name: 'aborted' program: ABORTED to: 'shift' quiet_s: 0 }\n"
    "rule { name: 'served' no_instance_of: '326DE49A-633B-4cea-a9b8-1924d7f926a7' after_s: 1 "
    "to: 'shift' quiet_s: 0 }\n";

TEST_F(Mail, SendsMailsOfItsRulesWithoutACall) {
  open_server();
  configure();
  write(config, content(config) + rules);
  start_service();
  EXPECT_THAT(await_mail(1), AllOf(StartsWith("from press1@example.com\nto eva@example.com\n"),
                                   HasSubstr("\r\nSubject: 326de49a-633b")));

  fabric::dds::Participant there({.domain = domain.number()});
  fabric::endpoints::DataEndpoint machine(there);
  const fabric::ProgramEvent event{.key = {"press", 2},
                                   .kind = fabric::ProgramEventKind::aborted,
                                   .at = std::chrono::system_clock::now(),
                                   .program = "demo.nc",
                                   .error = 21462};
  ASSERT_TRUE(machine.publish(event));
  EXPECT_THAT(await_mail(2), AllOf(HasSubstr("\r\nSubject: press/2: program demo.nc aborted\r\n"),
                                   HasSubstr("Error: 21462.")));
  sut->terminate();
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();

  // The next process sees the same event again, and knows its mail.
  write(config, content(config) + "rule { name: 'ended' program: ENDED to: 'shift' }\n");
  start_service();
  await_mail(3);
  fabric::ProgramEvent ended = event;
  ended.key.channel = 1;
  ended.kind = fabric::ProgramEventKind::ended;
  ASSERT_TRUE(machine.publish(ended));
  EXPECT_THAT(await_mail(4), HasSubstr("\r\nSubject: press/1: program demo.nc ended\r\n"));
}

TEST_F(Mail, SendsOneMailAboutAFaultWithWhatToDo) {
  open_server();
  configure();
  write(config, content(config) + "rule { name: 'act' concern: ACT after_s: 0 to: 'shift' }\n");
  start_service();
  EXPECT_THAT(await_mail(1), AllOf(HasSubstr("\r\nSubject: plant: no gateway"),
                                   HasSubstr("To do, by the engineer: start millrace-gateway")));
  // The next fault has the next mail: the first one lasts, and has no other.
  const fabric::dds::Participant there({.domain = domain.number()});
  boost::asio::io_context io;
  fabric::endpoints::AlarmEndpoint faults(there, io.get_executor(),
                                          {.program = "archiver", .host = "vm", .pid = 7});
  ASSERT_TRUE(faults.raise({.key = {.kind = "archive"},
                            .level = fabric::AlarmLevel::problem,
                            .text = "the disk is full",
                            .advice = "free space on the disk"}));
  EXPECT_THAT(await_mail(2), AllOf(HasSubstr("the disk is full"),
                                   HasSubstr("To do, by the engineer: free space on the disk")));
}

TEST_F(Mail, DoesNotWaitForTheServersGoodbye) {
  start();
  answer("no goodbye");
  EXPECT_EQ(call("done program=A parts=1").state, 1U);
  EXPECT_EQ(accepted(), 1U);
}

TEST_F(Mail, SendsOtherMailsWhileTheServerStallsOnSome) {
  open_server();
  configure("user: 'press' password_file: 'password' timeout_ms: 1000");
  std::ofstream(config, std::ios::app) << "recipient { name: 'tar' address: 'tar@example.com' }\n";
  start_service();
  answer("data 451 4.7.1 greylisted");
  // The mails that will stall are first in order and in time.
  for (int number = 0; number < 3; ++number) {
    EXPECT_EQ(call("done to=tar program=A parts=1").state, 2U);
  }
  for (int number = 0; number < 10; ++number) {
    EXPECT_EQ(call("done program=B parts=2").state, 2U);
  }
  answer("stall tar@example.com");
  await_mail(10);
  answer("");
  await_mail(13);
}

TEST_F(Mail, KeepsMailsWhileTheServerIsDownAndOverARestart) {
  start();
  server->kill();
  const fabric::Reply reply = call("done program=A parts=1");
  EXPECT_THAT(reply.text, StartsWith("sent later: "));
  EXPECT_EQ(reply.state, 2U);
  sut->kill();
  ASSERT_TRUE(caller.await_no_instance(uuid));
  open_server();
  start_service();
  EXPECT_THAT(await_mail(1), HasSubstr("<" + reply.call.to_string() + ".millrace@"));
}

TEST_F(Mail, ReportsAPermanentRefusalAtOnce) {
  start();
  answer("rcpt 550 5.1.1 no such user");
  const fabric::Reply recipient = call("done program=A parts=1");
  EXPECT_EQ(recipient.text, "ERROR: the mail server refuses: 550 5.1.1 no such user");
  EXPECT_EQ(recipient.state, 14U);
  answer("data 554 5.6.0 no such content");
  EXPECT_EQ(call("done program=A parts=1").state, 14U);
  answer("");
  EXPECT_EQ(call("done program=B parts=1").state, 1U);
  EXPECT_EQ(accepted(), 1U);
}

TEST_F(Mail, SendsNoMailTwiceWhenItIsKilledBeforeTheServersConfirmation) {
  start();
  answer("hold");
  const fabric::Request request = caller.request(uuid, "done program=A parts=1");
  caller.publish(request);
  await_mail(1);
  sut->kill();
  ASSERT_TRUE(caller.await_no_instance(uuid));
  answer("");
  start_service();
  fabric::Request again = request;
  again.assigned = caller.identity(uuid).id;
  again.attempt = 2;
  caller.publish(again);
  const fabric::Reply reply = caller.await_reply(again);
  EXPECT_EQ(reply.state, 17U);
  EXPECT_THAT(reply.text, StartsWith("ERROR: sent, but no answer"));
  caller.withdraw(again);
  EXPECT_EQ(call("done program=B parts=1").state, 1U);
  EXPECT_EQ(accepted(), 2U);
}

TEST_F(Mail, DoesNotSendAgainWhenTheConnectionBreaksAfterTheMail) {
  start();
  answer("drop");
  const fabric::Reply reply = call("done program=A parts=1");
  EXPECT_EQ(reply.state, 17U);
  answer("");
  EXPECT_EQ(call("done program=B parts=1").state, 1U);
  EXPECT_EQ(accepted(), 2U);
}

TEST_F(Mail, ReportsARefusedPassword) {
  start();
  write(folder.path() / "password", "wrong horse\n");
  const fabric::Reply reply = call("done program=A parts=1");
  EXPECT_THAT(reply.text, StartsWith("ERROR: no login at the mail server: 535"));
  EXPECT_EQ(reply.state, 16U);
  // Read for each mail, so that a new password needs no restart.
  write(folder.path() / "password", "correct horse\n");
  EXPECT_EQ(call("done program=A parts=1").state, 1U);
  EXPECT_THAT(sut->error_output(), Not(HasSubstr("horse")));
}

TEST_F(Mail, SendsNothingToAServerWithoutStarttls) {
  open_server({});
  configure("");
  start_service();
  const fabric::Reply reply = call("done program=A parts=1");
  EXPECT_THAT(reply.text, StartsWith("ERROR: no safe connection to the mail server: "));
  EXPECT_EQ(reply.state, 15U);
  EXPECT_EQ(accepted(), 0U);
}

TEST_F(Mail, SendsNothingToAServerWithAnUntrustedCertificate) {
  start();
  make_certificate(folder.path() / "other", folder.path() / "other_key");
  fs::rename(folder.path() / "other", certificate);
  const fabric::Reply reply = call("done program=A parts=1");
  EXPECT_EQ(reply.state, 15U) << reply.text;
  EXPECT_EQ(accepted(), 0U);
}

TEST_F(Mail, UsesImplicitTlsIfConfigured) {
  open_server({"--cert", certificate.string(), "--key", key.string(), "--implicit", "--user",
               "press", "--password", "correct horse"});
  configure("user: 'press' password_file: 'password' starttls: IMPLICIT");
  start_service();
  const fabric::Reply reply = call("done program=A parts=1");
  EXPECT_EQ(reply.state, 1U) << reply.text;
  EXPECT_EQ(accepted(), 1U);
}

TEST_F(Mail, SendsUnencryptedOnlyIfConfigured) {
  open_server({});
  configure("starttls: OFF");
  start_service();
  EXPECT_EQ(call("done program=A parts=1").state, 1U);
}

TEST_F(Mail, AllowsNoRequestToWriteHeadersOrAddresses) {
  start();
  EXPECT_EQ(call("done program=\"A\r\nBcc: x@evil.example\" parts=1").state, 10U);
  EXPECT_EQ(call("done to=x@evil.example program=A parts=1").state, 10U);
  EXPECT_EQ(call("done to=x program=A parts=1").state, 13U);
  EXPECT_EQ(call("done program=\"A, Bcc: x@evil.example\" parts=\"\xFC\"").state, 1U);
  EXPECT_THAT(
      await_mail(1),
      AllOf(StartsWith("from press1@example.com\nto eva@example.com\nto bob@example.com\n\n"),
            Not(HasSubstr("\nBcc:")), HasSubstr("Subject: =?utf-8?Q?")));
}

TEST_F(Mail, ChecksItsConfiguration) {
  configure("user: 'press'");
  Process bad({binary("millrace-mail"), "--check", "--config", config.string()});
  EXPECT_EQ(bad.wait(), 2);
  EXPECT_THAT(bad.error_output(), HasSubstr("server: needs password_file or password_env"));
  port = 587;
  configure();
  Process good({binary("millrace-mail"), "--check", "--config", config.string()});
  EXPECT_EQ(good.wait(), 0) << good.error_output();
  EXPECT_THAT(good.output(), HasSubstr("is good: 2 templates, 1 recipients"));
  fs::remove(folder.path() / "password");
  Process no_password({binary("millrace-mail"), "--check", "--config", config.string()});
  EXPECT_EQ(no_password.wait(), 0);
  EXPECT_THAT(no_password.output(), HasSubstr("Its password cannot be read here"));
  Process not_served({binary("millrace-mail"), "--config", config.string(), "--domain",
                      std::to_string(domain.number())});
  EXPECT_EQ(not_served.wait(), 2);
  EXPECT_THAT(not_served.error_output(), HasSubstr("cannot read the password"));
}

}  // namespace
}  // namespace millrace::tests
