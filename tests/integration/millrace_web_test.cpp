// `millrace web` with the real programs: its output, authorization, and its reaction to foreign
// input.

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include <boost/json/parse.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/http_client.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class TheWeb : public testing::Test {
 protected:
  void start_web(const Flags& flags = {}) {
    Flags command{"web", "--listen", "127.0.0.1:0"};
    command.insert(command.end(), flags.begin(), flags.end());
    sut.emplace(chain.millrace(command));
    port = static_cast<std::uint16_t>(
        std::stoi(sut->await("^ready: .* at http://127\\.0\\.0\\.1:(\\d+)/").at(1)));
  }
  /// Starts a program in channel 1 with continuous calls, and its service.
  void start_calls() {
    service.emplace(chain.square_root({"--name", "sq1"}));
    cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
    gateway.emplace(chain.gateway());
  }
  /// A call of channel 1 whose at-most-once instance is lost.
  void block_a_call() {
    service.emplace(chain.slow_service({"--work", "100000", "--delivery", "at-most-once"}));
    cnc.emplace(chain.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"}));
    gateway.emplace(chain.gateway());
    await("the call to be held", [&] {
      const auto channels = get("/api/channels");
      const auto state = state_of_channel_1(channels);
      if (state == "running" && service) {
        service->kill();
        service.reset();
      }
      return state == "held";
    });
  }
  static std::string state_of_channel_1(const boost::json::value& channels) {
    for (const auto& channel : channels.as_array()) {
      if (channel.at("channel") == 1) {
        return channel.at("channel_state").as_string().c_str();
      }
    }
    return {};
  }
  /// A file of --allow-actions with anna, whose password is "secret".
  [[nodiscard]] std::string users() const {
    const auto file = chain.folder() / "web.textproto";
    Process hash(
        {"/bin/sh", "-c", "printf secret | " + binary("millrace") + " web --hash-password"});
    EXPECT_EQ(hash.wait(), 0) << hash.error_output();
    std::string line = hash.output();
    line.erase(line.find('\n'));
    std::ofstream(file) << "user { name: \"anna\" password_hash: \"" << line << "\" }\n";
    std::filesystem::permissions(file, std::filesystem::perms(0600));
    return file.string();
  }
  /// The header lines of an action by anna.
  static std::string log_in(HttpClient& browser) {
    const HttpAnswer login =
        browser.post("/api/login", R"({"user": "anna", "password": "secret"})");
    EXPECT_EQ(login.status, 200) << login.body;
    std::string cookie = login.field("Set-Cookie");
    cookie.erase(cookie.find(';'));
    const std::string token = boost::json::parse(login.body).at("token").as_string().c_str();
    return "Cookie: " + cookie + "\r\nX-Millrace-Token: " + token + "\r\n";
  }
  [[nodiscard]] boost::json::value get(const std::string& target) const {
    const HttpAnswer answer = HttpClient(port).get(target);
    EXPECT_EQ(answer.status, 200) << target << ": " << answer.body;
    return boost::json::parse(answer.body);
  }
  Chain chain;
  std::optional<Process> service;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
  std::optional<Process> sut;
  std::uint16_t port = 0;
};

TEST_F(TheWeb, SendsABrowserEverythingOnceAndThenTheChanges) {
  start_web();
  start_calls();
  HttpEvents events(port, "/api/live");
  const HttpEvent first = events.next();
  EXPECT_EQ(first.name, "snapshot");
  EXPECT_TRUE(boost::json::parse(first.data).as_object().contains("about"));
  const HttpEvent call = events.await([](const HttpEvent& event) {
    return event.name == "changes" && event.data.find("\"calls\":[") != std::string::npos;
  });
  const auto changes = boost::json::parse(call.data);
  const auto& ended = changes.at("calls").at(0);
  EXPECT_EQ(ended.at("machine"), "cnc");
  EXPECT_EQ(ended.at("end"), "written");
  EXPECT_EQ(ended.at("service"), "sq1");

  service->kill();
  const std::string gone = R"("gone":{"services":[)";
  events.await([&](const HttpEvent& event) { return event.data.find(gone) != std::string::npos; });
  events.await([](const HttpEvent& event) {
    return event.data.find(R"("channel_state":"unserved")") != std::string::npos ||
           event.data.find(R"("channel_state":"waiting")") != std::string::npos;
  });

  sut->terminate();
  events.await([](const HttpEvent& event) { return event.name == "bye"; });
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
}

TEST_F(TheWeb, ShowsTheSameAsTheCommands) {
  start_web();
  start_calls();
  await("a call", [&] { return !get("/api/calls").at("calls").as_array().empty(); });
  Process services = chain.millrace({"services", "-i", "--json"});
  ASSERT_EQ(services.wait(), 0);
  const auto by_command = boost::json::parse(services.output());
  boost::json::value by_web;
  // Heartbeats contain load and times of an instance, some times a second.
  await("all that the command prints", [&] {
    by_web = get("/api/services");
    const auto& fields = by_command.at(0).as_object();
    return std::all_of(fields.begin(), fields.end(), [&](const auto& field) {
      // The command names what is not known, too.
      return field.value().is_null() || by_web.at(0).as_object().contains(field.key());
    });
  });
  for (const char* name : {"instance", "uuid", "name", "host", "pid", "version", "concurrency"}) {
    EXPECT_EQ(by_web.at(0).at(name), by_command.at(0).at(name)) << name;
  }
  EXPECT_EQ(get("/api/machines").at(0).at("connected"), true);
  EXPECT_EQ(get("/api/doctor").at("fabric"), "millrace");
}

TEST_F(TheWeb, ShowsTheSameTimelineOfACallAsTheLog) {
  const auto recordings = chain.folder() / "recordings";
  std::filesystem::create_directory(recordings);
  start_web({"--recordings", recordings.string()});
  const auto file = recordings / "run.mcap";
  Process recorder = chain.millrace({"record", "-o", file.string()});
  recorder.await("^ready: ");
  start_calls();
  await("calls", [&] { return get("/api/calls").at("calls").as_array().size() >= 20; });
  const auto calls = get("/api/calls").at("calls").as_array();
  const std::string call = calls.at(10).at("call").as_string().c_str();
  const auto live = get("/api/calls/" + call);
  recorder.terminate();
  ASSERT_EQ(recorder.wait(), 0) << recorder.error_output();

  Process log = chain.millrace({"recording", "calls", "--json", file.string(), call});
  ASSERT_EQ(log.wait(), 0) << log.error_output();
  const auto logged = boost::json::parse(log.output());
  EXPECT_EQ(live, logged);
  EXPECT_EQ(get("/api/recordings/run.mcap/calls/" + call), logged);

  EXPECT_EQ(get("/api/recordings").at("recordings").at(0).at("name"), "run.mcap");
  EXPECT_EQ(get("/api/recordings/run.mcap").at("closed"), true);
  const auto page = get("/api/recordings/run.mcap/calls?limit=5&skip=2");
  EXPECT_EQ(page.at("calls").as_array().size(), 5U);
  EXPECT_EQ(page.at("more"), true);
  EXPECT_EQ(HttpClient(port).get("/api/recordings/run.mcap/file").body.size(),
            std::filesystem::file_size(file));
}

TEST_F(TheWeb, CallsAServiceForAProgram) {
  start_web({"--allow-actions", users()});
  service.emplace(chain.square_root());
  HttpClient client(port);
  const std::string headers = log_in(client);
  const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  const HttpAnswer root =
      client.post("/api/call", R"({"uuid": ")" + square_root + R"(", "text": "4"})", headers);
  EXPECT_EQ(root.status, 200) << root.body;
  Process command = chain.millrace({"call", square_root, "4", "--json"});
  EXPECT_EQ(command.wait(), 0);
  const auto names = [](const boost::json::value& value) {
    std::vector<std::string> all;
    for (const auto& field : value.as_object()) {
      all.emplace_back(field.key());
    }
    return all;
  };
  EXPECT_EQ(names(boost::json::parse(root.body)), names(boost::json::parse(command.output())));
  EXPECT_EQ(boost::json::parse(root.body).at("response"), "2.000000");
  EXPECT_EQ(boost::json::parse(root.body).at("response_state"), 1);
  EXPECT_EQ(boost::json::parse(root.body).at("answered"), true);
  const HttpAnswer none = client.post(
      "/api/call", R"({"uuid": "7c9e6679-7425-40de-944b-e07fc1f90ae7", "text": "4"})", headers);
  EXPECT_EQ(none.status, 504) << none.body;
  EXPECT_EQ(boost::json::parse(none.body).at("answered"), false);
}

TEST_F(TheWeb, LetsAUserRetryOrAnswerABlockedCallAndTheProgramEnds) {
  start_web({"--allow-actions", users()});
  Process watcher = chain.millrace({"record", "-o", (chain.folder() / "who.mcap").string()});
  watcher.await("^ready: ");
  block_a_call();

  const auto channels = get("/api/channels");
  std::string call;
  for (const auto& channel : channels.as_array()) {
    if (channel.at("channel") == 1) {
      call = channel.at("call").as_string().c_str();
    }
  }
  const std::string body = R"({"machine": "cnc", "channel": 1, "call": ")" + call +
                           R"(", "response": "by hand", "state": 7})";
  HttpClient browser(port);
  EXPECT_EQ(browser.post("/api/actions/answer", body).status, 401);
  EXPECT_EQ(browser.post("/api/login", R"({"user": "anna", "password": "Secret"})").status, 401);
  const std::string by_anna = log_in(browser);
  const std::string cookie_only = by_anna.substr(0, by_anna.find("X-Millrace-Token"));
  EXPECT_EQ(browser.post("/api/actions/answer", body, cookie_only).status, 403);
  EXPECT_EQ(browser
                .post("/api/actions/answer", body,
                      by_anna + "Origin: http://evil.example\r\nSec-Fetch-Site: cross-site\r\n")
                .status,
            403);
  const HttpAnswer done = browser.post("/api/actions/answer", body, by_anna);
  EXPECT_EQ(done.status, 200) << done.body;
  EXPECT_EQ(boost::json::parse(done.body).at("done"), true) << done.body;
  EXPECT_EQ(cnc->wait(), 0) << cnc->error_output();
  sut->await_error("anna: answer of call .* of cnc/1: done");
  gateway->await_error("anna@.*/web");
  watcher.terminate();
  ASSERT_EQ(watcher.wait(), 0);
  Process who = chain.millrace(
      {"recording", "cat", "--json", "--kind", "command", (chain.folder() / "who.mcap").string()});
  ASSERT_EQ(who.wait(), 0);
  EXPECT_THAT(who.output(), HasSubstr("anna@"));
}

TEST_F(TheWeb, KeepsAcknowledgementsOverARestart) {
  const Flags flags{"--allow-actions", users(), "--state-folder",
                    (chain.folder() / "state" / "web").string()};
  start_web(flags);
  HttpClient browser(port);
  const HttpAnswer done =
      browser.post("/api/actions/acknowledge",
                   R"({"cause": "held cnc/1", "name": "cnc/1", "since": "1", "note": "new part"})",
                   log_in(browser));
  ASSERT_EQ(done.status, 200) << done.body;
  const auto acknowledged = [&] {
    return boost::json::parse(HttpEvents(port, "/api/live").next().data).at("acknowledged");
  };
  const boost::json::value before = acknowledged();
  ASSERT_EQ(before.as_array().size(), 1U);
  sut->kill();
  start_web(flags);
  EXPECT_EQ(acknowledged(), before);

  // A damaged file is no reason not to start.
  sut->kill();
  const auto file = chain.folder() / "state" / "web" / "acknowledged.json";
  std::filesystem::resize_file(file, 20);
  start_web(flags);
  sut->await_error("acknowledged.json is damaged: .*acknowledged.json.damaged");
  EXPECT_TRUE(acknowledged().as_array().empty());
}

TEST_F(TheWeb, ServesPrometheusMetrics) {
  start_web();
  start_calls();
  await("a call", [&] {
    return HttpClient(port).get("/metrics").body.find("result=\"answered\"") != std::string::npos;
  });
  const HttpAnswer answer = HttpClient(port).get("/metrics");
  EXPECT_EQ(answer.field("Content-Type"), "text/plain; version=0.0.4; charset=utf-8");
  EXPECT_THAT(answer.body, HasSubstr("millrace_link_up{machine=\"cnc\"} 1"));
  EXPECT_THAT(answer.body, HasSubstr("millrace_call_hop_duration_seconds_bucket{"));
  EXPECT_THAT(answer.body, HasSubstr("process_cpu_seconds_total"));
}

class ForeignInput : public TheWeb {
 protected:
  void SetUp() override { start_web(); }
  void TearDown() override {
    EXPECT_EQ(HttpClient(port).get("/healthz").status, 200);
    sut->terminate();
    EXPECT_EQ(sut->wait(), 0) << sut->error_output();
  }
};

TEST_F(ForeignInput, OfAThousandIdleConnectionsBlocksNoOthers) {
  std::vector<std::unique_ptr<HttpClient>> idle;
  for (int i = 0; i < 1000; ++i) {
    idle.push_back(std::make_unique<HttpClient>(port));
  }
  EXPECT_EQ(HttpClient(port).get("/api/about").status, 200);
  EXPECT_TRUE(idle.front()->is_ended());
}

TEST_F(ForeignInput, Of600HalfHeadersShutsNoOthersOut) {
  std::vector<std::unique_ptr<HttpClient>> half;
  for (int i = 0; i < 600; ++i) {
    half.push_back(std::make_unique<HttpClient>(port));
    half.back()->send("GET / HTTP/1.1\r\nHost: local");
  }
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(HttpClient(port).get("/api/about").status, 200);
  }
}

TEST_F(ForeignInput, OfAMegabyteOfHeaderIsRefused) {
  HttpClient browser(port);
  browser.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(64U << 10U, 'x'));
  EXPECT_EQ(browser.receive().status, 431);
  EXPECT_TRUE(browser.is_ended());
}

TEST_F(ForeignInput, OfALongBodyIsRefused) {
  HttpClient browser(port);
  browser.send("POST /api/login HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1048576\r\n\r\n");
  EXPECT_EQ(browser.receive().status, 413);
}

TEST_F(ForeignInput, OtherThanHttpIsRefused) {
  HttpClient browser(port);
  using namespace std::string_view_literals;
  browser.send("\x16\x03\x01\x02\x00 nonsense\r\n\r\n"sv);
  EXPECT_EQ(browser.receive().status, 400);
}

TEST_F(ForeignInput, ReadsNoFile) {
  for (const char* target : {"/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd",
                             "/..%2f..%2fetc/passwd"}) {
    HttpClient browser(port);
    const HttpAnswer answer = browser.get(target);
    EXPECT_GE(answer.status, 400) << target;
    EXPECT_THAT(answer.body, Not(HasSubstr("root:")));
  }
}

TEST_F(ForeignInput, OfABrowserThatDoesNotReadDelaysNoOthers) {
  start_calls();
  HttpClient deaf(port);
  deaf.send("GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n");
  HttpEvents reader(port, "/api/live");
  for (int i = 0; i < 20; ++i) {
    reader.next();
  }
}

TEST_F(TheWeb, IsNotOpenedToANetworkWithoutProtection) {
  Process open = chain.millrace({"web", "--listen", "0.0.0.0:0"});
  EXPECT_EQ(open.wait(), 2);
  EXPECT_THAT(open.error_output(), HasSubstr("--tls-cert"));
  Process half = chain.millrace({"web", "--listen", "127.0.0.1:0", "--tls-cert", "x.pem"});
  EXPECT_EQ(half.wait(), 2);
  Process wrong = chain.millrace({"web", "--listen", "localhost"});
  EXPECT_EQ(wrong.wait(), 2);
}

/// Replaces certificate and key: a self-signed certificate for `name`.
void make_certificate(const std::filesystem::path& folder, const std::string& name) {
  Process openssl({"/usr/bin/openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                   "ec_paramgen_curve:prime256v1", "-nodes", "-subj", "/CN=" + name, "-days", "2",
                   "-keyout", (folder / "web.key").string(), "-out",
                   (folder / "web.crt").string()});
  ASSERT_EQ(openssl.wait(), 0) << openssl.error_output();
}

/// The subject of the server's certificate.
std::string certificate_at(std::uint16_t port) {
  Process client({"/bin/sh", "-c",
                  "openssl s_client -connect 127.0.0.1:" + std::to_string(port) +
                      " </dev/null 2>/dev/null | openssl x509 -noout -subject"});
  client.wait();
  return client.output();
}

TEST(TheWebWithTls, LoadsANewCertificateOnSighup) {
  Chain chain;
  make_certificate(chain.folder(), "first");
  Process sut = chain.millrace({"web", "--listen", "127.0.0.1:0", "--tls-cert",
                                (chain.folder() / "web.crt").string(), "--tls-key",
                                (chain.folder() / "web.key").string()});
  const auto port = static_cast<std::uint16_t>(
      std::stoi(sut.await("^ready: .* at https://127\\.0\\.0\\.1:(\\d+)/").at(1)));
  EXPECT_THAT(certificate_at(port), HasSubstr("first"));
  make_certificate(chain.folder(), "second");
  sut.signal(SIGHUP);
  sut.await_error("web.crt is used from now on");
  EXPECT_THAT(certificate_at(port), HasSubstr("second"));
  // A key that does not fit, as while the files are being replaced.
  std::ofstream(chain.folder() / "web.key") << "no key";
  sut.signal(SIGHUP);
  sut.await_error("the one before stays");
  EXPECT_THAT(certificate_at(port), HasSubstr("second"));
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
}

TEST(TheWebWithTls, IsReachedBeside600HalfHandshakes) {
  Chain chain;
  make_certificate(chain.folder(), "reached");
  Process sut = chain.millrace({"web", "--listen", "127.0.0.1:0", "--tls-cert",
                                (chain.folder() / "web.crt").string(), "--tls-key",
                                (chain.folder() / "web.key").string()});
  const auto port = static_cast<std::uint16_t>(
      std::stoi(sut.await("^ready: .* at https://127\\.0\\.0\\.1:(\\d+)/").at(1)));
  using namespace std::string_view_literals;
  std::vector<std::unique_ptr<HttpClient>> half;
  for (int i = 0; i < 600; ++i) {
    half.push_back(std::make_unique<HttpClient>(port));
    half.back()->send("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"sv);
  }
  EXPECT_THAT(certificate_at(port), HasSubstr("reached"));
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
}

TEST_F(TheWeb, ShowsTheAlarmsOfProcesses) {
  start_web();
  Process recorder = chain.millrace({"record", "-o", (chain.folder() / "run.mcap").string()});
  recorder.await("^ready: ");
  // The web server says that it runs, too.
  const auto is_known = [&] {
    const auto alarms = get("/api/alarms");
    return std::ranges::any_of(alarms.as_array(),
                               [](const auto& alarm) { return alarm.at("kind") == "recording"; });
  };
  await("the alarm of the recorder", is_known);
  EXPECT_THAT(HttpClient(port).get("/metrics").body,
              HasSubstr("kind=\"recording\",subject=\"\",level=\"fine\"} 1"));
  // Gone without a farewell, as when its host fails.
  recorder.kill();
  await("the end of its alarm", [&] { return !is_known(); });
}

}  // namespace
}  // namespace millrace::tests::integration
