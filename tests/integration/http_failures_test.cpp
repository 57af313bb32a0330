// The failures of a web server, of its connection and of millrace-http, under an NC program: no
// call is lost, and none whose delivery is at most once runs twice.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/process.hpp"

namespace millrace::tests::integration {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::SizeIs;

const std::string uuid = "1b671a64-40d5-491e-99b0-da01ff1f3341";

/// A request as the web server has received it.
struct Post {
  std::string key;
  unsigned attempt = 0;
  std::string text;
};

class HttpFailures : public testing::Test {
 protected:
  void start_server() {
    server.emplace(std::vector<std::string>{"/usr/bin/python3", MILLRACE_HTTP_SERVER,
                                            chain.folder().string(), "--port", port});
    port = server->await("^ready: (\\d+)").at(1);
  }
  void start_proxy() {
    proxy.emplace(std::vector<std::string>{"/usr/bin/python3", MILLRACE_HTTP_PROXY,
                                           chain.folder().string(), "--port", proxy_port});
    proxy_port = proxy->await("^ready: (\\d+)").at(1);
  }
  void start_http() {
    http.emplace(std::vector<std::string>{binary("millrace-http"), "--config",
                                          (chain.folder() / "http.textproto").string(), "--domain",
                                          std::to_string(chain.domain()), "--log-level", "debug"});
    http->await("^ready: ");
  }
  /// The program makes `calls` calls of this path.
  void start(const std::string& path, const std::string& delivery, std::uint32_t calls) {
    start_server();
    configure(path, delivery);
    start_http();
    cnc.emplace(
        chain.cnc({"--run", "1=" + chain.counting_program(uuid, calls), "--exit-when-idle"}));
    gateway.emplace(chain.gateway({"--log-level", "debug"}));
  }
  void configure(const std::string& path, const std::string& delivery,
                 const std::string& more = {}) const {
    const fs::path part = chain.folder() / "part";
    std::ofstream(part) << "service { uuid: '" << uuid << "' url: 'http://127.0.0.1:" << port
                        << path << "' health_ms: 200 delivery: " << delivery << " " << more << " }";
    fs::rename(part, chain.folder() / "http.textproto");
  }
  [[nodiscard]] std::vector<Post> posts() const {
    std::vector<Post> posts;
    std::ifstream in(chain.folder() / "posts");
    for (std::string line; std::getline(in, line);) {
      Post& post = posts.emplace_back();
      std::istringstream(line) >> post.key >> post.attempt >> post.text;
    }
    return posts;
  }
  /// `problem` is a regular expression.
  void await_doctor(const std::string& problem) {
    const std::regex pattern("the endpoint http://127.0.0.1:" + port + problem);
    await("the alarm", [&] {
      Process doctor = chain.millrace({"doctor"});
      doctor.wait();
      return std::regex_search(doctor.output(), pattern);
    });
  }
  void await_posts(std::size_t count) {
    await("the request", [&] { return posts().size() >= count; });
  }
  /// An operator answers the blocked call.
  void answer(const std::string& text) {
    gateway->await_error("an operator|blocked");
    await("the answer of an operator", [&] {
      return chain.millrace({"answer", "cnc/1", text, "--state", "1"}).wait() == 0;
    });
  }
  void expect_end(std::uint32_t calls) {
    EXPECT_EQ(cnc->wait(std::chrono::minutes(2)), 0) << gateway->error_output();
    EXPECT_THAT(cnc->output(), HasSubstr(std::to_string(calls) + " calls answered"));
    EXPECT_THAT(cnc->output(), testing::Not(HasSubstr("wrong answer")));
  }
  void forget() const {
    for (const char* const file : {"posts", "heads", "times", "go"}) {
      fs::remove(chain.folder() / file);
    }
  }
  void end() {
    gateway->terminate();
    gateway->wait();
    http->terminate();
    EXPECT_EQ(http->wait(), 0);
  }
  /// Each attempt was sent once.
  void expect_no_attempt_twice() const {
    std::map<std::pair<std::string, unsigned>, unsigned> count;
    for (const Post& post : posts()) {
      EXPECT_EQ(++count[std::pair(post.key, post.attempt)], 1U)
          << post.text << " attempt " << post.attempt;
    }
  }

  Chain chain;
  std::string port = "0";
  std::string proxy_port = "0";
  std::optional<Process> server;
  std::optional<Process> proxy;
  std::optional<Process> http;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
};

TEST_F(HttpFailures, ACallWaitsForAServerThatIsNotThere) {
  start_server();
  server->kill();
  configure("/echo", "AT_MOST_ONCE");
  start_http();
  cnc.emplace(chain.cnc({"--run", "1=" + chain.counting_program(uuid, 2), "--exit-when-idle"}));
  gateway.emplace(chain.gateway());
  await_doctor("/echo does not answer");
  start_server();
  expect_end(2);
  EXPECT_THAT(posts(), SizeIs(2));
}

TEST_F(HttpFailures, ACallWaitsForAProxyThatForwardsNothing) {
  for (const std::string status : {"", "407"}) {
    SCOPED_TRACE(status.empty() ? "gone" : status);
    forget();
    start_server();
    start_proxy();
    configure("/echo", "AT_MOST_ONCE", "proxy: 'http://127.0.0.1:" + proxy_port + "'");
    if (status.empty()) {
      proxy->kill();
    } else {
      std::ofstream(chain.folder() / "refuse") << status;
    }
    start_http();
    cnc.emplace(chain.cnc({"--run", "1=" + chain.counting_program(uuid, 2), "--exit-when-idle"}));
    gateway.emplace(chain.gateway());
    await_doctor("/echo does not answer: .*" + (status.empty() ? "port " + proxy_port : status));
    if (status.empty()) {
      start_proxy();
    } else {
      // A regression: each check of the connection cleared the alarm, until the next call failed.
      for (int i = 0; i < 5; ++i) {
        Process report = chain.millrace({"status"});
        report.wait();
        EXPECT_THAT(report.output(), HasSubstr("/echo does not answer"));
      }
    }
    fs::remove(chain.folder() / "refuse");
    expect_end(2);
    EXPECT_THAT(posts(), SizeIs(2));
    end();
  }
}

TEST_F(HttpFailures, TheAlarmOfAProxyThatForwardsAgainEndsWithoutACallToo) {
  start_server();
  start_proxy();
  configure("/echo", "AT_MOST_ONCE", "proxy: 'http://127.0.0.1:" + proxy_port + "'");
  std::ofstream(chain.folder() / "refuse") << "407";
  start_http();
  cnc.emplace(chain.cnc({"--run", "1=" + chain.counting_program(uuid, 1)}));
  gateway.emplace(chain.gateway());
  await_doctor("/echo does not answer: .*407");
  gateway->kill();
  fs::remove(chain.folder() / "refuse");
  await("the end of the alarm", [&] {
    Process report = chain.millrace({"status"});
    report.wait();
    return report.output().find("/echo does not answer") == std::string::npos;
  });
  EXPECT_THAT(posts(), SizeIs(0));
}

TEST_F(HttpFailures, ALostConnectionBlocksACallThatMustNotRunTwice) {
  for (const char* const path : {"/reset_before", "/reset_after", "/half", "/cut", "/bad_chunk"}) {
    SCOPED_TRACE(path);
    forget();
    start(path, "AT_MOST_ONCE", 1);
    answer("1");
    expect_end(1);
    EXPECT_THAT(posts(), SizeIs(path == std::string("/reset_before") ? 0 : 1));
    end();
  }
}

/// libcurl itself repeats a request on a connection that was used before.
TEST_F(HttpFailures, ALostConnectionThatWasUsedBeforeDoesSoToo) {
  start("/second_dies", "AT_MOST_ONCE", 2);
  answer("2");
  expect_end(2);
  EXPECT_THAT(posts(), SizeIs(2));
}

/// A server may close a connection just when the next request is under way, and nothing shows that
/// it has not read it.
TEST_F(HttpFailures, AConnectionThatIsClosedUnderARequestBlocksACallThatMustNotRunTwice) {
  start("/second_unread", "AT_MOST_ONCE", 2);
  answer("2");
  expect_end(2);
  EXPECT_THAT(posts(), SizeIs(1));
}

TEST_F(HttpFailures, AConnectionThatIsClosedUnderARequestLosesNoCallThatMayRunTwice) {
  start("/second_unread", "AT_LEAST_ONCE", 20);
  expect_end(20);
  EXPECT_THAT(posts(), SizeIs(20));
}

TEST_F(HttpFailures, ALostConnectionRepeatsACallThatMayRunTwice) {
  start("/reset_after", "AT_LEAST_ONCE", 1);
  await_posts(2);
  configure("/echo", "AT_LEAST_ONCE");
  expect_end(1);
  for (const Post& post : posts()) {
    EXPECT_EQ(post.key, posts().front().key);
  }
  EXPECT_GT(posts().back().attempt, 1U);
  expect_no_attempt_twice();
}

TEST_F(HttpFailures, AServerWithoutRoomGetsTheCallAgain) {
  for (const char* const path : {"/busy", "/busy_date"}) {
    SCOPED_TRACE(path);
    forget();
    start(path, "AT_MOST_ONCE", 1);
    await_posts(2);
    std::ofstream(chain.folder() / "go") << "x";
    expect_end(1);
    expect_no_attempt_twice();
    std::ifstream times(chain.folder() / "times");
    double first = 0;
    double second = 0;
    times >> first >> second;
    EXPECT_GE(second - first, path == std::string("/busy") ? 2.9 : 0.9) << "Retry-After";
    end();
  }
}

TEST_F(HttpFailures, AKilledServerLosesNoCall) {
  start("/echo", "AT_LEAST_ONCE", 300);
  for (const std::size_t count : {30U, 90U, 150U}) {
    await_posts(count);
    server->kill();
    start_server();
  }
  expect_end(300);
  expect_no_attempt_twice();
}

TEST_F(HttpFailures, AKilledMillraceHttpLosesNoCall) {
  start("/echo", "AT_LEAST_ONCE", 300);
  for (const std::size_t count : {30U, 90U, 150U}) {
    await_posts(count);
    http->kill();
    start_http();
  }
  expect_end(300);
  expect_no_attempt_twice();
}

TEST_F(HttpFailures, ACallOfAKilledMillraceHttpIsBlockedIfItMustNotRunTwice) {
  start("/slow", "AT_MOST_ONCE", 1);
  await_posts(1);
  http->kill();
  start_http();
  std::ofstream(chain.folder() / "go") << "x";
  answer("1");
  expect_end(1);
  EXPECT_THAT(posts(), SizeIs(1));
}

TEST_F(HttpFailures, ACallOfAKilledServerIsBlockedIfItMustNotRunTwice) {
  start("/slow", "AT_MOST_ONCE", 1);
  await_posts(1);
  server->kill();
  start_server();
  std::ofstream(chain.folder() / "go") << "x";
  answer("1");
  expect_end(1);
  EXPECT_THAT(posts(), SizeIs(1));
}

}  // namespace
}  // namespace millrace::tests::integration
