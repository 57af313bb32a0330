// millrace-http as a process between callers on the fabric and a real web server.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

const std::string uuid = "1b671a64-40d5-491e-99b0-da01ff1f3341";

std::vector<std::string> lines_of(const fs::path& file) {
  std::vector<std::string> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
  }
  return lines;
}

void run(std::vector<std::string> command) {
  Process process(std::move(command));
  if (process.wait() != 0) {
    throw std::runtime_error(process.error_output());
  }
}

/// What the server at a path sends, and what the program gets.
struct Outcome {
  std::string path;
  unsigned state = 0;
  std::string text;
};

class Http : public testing::Test {
 protected:
  void start_server(const std::vector<std::string>& flags = {}) {
    std::vector<std::string> command{"/usr/bin/python3", MILLRACE_HTTP_SERVER,
                                     folder.path().string(), "--port", port};
    command.insert(command.end(), flags.begin(), flags.end());
    server.emplace(command);
    port = server->await("^ready: (\\d+)").at(1);
  }
  [[nodiscard]] std::string url(const std::string& path, const std::string& scheme = "http") const {
    return scheme + "://127.0.0.1:" + port + path;
  }
  void start_proxy() {
    proxy.emplace(std::vector<std::string>{"/usr/bin/python3", MILLRACE_HTTP_PROXY,
                                           folder.path().string(), "--port", proxy_port});
    proxy_port = proxy->await("^ready: (\\d+)").at(1);
  }
  [[nodiscard]] std::string through_proxy() const {
    return "proxy: 'http://127.0.0.1:" + proxy_port + "' ";
  }
  void refuse(const std::string& status) const {
    std::ofstream(folder.path() / "refuse") << status;
  }
  [[nodiscard]] std::vector<std::string> proxied() const {
    return lines_of(folder.path() / "proxied");
  }
  void configure(const std::string& services) {
    const fs::path part = folder.path() / "part";
    std::ofstream(part) << services;
    fs::rename(part, config);
  }
  static std::string service(const std::string& at, const std::string& more = {}) {
    return "service { uuid: '" + uuid + "' name: 'press' url: '" + at + "' health_ms: 500 " + more +
           " }\n";
  }
  /// In an environment whose proxies would be wrong.
  void start() {
    sut.emplace(std::vector<std::string>{
        "/usr/bin/env", "http_proxy=http://127.0.0.1:1", "https_proxy=http://127.0.0.1:1",
        "no_proxy=127.0.0.1", binary("millrace-http"), "--config", config.string(), "--domain",
        std::to_string(domain.number()), "--log-level", "debug"});
    sut->await("^ready: ");
  }
  /// Serves this path of the test's server.
  void serve(const std::string& path, const std::string& more = {}) {
    start_server();
    configure(service(url(path), more));
    start();
    ASSERT_TRUE(caller.await_instance(uuid));
  }
  /// Calls a service at each path twice, so that the second call finds what the first one left.
  void expect_outcomes(const std::vector<Outcome>& outcomes) {
    start_server();
    const auto uuid_of = [](std::size_t i) {
      return "7c9e6679-7425-40de-944b-" + std::to_string(i);
    };
    std::string services;
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      services += "service { uuid: '" + uuid_of(i) + "' name: 'press' url: '" +
                  url(outcomes[i].path) + "' time_limit_ms: 700 }\n";
    }
    configure(services);
    start();
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      SCOPED_TRACE(outcomes[i].path);
      ASSERT_TRUE(caller.await_instance(uuid_of(i)));
      for (int call = 0; call < 2; ++call) {
        const fabric::Reply reply = caller.call(uuid_of(i), "x");
        EXPECT_EQ(reply.state, outcomes[i].state) << reply.text;
        EXPECT_THAT(reply.text, StartsWith(outcomes[i].text));
      }
    }
  }
  void touch(const std::string& file) const { std::ofstream(folder.path() / file) << "x"; }
  [[nodiscard]] std::vector<std::string> posts() const { return lines_of(folder.path() / "posts"); }

  TemporaryFolder folder;
  fs::path config = folder.path() / "http.textproto";
  std::string port = "0";
  Domain domain;
  Caller caller{domain.number()};
  std::string proxy_port = "0";
  std::optional<Process> server;
  std::optional<Process> proxy;
  std::optional<Process> sut;
};

TEST_F(Http, AnswersWithTextAndState) {
  serve("/echo");
  const fabric::Reply echo = caller.call(uuid, "Ma\xDF 1");
  EXPECT_EQ(echo.text, "Ma\xDF 1");
  EXPECT_EQ(echo.state, 1U);
  EXPECT_EQ(caller.identity(uuid).name, "press");
  EXPECT_EQ(caller.identity(uuid).delivery, fabric::Delivery::at_most_once);
  ASSERT_THAT(posts(), SizeIs(1));
  EXPECT_THAT(posts().front(), testing::EndsWith(" 1 Maß 1 "));
  sut->terminate();
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
}

TEST_F(Http, AnswersWithAPlainText) {
  serve("/plain");
  const fabric::Reply plain = caller.call(uuid, "Ma\xDF");
  EXPECT_EQ(plain.text, "Ma\xDF");
  EXPECT_EQ(plain.state, 5U);
}

TEST_F(Http, AnswersWithWhatTheLastResponseHas) {
  serve("/plain_once");
  EXPECT_EQ(caller.call(uuid, "4").state, 5U);
  EXPECT_EQ(caller.call(uuid, "4").state, 1U);
}

TEST_F(Http, AnswersWithAnErrorIfTheResponseIsNone) {
  const std::string too_long = "ERROR: response of press: more than 65536 bytes";
  const std::string too_slow = "ERROR: press took longer than 700 ms";
  expect_outcomes({{"/wrong", 13U, "ERROR: response of press: not JSON"},
                   {"/500", 500U, "ERROR: HTTP 500: no vacuum"},
                   {"/endless", 13U, too_long},
                   {"/trickle", 11U, too_slow},
                   {"/moved", 307U, "ERROR: HTTP 307: is not followed"},
                   {"/none", 404U, "ERROR: HTTP 404"},
                   {"/loop", 11U, too_slow},
                   {"/short_length", 13U, "ERROR: response of press: not JSON"},
                   {"/long_length", 11U, too_slow},
                   {"/negative_length", 13U, "ERROR: response of press: not HTTP: "},
                   {"/many_headers", 13U, too_long},
                   {"/long_header", 13U, "ERROR: response of press: "},
                   {"/chunks", 13U, too_long},
                   {"/slow_chunks", 11U, too_slow},
                   {"/continues", 13U, too_long},
                   {"/http09", 13U, "ERROR: response of press: not HTTP: "}});
}

TEST_F(Http, AnswersWithTheResponseOfAnUnusualServer) {
  expect_outcomes({{"/no_body", 1U, ""},
                   {"/continue", 1U, "4"},
                   {"/http10", 1U, "4"},
                   {"/bom", 1U, "4"},
                   {"/early", 409U, "ERROR: HTTP 409: too early"}});
}

TEST_F(Http, ClosesTheConnectionOfACancelledCall) {
  serve("/slow", "time_limit_ms: 600000");
  const fabric::Request request = caller.request(uuid, "x");
  caller.publish(request);
  await("the request", [&] { return !posts().empty(); });
  caller.withdraw(request);
  await("the end of the connection", [&] {
    caller.attend();
    return fs::exists(folder.path() / "closed");
  });
}

TEST_F(Http, FinishesARunningCallBeforeItLeaves) {
  serve("/slow");
  const fabric::Request request = caller.request(uuid, "x");
  caller.publish(request);
  await("the request", [&] { return !posts().empty(); });
  sut->terminate();
  ASSERT_TRUE(caller.await_no_instance(uuid));
  touch("go");
  EXPECT_EQ(caller.await_reply(request).text, "x");
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
}

TEST_F(Http, LeavesWhenAnOperatorDrainsItsServices) {
  start_server();
  const std::string other_uuid = "7c9e6679-7425-40de-944b-e07fc1f90ae7";
  configure("service { uuid: '" + uuid + "' url: '" + url("/echo") + "' health_ms: 100 }\n" +
            "service { uuid: '" + other_uuid + "' url: '" + url("/plain") + "' health_ms: 100 }");
  start();
  const auto drain = [&](const std::string& service) {
    ASSERT_TRUE(caller.await_instance(service));
    run({binary("millrace"), "drain", service, "--domain", std::to_string(domain.number())});
    ASSERT_TRUE(caller.await_no_instance(service));
  };
  drain(uuid);
  EXPECT_FALSE(caller.await_instance(uuid, std::chrono::milliseconds(400))) << "after a check";
  drain(other_uuid);
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
}

TEST_F(Http, ReadsTheResultOfAnAcceptedCall) {
  serve("/job");
  const fabric::Request request = caller.request(uuid, "x");
  caller.publish(request);
  sut->await_error("is in progress: \"begun\", state 2");
  sut->await_error("is in progress: \"working\", state 2");
  touch("go");
  const fabric::Reply reply = caller.await_reply(request);
  EXPECT_EQ(reply.text, "made");
  EXPECT_EQ(reply.state, 3U);
  EXPECT_THAT(posts(), SizeIs(1));
}

TEST_F(Http, IsAnnouncedOnlyWhileItsEndpointAnswers) {
  start_server();
  configure(service(url("/echo")));
  server->kill();
  start();
  sut->await_error("the endpoint " + url("/echo") + " does not answer: .*connect to server");
  EXPECT_FALSE(caller.await_instance(uuid, std::chrono::milliseconds(300)));
  start_server();
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.call(uuid, "4").text, "4");
  server->kill();
  EXPECT_TRUE(caller.await_no_instance(uuid)) << "without a call";
}

TEST_F(Http, IsAnnouncedOnlyWhileItsHealthCheckIsGood) {
  serve("/echo", "health: '/health'");
  touch("sick");
  EXPECT_TRUE(caller.await_no_instance(uuid));
  sut->await_error("/health returns HTTP 500");
  fs::remove(folder.path() / "sick");
  EXPECT_TRUE(caller.await_instance(uuid));
}

TEST_F(Http, AppliesAChangedConfigurationWithoutARestart) {
  serve("/echo");
  // Another UUID: a call that begins while its instance leaves would find out only by a time-out.
  const std::string other_uuid = "7c9e6679-7425-40de-944b-e07fc1f90ae7";
  std::string changed = service(url("/plain"));
  changed.replace(changed.find(uuid), std::string_view(uuid).size(), other_uuid);
  configure(changed);
  ASSERT_TRUE(caller.await_instance(other_uuid)) << sut->error_output();
  EXPECT_TRUE(caller.await_no_instance(uuid));
  EXPECT_EQ(caller.call(other_uuid, "4").state, 5U);
  configure("service { }");
  sut->await_error("service.uuid: is missing");
  EXPECT_EQ(caller.call(other_uuid, "4").state, 5U) << "nothing is changed";
  configure("# nothing\n");
  EXPECT_TRUE(caller.await_no_instance(other_uuid));
}

TEST_F(Http, GoesThroughItsProxy) {
  start_proxy();
  serve("/echo", through_proxy());
  EXPECT_EQ(caller.call(uuid, "4").text, "4");
  EXPECT_THAT(proxied(), ElementsAre("POST " + url("/echo")));
  EXPECT_THAT(posts(), SizeIs(1));
}

TEST_F(Http, AnswersWithTheRefusalOfAProxy) {
  start_proxy();
  serve("/echo", through_proxy());
  refuse("403");
  const fabric::Reply reply = caller.call(uuid, "4");
  EXPECT_EQ(reply.text, "ERROR: HTTP 403: no way");
  EXPECT_EQ(reply.state, 403U);
  EXPECT_THAT(posts(), SizeIs(0));
}

TEST_F(Http, IsAnnouncedOnlyWhileItsProxyIsThere) {
  start_proxy();
  serve("/echo", through_proxy());
  proxy->kill();
  EXPECT_TRUE(caller.await_no_instance(uuid)) << "without a call";
  sut->await_error("the endpoint " + url("/echo") + " does not answer: .*port " + proxy_port);
  start_proxy();
  EXPECT_TRUE(caller.await_instance(uuid));
}

class HttpOverTls : public Http {
 protected:
  HttpOverTls() {
    make("server", "subjectAltName=IP:127.0.0.1");
    make("other", "subjectAltName=IP:127.0.0.2");
    make("client", "subjectAltName=DNS:press");
    std::ofstream(folder.path() / "token") << "abc\n";
    for (const char* const secret : {"client.key", "token"}) {
      fs::permissions(folder.path() / secret, fs::perms::owner_read | fs::perms::owner_write);
    }
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder.path() / name; }
  void make(const std::string& name, const std::string& extension) const {
    run({"/usr/bin/openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
         "ec_paramgen_curve:prime256v1", "-nodes", "-subj", "/CN=" + name, "-addext", extension,
         "-days", "2", "-keyout", file(name + ".key"), "-out", file(name + ".pem")});
  }
};

TEST_F(HttpOverTls, ProvesWhoItIs) {
  start_server({"--cert", file("server.pem"), "--key", file("server.key"), "--client-ca",
                file("client.pem")});
  configure(service(url("/echo", "https"),
                    "ca_file: 'server.pem' certificate_file: 'client.pem' key_file: 'client.key' "
                    "bearer_token_file: 'token'"));
  start();
  ASSERT_TRUE(caller.await_instance(uuid)) << sut->error_output();
  EXPECT_EQ(caller.call(uuid, "4").text, "4");
  EXPECT_THAT(posts(), ElementsAre(testing::EndsWith(" 1 4 Bearer abc")));
}

TEST_F(HttpOverTls, DoesNotServeWithAWrongCertificate) {
  start_server({"--cert", file("server.pem"), "--key", file("server.key")});
  configure(service(url("/echo", "https"), "ca_file: 'other.pem'"));
  start();
  sut->await_error("does not answer: .*certificate problem");
  start_server({"--cert", file("other.pem"), "--key", file("other.key")});
  sut->await_error("does not answer: .*(127.0.0.1|host name|subject)");
  EXPECT_FALSE(caller.await_instance(uuid, std::chrono::milliseconds(300)));
  EXPECT_THAT(posts(), SizeIs(0));
}

TEST_F(HttpOverTls, GoesThroughItsProxy) {
  start_proxy();
  start_server({"--cert", file("server.pem"), "--key", file("server.key")});
  configure(service(url("/echo", "https"), "ca_file: 'server.pem' " + through_proxy()));
  refuse("407");
  start();
  sut->await_error("the endpoint " + url("/echo", "https") + " does not answer: .*407");
  EXPECT_FALSE(caller.await_instance(uuid, std::chrono::milliseconds(300)));
  fs::remove(folder.path() / "refuse");
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.call(uuid, "4").text, "4");
  EXPECT_THAT(proxied(), testing::Each("CONNECT 127.0.0.1:" + port));
}

TEST_F(HttpOverTls, DoesNotStartWithASecretThatOtherUsersCanRead) {
  fs::permissions(folder.path() / "token", fs::perms::others_read, fs::perm_options::add);
  configure(service("https://127.0.0.1:1", "bearer_token_file: 'token'"));
  Process started({binary("millrace-http"), "--config", config.string()});
  EXPECT_EQ(started.wait(), 2);
  EXPECT_THAT(started.error_output(), HasSubstr("token: is a secret, and all users of this host"));
  Process checked({binary("millrace-http"), "--config", config.string(), "--check"});
  EXPECT_EQ(checked.wait(), 0);
  EXPECT_EQ(checked.output(), config.string() + " is good: 1 UUID with 1 URL\n");
  EXPECT_THAT(checked.error_output(), HasSubstr("warning: the service needs a file"));
}

}  // namespace
}  // namespace millrace::tests
