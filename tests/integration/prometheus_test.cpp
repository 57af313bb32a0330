// Debian's Prometheus scrapes `millrace web` with the real programs: its counts match the calls,
// and each alert begins and ends with its cause. The alerts wait for seconds here instead of
// minutes.

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>

#include <boost/json/parse.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/data.hpp"
#include "tests/support/http_client.hpp"

namespace millrace::tests::integration {
namespace {

constexpr const char* prometheus_binary = "/usr/bin/prometheus";

/// A port that no process has: Prometheus does not print the one that it was assigned.
std::uint16_t free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(socket);
  return ntohs(address.sin_port);
}

std::string encoded(const std::string& text) {
  std::ostringstream out;
  for (const char character : text) {
    out << '%' << std::hex << std::uppercase << (static_cast<unsigned>(character) >> 4U & 0xfU)
        << (static_cast<unsigned>(character) & 0xfU);
  }
  return out.str();
}

class ThePrometheus : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(prometheus_binary)) {
      GTEST_SKIP() << "Prometheus is not installed (package prometheus)";
    }
    web_port = free_port();
    port = free_port();
  }
  void start_web(const Flags& flags = {}) {
    Flags command{"web", "--listen", "127.0.0.1:" + std::to_string(web_port)};
    command.insert(command.end(), flags.begin(), flags.end());
    web.emplace(chain.millrace(command));
    web->await("^ready: ");
  }
  void start_prometheus(const std::string& scheme = "http") {
    std::ifstream shipped(MILLRACE_SOURCE "/deploy/prometheus/millrace.rules.yml");
    std::string rules{std::istreambuf_iterator<char>(shipped), {}};
    rules = std::regex_replace(rules, std::regex("for: \\w+"), "for: 1s");
    rules = std::regex_replace(rules, std::regex("> 60\\)"), "> 2)");
    rules = std::regex_replace(rules, std::regex("\\[\\d+m\\]"), "[10s]");
    std::ofstream(chain.folder() / "millrace.rules.yml") << rules;
    std::ofstream(chain.folder() / "prometheus.yml")
        << "global: {scrape_interval: 1s, evaluation_interval: 1s}\n"
           "rule_files: [millrace.rules.yml]\n"
           "scrape_configs:\n"
           "  - job_name: millrace\n    scheme: "
        << scheme
        << "\n    tls_config: {insecure_skip_verify: true}\n"
           "    static_configs: [{targets: [\"127.0.0.1:"
        << web_port << "\"]}]\n";
    sut.emplace(
        Process({prometheus_binary, "--config.file=" + (chain.folder() / "prometheus.yml").string(),
                 "--storage.tsdb.path=" + (chain.folder() / "tsdb").string(),
                 "--web.listen-address=127.0.0.1:" + std::to_string(port)}));
    sut->await_error("Server is ready to receive web requests");
  }

  /// The first sample of an expression; nothing if there is none.
  [[nodiscard]] std::optional<double> value_of(const std::string& expression) const {
    const auto answer = HttpClient(port).get("/api/v1/query?query=" + encoded(expression),
                                             "Accept-Encoding: identity\r\n");
    if (answer.status != 200) {
      return std::nullopt;
    }
    const auto found = boost::json::parse(answer.body);
    const auto& result = found.at("data").at("result").as_array();
    return result.empty()
               ? std::nullopt
               : std::optional(std::atof(result.at(0).at("value").at(1).as_string().c_str()));
  }
  /// The number that the gateway counts.
  [[nodiscard]] std::int64_t calls_of_the_gateway() const {
    Process channels = chain.millrace({"channels", "--json"});
    std::int64_t calls = 0;
    if (channels.wait() == 0) {
      const auto parsed = boost::json::parse(channels.output());
      for (const auto& channel : parsed.as_array()) {
        calls += channel.at("calls").to_number<std::int64_t>();
      }
    }
    return calls;
  }
  [[nodiscard]] bool fires(const std::string& alert) const {
    return value_of("ALERTS{alertname=\"" + alert + "\",alertstate=\"firing\"}").has_value();
  }
  void expect_alert(const std::string& alert) const {
    await(alert + " to fire", [&] { return fires(alert); });
  }
  void expect_no_alert(const std::string& alert) const {
    await(alert + " to end", [&] { return !fires(alert); });
  }

  /// An alert about what needs a person, or should be known, of this kind.
  [[nodiscard]] bool fires_for(const std::string& kind) const {
    return value_of("ALERTS{alertname=~\"MillraceAct|MillraceLook\",kind=\"" + kind +
                    "\",alertstate=\"firing\"}")
        .has_value();
  }
  void expect_concern(const std::string& kind) const {
    await("an alert for " + kind, [&] { return fires_for(kind); });
  }
  void expect_no_concern(const std::string& kind) const {
    await("the alert for " + kind + " to end", [&] { return !fires_for(kind); });
  }

  Chain chain;
  std::optional<Process> service;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
  std::optional<Process> web;
  std::optional<Process> sut;
  std::uint16_t web_port = 0;
  std::uint16_t port = 0;
};

TEST_F(ThePrometheus, CountsCalls) {
  start_web();
  start_prometheus();
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "many_calls.nc"), "--exit-when-idle"}));
  await("up", [&] { return value_of("up{job=\"millrace\"}") == 1.0; });
  gateway.emplace(chain.gateway());
  await("rate", [&] { return value_of("sum(rate(millrace_calls_total[30s]))") > 0.0; });
  EXPECT_EQ(cnc->wait(), 0) << cnc->error_output();
  const std::string calls = "sum(millrace_calls_total{result=\"answered\"})";
  const std::string by_gateway = "sum(millrace_channel_calls_total{event=\"answered\"})";
  await("equal counts", [&] {
    const auto counted = value_of(calls);
    return counted && counted > 0.0 && counted == value_of(by_gateway);
  });
  const auto timed =
      value_of("sum(millrace_call_hop_duration_seconds_count{hop=\"total\"}) - " + calls);
  EXPECT_EQ(timed, 0.0);
  EXPECT_EQ(value_of("sum(millrace_observed_calls_total{seen!=\"complete\"})"), 0.0);
}

TEST_F(ThePrometheus, FindsTheMetricsWellNamed) {
  start_web();
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
  gateway.emplace(chain.gateway());
  await("calls", [&] {
    return HttpClient(web_port).get("/metrics").body.find("answered\"}") != std::string::npos;
  });
  const auto file = chain.folder() / "metrics.txt";
  std::ofstream(file) << HttpClient(web_port).get("/metrics").body;
  Process promtool({"/bin/sh", "-c", "promtool check metrics < " + file.string()});
  EXPECT_EQ(promtool.wait(), 0) << promtool.output() << promtool.error_output();
}

TEST_F(ThePrometheus, AlertsWhenALinkIsDownAndWhenItCannotScrape) {
  start_web();
  start_prometheus();
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  await("the link", [&] { return value_of("millrace_link_up") == 1.0; });
  EXPECT_FALSE(fires_for("link down"));
  const std::string place = "127.0.0.1:" + std::to_string(chain.port());
  cnc->kill();
  expect_concern("link down");
  cnc.emplace(Process({binary("millrace-cnc"), "--listen", place, "--channels", "2", "--dir",
                       chain.folder().string()}));
  cnc->await("^ready: ");
  expect_no_concern("link down");

  web->kill();
  expect_alert("MillraceNotScraped");
  start_web();
  expect_no_alert("MillraceNotScraped");
}

TEST_F(ThePrometheus, AlertsWhenAServiceIsGone) {
  start_web();
  start_prometheus();
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
  gateway.emplace(chain.gateway());
  await("calls", [&] { return value_of("sum(millrace_calls_total)") > 0.0; });
  service->kill();
  expect_concern("unserved");
  service.emplace(chain.square_root());
  expect_no_concern("unserved");
}

TEST_F(ThePrometheus, AlertsWhenACallIsUnserved) {
  start_web();
  start_prometheus();
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"}));
  gateway.emplace(chain.gateway());
  expect_concern("unserved");
  service.emplace(chain.square_root());
  expect_no_concern("unserved");
  EXPECT_EQ(cnc->wait(), 0);
}

TEST_F(ThePrometheus, AlertsWhenAChannelWaitsForAnInstance) {
  start_web();
  start_prometheus();
  service.emplace(chain.slow_service({"--work", "100000"}));
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--run",
                         Chain::program(2, "one_slow_call.nc")}));
  gateway.emplace(chain.gateway());
  expect_concern("waiting");
  Process another = chain.slow_service({"--work", "100000"});
  expect_no_concern("waiting");
}

TEST_F(ThePrometheus, AlertsWhenACallIsBlocked) {
  start_web();
  start_prometheus();
  service.emplace(chain.slow_service({"--work", "100000", "--delivery", "at-most-once"}));
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"}));
  gateway.emplace(chain.gateway());
  await("the call to run", [&] { return value_of("sum(millrace_calls_in_flight)") == 1.0; });
  service->kill();
  expect_concern("held");
  Process answer = chain.millrace({"answer", "cnc/1", "by hand", "--state", "7"});
  EXPECT_EQ(answer.wait(), 0) << answer.error_output();
  EXPECT_EQ(cnc->wait(), 0);
  expect_no_concern("held");
}

TEST_F(ThePrometheus, AlertsWhenAJournalCannotBeWritten) {
  start_web();
  start_prometheus();
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
  gateway.emplace(chain.gateway({"--journal", (chain.folder() / "journal").string()}));
  await("calls", [&] { return value_of("sum(millrace_calls_total)") > 0.0; });
  // Like a full disk.
  const rlimit full{.rlim_cur = 16, .rlim_max = RLIM_INFINITY};
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &full, nullptr), 0);
  // The present call waits without an alarm; a new one raises it.
  const std::string machine = "cnc=127.0.0.1:" + std::to_string(chain.port()) + "/127.0.0.1.1.1";
  for (const auto& [variable, value] : std::vector<std::pair<std::string, std::string>>{
           {"V.G.SERVICE.UUID", "560aacbf-6335-44a9-895a-8b27f3ed5e47"},
           {"V.G.SERVICE.REQUEST", "2"},
           {"V.G.SERVICE.REQUEST_STATE", "1"}}) {
    Process write = chain.millrace(
        {"vars", machine, "write", variable, value, "--channel", "2", "--direct", "--force"});
    ASSERT_EQ(write.wait(), 0) << write.error_output();
  }
  expect_concern("journal");
  const rlimit room{.rlim_cur = RLIM_INFINITY, .rlim_max = RLIM_INFINITY};
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &room, nullptr), 0);
  expect_no_concern("journal");
}

/// A gateway that publishes program states, and samples a value that the controller has and one
/// that it has not.
class ThePrometheusOfData : public ThePrometheus {
 protected:
  void SetUp() override {
    ThePrometheus::SetUp();
    if (IsSkipped()) {
      return;
    }
    start_web();
    start_prometheus();
    cnc.emplace(chain.cnc());
    gateway.emplace(chain.configured_gateway(
        "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
        "programs { period_ms: 20 } "
        "data { name: \"state\" variable: [\"state\", \"V.E.NONE\"] period_ms: 20 } }\n"));
    await("data", [&] { return value_of("millrace_data_values{quality=\"good\"}") == 1.0; });
  }
  /// The same controller, restarted, with a program that ends with an error after a while.
  void run_into_an_error() {
    const std::string place = "127.0.0.1:" + std::to_string(chain.port());
    const auto program = chain.folder() / "bad.nc";
    std::ofstream(program) << "%bad\n#FLUSH WAIT\n#TIME 4\n#FLUSH WAIT\nP1 = 1 / 0\nM30\n";
    cnc->kill();
    cnc.emplace(Process({binary("millrace-cnc"), "--listen", place, "--channels", "2", "--dir",
                         chain.folder().string(), "--run", "1=" + program.string()}));
    cnc->await("^ready: ");
  }
};

TEST_F(ThePrometheusOfData, AlertsWhenAProgramIsAborted) {
  run_into_an_error();
  expect_concern("program aborted");
}

TEST_F(ThePrometheusOfData, AlertsWhileSampledValuesAreStaleAndWhileTheyAreRefused) {
  expect_alert("MillraceDataRefused");
  EXPECT_FALSE(fires("MillraceDataStale"));
  const std::string place = "127.0.0.1:" + std::to_string(chain.port());
  cnc->kill();
  expect_alert("MillraceDataStale");
  cnc.emplace(Process({binary("millrace-cnc"), "--listen", place, "--channels", "2", "--dir",
                       chain.folder().string()}));
  cnc->await("^ready: ");
  expect_no_alert("MillraceDataStale");
}

TEST_F(ThePrometheus, AlertsWhenAMessageQueueFills) {
  start_web();
  start_prometheus();
  const auto file = chain.folder() / "cnc.textproto";
  std::ofstream(file)
      << "system_data { name: \"ALARMS\" type: STRING elements: 4 }\n"
         "system_data { name: \"CONTROL\" member { name: \"LastFilled\" } member { name: "
         "\"LastGet\" } }\n";
  cnc.emplace(
      chain.cnc({"--config", file.string(), "--run", Chain::program(1, "two_messages.nc")}));
  gateway.emplace(chain.configured_gateway(
      "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
      "queue { name: \"ALARMS\" control: \"SD.CONTROL\" drain: WHEN_ANSWERED "
      "uuid: \"c0ffee00-0000-4000-8000-000000000001\" } }\n"));
  expect_concern("alarm");
  EXPECT_EQ(value_of("millrace_queue_filled_messages{machine=\"cnc\",queue=\"ALARMS\"}"), 2.0);
  EXPECT_EQ(value_of("millrace_queue_capacity_messages"), 3.0);
  service.emplace(chain.slow_service());
  expect_no_concern("alarm");
  await("both answered", [&] { return value_of("millrace_queue_answered_messages_total") == 2.0; });
  await("the queue to be empty", [&] { return value_of("millrace_queue_filled_messages") == 0.0; });
}

TEST_F(ThePrometheus, AlertsWhenTheCertificateEndsSoon) {
  const std::string key = (chain.folder() / "web.key").string();
  const std::string certificate = (chain.folder() / "web.crt").string();
  const auto make = [&](const std::string& days) {
    Process openssl({"/usr/bin/openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj",
                     "/CN=localhost", "-days", days, "-keyout", key, "-out", certificate});
    ASSERT_EQ(openssl.wait(), 0) << openssl.error_output();
  };
  make("5");
  start_web({"--tls-cert", certificate, "--tls-key", key});
  start_prometheus("https");
  expect_alert("MillraceCertificateExpires");
  make("100");
  web->terminate();
  EXPECT_EQ(web->wait(), 0) << web->error_output();
  start_web({"--tls-cert", certificate, "--tls-key", key});
  expect_no_alert("MillraceCertificateExpires");
}

TEST_F(ThePrometheus, AlertsWhenCallsFail) {
  start_web();
  start_prometheus();
  service.emplace(chain.slow_service({"--work", "400"}));
  const auto program = chain.folder() / "slow_calls.nc";
  std::ifstream endless(test_data("nc/chain/endless_calls.nc"));
  const std::string text{std::istreambuf_iterator<char>(endless), {}};
  std::ofstream(program) << std::regex_replace(text, std::regex("UUID = \"[^\"]*\""),
                                               "UUID = \"c0ffee00-0000-4000-8000-000000000001\"");
  cnc.emplace(chain.cnc({"--run", "1=" + program.string()}));
  gateway.emplace(chain.gateway());
  await("two calls", [&] { return value_of("sum(millrace_calls_total)") >= 2.0; });
  // Each time, an instance is lost with its call, which an operator then answers.
  for (int i = 0; i < 3; ++i) {
    service->kill();
    service.emplace(chain.slow_service({"--work", "100000"}));
    service->await_error("call .* attempt");
    service->kill();
    Process answer = chain.millrace({"answer", "cnc/1", "by hand", "--state", "1"});
    EXPECT_EQ(answer.wait(), 0) << answer.error_output();
  }
  service.emplace(chain.slow_service({"--work", "400"}));
  expect_alert("MillraceCallsFail");
  expect_no_alert("MillraceCallsFail");
}

TEST_F(ThePrometheus, AlertsWhenSamplesOfACallAreMissing) {
  start_web();
  start_prometheus();
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
  gateway.emplace(chain.gateway());
  await("calls", [&] { return value_of("sum(millrace_calls_total)") > 0.0; });
  // Writers keep 128 calls of a channel for a reader that stands still.
  web->signal(SIGSTOP);
  const auto seen = calls_of_the_gateway();
  await("calls that it misses", [&] { return calls_of_the_gateway() > seen + 400; });
  web->signal(SIGCONT);
  expect_alert("MillraceCallsMissing");
  expect_no_alert("MillraceCallsMissing");
}

}  // namespace
}  // namespace millrace::tests::integration
