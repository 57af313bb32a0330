// The examples of docs/how-to/services-over-http.md as their readers start them, behind
// millrace-http.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/integration/chain.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests::integration {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::string uuid = "1b671a64-40d5-491e-99b0-da01ff1f3341";
const fs::path examples = fs::path(MILLRACE_EXAMPLES) / "http";

/// A port that nothing uses now, for programs that cannot say which one they have taken.
std::string free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ::bind(socket, reinterpret_cast<const sockaddr*>(&address), size);
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(socket);
  return std::to_string(ntohs(address.sin_port));
}

Process start_http(const fs::path& folder, const std::string& url, std::uint32_t domain) {
  std::ofstream(folder / "http.textproto")
      << "service { uuid: '" << uuid << "' url: '" << url << "' }";
  Process http({binary("millrace-http"), "--config", (folder / "http.textproto").string(),
                "--domain", std::to_string(domain)});
  http.await("^ready: ");
  return http;
}

bool runs(const std::string& command) {
  return Process({"/bin/sh", "-c", command}).wait() == 0;
}

struct Example {
  std::string file;
  /// Starts it, before its path and port.
  std::string program;
  /// Ends with 0 if this host has what it needs.
  std::string needs;
};

class HttpExample : public testing::TestWithParam<Example> {};

TEST_P(HttpExample, AnswersSeveralCalls) {
  if (!runs(GetParam().needs)) {
    GTEST_SKIP() << GetParam().file
                 << " needs what is not installed (deploy/install-deps); skipped";
  }
  const TemporaryFolder folder;
  const Domain domain;
  Caller caller(domain.number());
  const std::string port = free_port();
  Process service(
      {"/bin/sh", "-c",
       "exec " + GetParam().program + " " + (examples / GetParam().file).string() + " " + port});
  const Process http = start_http(folder.path(), "http://127.0.0.1:" + port + "/", domain.number());
  ASSERT_TRUE(caller.await_instance(uuid)) << http.error_output() << service.error_output();
  for (const auto& [number, root] :
       {std::pair<std::string, std::string>{"4", "2.000000"}, {"2", "1.414214"}}) {
    const fabric::Reply reply = caller.call(uuid, number);
    EXPECT_EQ(reply.text, root) << service.error_output();
    EXPECT_EQ(reply.state, 1U);
  }
}

INSTANTIATE_TEST_SUITE_P(Languages, HttpExample,
                         testing::Values(Example{"service.py", "/usr/bin/python3",
                                                 "test -x /usr/bin/python3"},
                                         Example{"flask_service.py", "/usr/bin/python3",
                                                 "/usr/bin/python3 -c 'import flask'"},
                                         Example{"service.mjs", "node", "node --version"},
                                         Example{"service.sh", "", "socat -V"}),
                         [](const auto& tested) {
                           std::string name = tested.param.file;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

TEST(NodeRed, AnswersAnNcProgramWithTheExampleFlow) {
  Chain chain;
  const fs::path red = chain.folder() / "red";
  fs::create_directory(red);
  Process npm(
      {"/bin/sh", "-c",
       "npm install --prefer-offline --no-audit --no-fund --omit=optional --fetch-retries 0 "
       "--prefix " +
           red.string() + " node-red@4"});
  if (npm.wait(std::chrono::minutes(4)) != 0) {
    ASSERT_THAT(npm.error_output(),
                testing::ContainsRegex("not found|ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ENETUNREACH|"
                                       "ETIMEDOUT|ENOTCACHED|E403"));
    GTEST_SKIP() << "Node-RED cannot be installed from the npm registry; skipped";
  }
  const std::string port = free_port();
  Process node_red({"/bin/sh", "-c",
                    "exec node " + (red / "node_modules/node-red/red.js").string() + " --userDir " +
                        red.string() + " --port " + port + " -D uiHost=127.0.0.1 " +
                        (examples / "node_red.json").string()});
  // It listens before it has its flows, and answers 404 until then.
  node_red.await("Started flows", std::chrono::minutes(1));
  const Process http =
      start_http(chain.folder(), "http://127.0.0.1:" + port + "/scale", chain.domain());
  Process cnc = chain.cnc({"--run", "1=" + chain.counting_program(uuid, 1), "--exit-when-idle"});
  const Process gateway = chain.gateway();
  EXPECT_EQ(cnc.wait(std::chrono::minutes(1)), 0) << node_red.output() << http.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("1 calls answered"));
  EXPECT_THAT(cnc.output(), testing::Not(HasSubstr("wrong answer")));
}

}  // namespace
}  // namespace millrace::tests::integration
