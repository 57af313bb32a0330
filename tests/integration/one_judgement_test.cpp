// Faults made with real processes: the command line, the doctor, the page, the metrics and mails
// say the same about each.

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <regex>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/json/parse.hpp>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "base/text/times.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/plant/concern.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/http_client.hpp"

namespace millrace::tests::integration {
namespace {

using fabric::Time;
using std::chrono::milliseconds;

/// "act held cnc/1", of a concern in JSON.
std::string concern_of(const boost::json::value& json) {
  return std::string(json.at("level").as_string()) + " " +
         std::string(json.at("kind").as_string()) + " " +
         std::string(json.at("subject").as_string());
}
std::set<std::string> concerns_in(const boost::json::value& list) {
  std::set<std::string> all;
  for (const boost::json::value& each : list.as_array()) {
    all.insert(concern_of(each));
  }
  return all;
}

/// "operator", … of each of them.
std::set<std::string> roles_in(const boost::json::value& list) {
  std::set<std::string> all;
  for (const boost::json::value& each : list.as_array()) {
    all.emplace(each.at("who").as_string());
  }
  return all;
}

/// "2026-03-01T07:02:48.000000Z", … of each of them.
std::set<std::string> times_in(const boost::json::value& list) {
  std::set<std::string> all;
  for (const boost::json::value& each : list.as_array()) {
    all.emplace(each.at("since").as_string());
  }
  return all;
}

const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const std::string with_programs =
    "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
    "programs { period_ms: 20 error: \"mc_error_id_r\" } }\n";

/// Shows what the server's events say, as a tab of the page does.
class Browser {
 public:
  explicit Browser(std::uint16_t port) : events_(port, "/api/live"), reading_([this] { read(); }) {}

  [[nodiscard]] std::set<std::string> concerns() const {
    const std::scoped_lock lock(mutex_);
    std::set<std::string> all;
    for (const auto& [concern, since] : shown_) {
      all.insert(concern);
    }
    return all;
  }
  /// Since when it shows this concern.
  [[nodiscard]] Time shows_since(const std::string& concern) const {
    const std::scoped_lock lock(mutex_);
    return shown_.at(concern);
  }

 private:
  void read() {
    try {
      while (true) {
        const boost::json::value event = boost::json::parse(events_.next().data);
        if (const auto* concerns = event.as_object().if_contains("concerns")) {
          show(concerns_in(*concerns));
        }
      }
    } catch (const std::runtime_error&) {
      // The test ends its server.
    }
  }
  void show(const std::set<std::string>& concerns) {
    const std::scoped_lock lock(mutex_);
    std::erase_if(shown_, [&](const auto& each) { return !concerns.contains(each.first); });
    for (const std::string& concern : concerns) {
      shown_.try_emplace(concern, std::chrono::system_clock::now());
    }
  }

  mutable std::mutex mutex_;
  std::map<std::string, Time> shown_;
  HttpEvents events_;
  std::jthread reading_;
};

class OneJudgement : public testing::Test {
 protected:
  void SetUp() override {
    web.emplace(chain.millrace({"web", "--listen", "127.0.0.1:0"}));
    port = static_cast<std::uint16_t>(
        std::stoi(web->await("^ready: .* at http://127\\.0\\.0\\.1:(\\d+)/").at(1)));
    browser.emplace(port);
  }

  [[nodiscard]] boost::json::value page() const {
    return boost::json::parse(HttpClient(port).get("/api/concerns").body);
  }
  [[nodiscard]] std::set<std::string> on_the_page() const { return browser->concerns(); }
  std::set<std::string> in_the_metrics() {
    const std::string text = HttpClient(port).get("/metrics").body;
    const std::regex line(
        "millrace_concern\\{kind=\"([^\"]*)\",level=\"([^\"]*)\",who=\"([^\"]*)\",subject=\"([^\"]*"
        ")"
        "\"");
    std::set<std::string> all;
    roles_in_the_metrics.clear();
    for (std::sregex_iterator found(text.begin(), text.end(), line), none; found != none; ++found) {
      all.insert((*found)[2].str() + " " + (*found)[1].str() + " " + (*found)[4].str());
      roles_in_the_metrics.insert((*found)[3].str());
    }
    return all;
  }
  /// What `millrace status` says, and its exit code.
  std::set<std::string> in_a_terminal() {
    Process status = chain.millrace({"status", "--json"});
    exit_code = status.wait();
    in_status = boost::json::parse(status.output()).at("concerns");
    return concerns_in(in_status);
  }
  /// The codes of what the doctor finds.
  [[nodiscard]] std::string of_the_doctor() const {
    Process doctor = chain.millrace({"doctor", "--json"});
    doctor.wait();
    return doctor.output();
  }

  /// The test makes its fault with what follows. Without this, an NC program makes it, when its
  /// concern begins.
  void begin_fault() { fault = std::chrono::system_clock::now(); }
  /// Waits until the page has exactly this concern. Records how long after the fault it shows it:
  /// docs/dev/measurements/web.md.
  void expect_on_the_page(const std::string& concern) {
    const std::set<std::string> expected{concern};
    await("the page to say " + concern,
          [&] { return on_the_page() == expected && concerns_in(page()) == expected; });
    const Time since =
        fault ? *fault
              : base::text::parse_time(std::string(page().at(0).at("since").as_string()), Time{})
                    .value();
    const auto after = browser->shows_since(concern) - since;
    fmt::print("{}: on the page after {} ms\n", concern,
               std::chrono::duration_cast<milliseconds>(after).count());
  }
  /// Waits until every view has exactly this concern.
  void expect_everywhere(const std::string& concern, const std::string& what, int code) {
    const std::set<std::string> expected{concern};
    expect_on_the_page(concern);
    await("the metrics to say " + concern, [&] { return in_the_metrics() == expected; });
    await("status to say " + concern, [&] { return in_a_terminal() == expected; });
    EXPECT_EQ(exit_code, code);
    EXPECT_EQ(roles_in(in_status), roles_in(page()));
    EXPECT_EQ(roles_in_the_metrics, roles_in(page()));
    EXPECT_EQ(times_in(in_status), times_in(page()));
    await("the doctor to say " + what,
          [&] { return of_the_doctor().find('"' + what + '"') != std::string::npos; });
  }
  /// The path of an NC program that calls this service with this text all the time.
  [[nodiscard]] std::string calls_of(const std::string& uuid, const std::string& text) const {
    const auto program = chain.folder() / (uuid + ".nc");
    std::ofstream(program) << "%calls\nP1 = 1\n$WHILE TRUE\nV.G.SERVICE.UUID = \"" << uuid
                           << "\"\nV.G.SERVICE.REQUEST = \"" << text
                           << "\"\nV.G.SERVICE.REQUEST_STATE = P1\n#FLUSH CONTINUE\n"
                              "#WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0\nP1 = P1 + 1\n"
                              "$ENDWHILE\nM30\n";
    return program;
  }
  [[nodiscard]] std::string aborted_program() const {
    const auto program = chain.folder() / "bad.nc";
    std::ofstream(program) << "%bad\n#FLUSH WAIT\nP1 = 1 / 0\nM30\n";
    return program;
  }
  void await_running_call() const {
    await("the call to run", [&] {
      Process channels = chain.millrace({"channels"});
      channels.wait();
      return channels.output().find("running") != std::string::npos;
    });
  }
  void expect_nothing_anywhere() {
    fault.reset();
    await("the page to be well", [&] { return on_the_page().empty(); });
    await("the metrics to be well", [&] { return in_the_metrics().empty(); });
    await("status to be well", [&] { return in_a_terminal().empty(); });
    EXPECT_EQ(exit_code, 0);
  }

  Chain chain;
  /// It ends with its server, which is destroyed before.
  std::optional<Browser> browser;
  std::optional<Process> web;
  std::optional<Process> service;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
  std::uint16_t port = 0;
  std::optional<Time> fault;
  int exit_code = -1;
  boost::json::value in_status;
  std::set<std::string> roles_in_the_metrics;
};

TEST_F(OneJudgement, IsSaidOfACallThatIsHeldAndOfItsEnd) {
  service.emplace(chain.slow_service({"--work", "100000", "--delivery", "at-most-once"}));
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"}));
  gateway.emplace(chain.gateway());
  await_running_call();
  begin_fault();
  service->kill();
  expect_everywhere("act held cnc/1", "what_held", 4);
  Process answer = chain.millrace({"answer", "cnc/1", "by hand", "--state", "7"});
  EXPECT_EQ(answer.wait(), 0) << answer.error_output();
  EXPECT_EQ(cnc->wait(), 0);
}

TEST_F(OneJudgement, IsSaidOfAServiceThatIsNotThereAndOfItsReturn) {
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
  gateway.emplace(chain.gateway());
  expect_everywhere("act unserved cnc/1", "what_unserved", 5);
  service.emplace(chain.square_root());
  expect_nothing_anywhere();
}

TEST_F(OneJudgement, IsSaidOfAControllerThatIsGone) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  expect_nothing_anywhere();
  begin_fault();
  cnc->kill();
  expect_everywhere("act link down cnc", "what_link_down", 3);
}

TEST_F(OneJudgement, IsSaidOfAControllerThatStopsAnsweringAndOfItsReturn) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  expect_nothing_anywhere();
  begin_fault();
  cnc->signal(SIGSTOP);
  expect_on_the_page("act link down cnc");
  cnc->signal(SIGCONT);
  expect_nothing_anywhere();
}

TEST_F(OneJudgement, IsSaidOfAGatewayThatIsGone) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  expect_nothing_anywhere();
  begin_fault();
  gateway->kill();
  const std::set<std::string> expected{"act gateway gone cnc"};
  expect_on_the_page("act gateway gone cnc");
  await("the metrics to have it", [&] { return in_the_metrics() == expected; });
  // A command that joins now never saw the gateway: no controller is asked for calls.
  await("status to have it",
        [&] { return in_a_terminal() == std::set<std::string>{"act no gateway "}; });
  EXPECT_EQ(exit_code, 3);
}

TEST_F(OneJudgement, SaysThatAGatewayWhichEndedInOrderHasEnded) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  expect_nothing_anywhere();
  begin_fault();
  gateway->terminate();
  EXPECT_EQ(gateway->wait(), 0) << gateway->error_output();
  expect_on_the_page("act gateway gone cnc");
  EXPECT_EQ(page().at(0).at("why_code"), "gateway_ended");
}

TEST_F(OneJudgement, IsSaidOfAnNcProgramThatWasAborted) {
  cnc.emplace(chain.cnc({"--run", "1=" + aborted_program()}));
  gateway.emplace(chain.configured_gateway(with_programs));
  expect_everywhere("act program aborted cnc/1", "what_program_aborted", 7);
}

TEST_F(OneJudgement, IsSaidOfAnNcProgramOnHoldAndFailsNothing) {
  const auto program = chain.folder() / "hold.nc";
  std::ofstream(program) << "%hold\nM00\nM30\n";
  cnc.emplace(chain.cnc({"--run", "1=" + program.string()}));
  gateway.emplace(chain.configured_gateway(
      "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
      "programs { period_ms: 20 } }\n"));
  expect_everywhere("look program on hold cnc/1", "what_program_on_hold", 0);
}

TEST_F(OneJudgement, IsSaidOfACallThatWaitsForTheOnlyInstanceAndFailsNothing) {
  service.emplace(chain.slow_service({"--work", "100000"}));
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--run",
                         Chain::program(2, "one_slow_call.nc")}));
  gateway.emplace(chain.gateway());
  await("a call to wait", [&] {
    const std::set<std::string> all = on_the_page();
    return all.size() == 1 && all.begin()->starts_with("look waiting cnc/");
  });
  expect_everywhere(*on_the_page().begin(), "what_waiting", 0);
}

TEST_F(OneJudgement, IsSaidOfAProcessThatReportsAProblemAndOfItsEnd) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  expect_nothing_anywhere();
  const fabric::dds::Participant there({.domain = chain.domain()});
  boost::asio::io_context io;
  fabric::endpoints::AlarmEndpoint faults(there, io.get_executor(),
                                          {.program = "archiver", .host = "vm", .pid = 7});
  begin_fault();
  ASSERT_TRUE(faults.raise({.key = {.kind = "archive"},
                            .level = fabric::AlarmLevel::problem,
                            .text = "the disk is full",
                            .since = *fault}));
  std::jthread repeats([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      io.run_for(std::chrono::milliseconds(100));
      io.restart();
    }
  });
  expect_everywhere("act alarm archiver on vm, pid 7", "what_archive", 6);
  repeats.request_stop();
  repeats.join();
  ASSERT_TRUE(faults.clear("archive"));
  expect_nothing_anywhere();
}

TEST_F(OneJudgement, IsSaidOfOneOfTwoInstancesThatIsLostAndFailsNothing) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  service.emplace(chain.square_root());
  Process other = chain.square_root();
  expect_nothing_anywhere();
  begin_fault();
  other.kill();
  const std::string lost = "look redundancy " + square_root;
  expect_on_the_page(lost);
  await("the metrics to have it", [&] { return in_the_metrics() == std::set<std::string>{lost}; });
  in_a_terminal();
  EXPECT_EQ(exit_code, 0);
  Process again = chain.square_root();
  await("the page to be well", [&] { return on_the_page().empty(); });
}

TEST_F(OneJudgement, IsSaidOfTheOnlyInstanceThatStandsStillAndOfItsReturn) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  service.emplace(chain.square_root());
  expect_nothing_anywhere();
  begin_fault();
  ::kill(service->pid(), SIGSTOP);
  expect_on_the_page("act unserved " + square_root);
  EXPECT_EQ(page().at(0).at("why_code"), "last_instance_silent");
  ::kill(service->pid(), SIGCONT);
  expect_nothing_anywhere();
  await("the event of its return", [&] {
    return HttpClient(port).get("/api/events").body.find("\"instance responds\"") !=
           std::string::npos;
  });
}

TEST_F(OneJudgement, IsSaidOfACallThatIsLaterThanItsDeadlineAndFailsNothing) {
  service.emplace(chain.slow_service({"--work", "100000"}));
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "one_slow_call.nc")}));
  gateway.emplace(chain.configured_gateway(
      "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
      "policy { deadline { after_ms: 500 } } }\n"));
  expect_everywhere("look overdue cnc/1", "what_overdue", 0);
}

TEST_F(OneJudgement, IsSaidOfAJournalThatCannotBeWrittenAndOfItsReturn) {
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
  gateway.emplace(chain.gateway({"--journal", (chain.folder() / "journal").string()}));
  gateway->await_error("link up");
  expect_nothing_anywhere();
  rlimit before{};
  const rlimit none{.rlim_cur = 0, .rlim_max = RLIM_INFINITY};
  begin_fault();
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &none, &before), 0);
  expect_everywhere("act journal cnc", "what_journal", 6);
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &before, nullptr), 0);
  expect_nothing_anywhere();
}

TEST_F(OneJudgement, SaysToAToolOfAnotherFabricWhichFabricsThereAre) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  await("status to name the fabric", [&] {
    Process status = chain.millrace({"status", "--json", "--fabric", "other"});
    EXPECT_EQ(status.wait(), 3) << status.output();
    const boost::json::value concerns = boost::json::parse(status.output()).at("concerns");
    return concerns.at(0).at("why_code") == "with_other_fabrics" &&
           concerns.at(0).at("why_arguments").at(1) == "millrace" &&
           concerns.at(0).at("todo").at(0).at("text_code") == "join_other_fabric";
  });
}

/// Mails of a rule for all concerns that need a person.
class OneJudgementInMails : public OneJudgement {
 protected:
  void SetUp() override {
    OneJudgement::SetUp();
    std::filesystem::create_directory(inbox);
    server.emplace(std::vector<std::string>{"/usr/bin/python3", MILLRACE_SMTP_SERVER,
                                            inbox.string(), "--port", "0"});
    const auto config = chain.folder() / "mail.textproto";
    std::ofstream(config) << "server { host: 'localhost' port: "
                          << server->await("^ready: (\\d+)").at(1)
                          << " starttls: OFF }\n"
                             "from: 'press@example.com'\n"
                             "recipient { name: 'shift' address: 'eva@example.com' }\n"
                             "rule { name: 'act' concern: ACT after_s: 0 quiet_s: 0 to: 'shift' "
                             "text: '{level} {kind} {subject}|{what}|{reason}|{who}|' }\n";
    mail.emplace(std::vector<std::string>{binary("millrace-mail"), "--config", config.string(),
                                          "--domain", std::to_string(chain.domain())});
    mail->await("^ready: ");
  }

  /// Waits until a mail and the page have this concern in the same words.
  void expect_mail(const std::string& concern) {
    await("a mail about " + concern, [&] {
      const boost::json::value all = page();
      const auto found = std::ranges::find(all.as_array(), concern, concern_of);
      if (found == all.as_array().end()) {
        return false;
      }
      std::string text = concern + (concern.ends_with(' ') ? "plant" : "");
      for (const char* field : {"what", "why", "who"}) {
        text += "|" + std::string(found->at(field).as_string());
      }
      kinds.emplace(found->at("kind").as_string());
      return mails().find(text + "|") != std::string::npos;
    });
  }
  /// Of all mails.
  [[nodiscard]] std::string mails() const {
    std::string all;
    for (int number = 1;; ++number) {
      std::ifstream file(inbox / (std::to_string(number) + ".mail"));
      if (!file) {
        // Without the soft line breaks of quoted-printable (RFC 2045, 6.7).
        return std::regex_replace(all, std::regex("=\r\n"), "");
      }
      all.append(std::istreambuf_iterator<char>(file), {});
    }
  }

  const std::filesystem::path inbox = chain.folder() / "inbox";
  std::optional<Process> server;
  std::optional<Process> mail;
  /// Those of which a mail was sent.
  std::set<std::string> kinds;
};

/// It needs no person, or none in the time that a test may take.
bool is_not_mailed(fabric::plant::Kind kind) {
  using enum fabric::plant::Kind;
  // `missing` is of `status` alone; `waiting` needs a person after a minute.
  return kind == missing || kind == overdue || kind == waiting || kind == redundancy ||
         kind == process_gone || kind == program_on_hold || kind == unknown;
}

TEST_F(OneJudgementInMails, IsSaidOfEachKindThatNeedsAPersonInTheSameWords) {
  expect_mail("act no gateway ");
  Process slow = chain.slow_service({"--work", "100000", "--delivery", "at-most-once"});
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--channels", "4", "--run", "1=" + aborted_program(), "--run",
                         "2=" + calls_of("a5b5c5d5-0000-4000-8000-000000000001", "unserved"),
                         "--run", Chain::program(3, "one_slow_call.nc"), "--run",
                         "4=" + calls_of(square_root, "no number")}));
  gateway.emplace(chain.configured_gateway(with_programs,
                                           {"--journal", (chain.folder() / "journal").string()}));
  await("the call to run", [&] {
    const boost::json::value channels =
        boost::json::parse(HttpClient(port).get("/api/channels").body);
    return std::ranges::any_of(channels.as_array(), [](const boost::json::value& each) {
      return each.at("channel") == 3 && each.at("channel_state") == "running";
    });
  });
  slow.kill();
  const fabric::dds::Participant there({.domain = chain.domain()});
  boost::asio::io_context io;
  fabric::endpoints::AlarmEndpoint faults(there, io.get_executor(),
                                          {.program = "archiver", .host = "vm", .pid = 7});
  ASSERT_TRUE(faults.raise({.key = {.kind = "archive"},
                            .level = fabric::AlarmLevel::problem,
                            .text = "the disk is full",
                            .since = std::chrono::system_clock::now()}));
  expect_mail("act alarm archiver on vm, pid 7");
  expect_mail("act program aborted cnc/1");
  expect_mail("act unserved cnc/2");
  expect_mail("act held cnc/3");
  expect_mail("act errors " + square_root);

  rlimit before{};
  const rlimit none{.rlim_cur = 0, .rlim_max = RLIM_INFINITY};
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &none, &before), 0);
  expect_mail("act journal cnc");
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &before, nullptr), 0);
  cnc->kill();
  expect_mail("act link down cnc");
  gateway->kill();
  expect_mail("act gateway gone cnc");

  using fabric::plant::Kind;
  for (auto kind = Kind::missing; kind <= Kind::unknown;
       kind = static_cast<Kind>(static_cast<int>(kind) + 1)) {
    EXPECT_NE(is_not_mailed(kind), kinds.contains(std::string(name_of(kind)))) << name_of(kind);
  }
}

/// The test above that makes a fault of this kind with real processes.
std::string test_of(fabric::plant::Kind kind) {
  using enum fabric::plant::Kind;
  switch (kind) {
    case missing:
      // An expectation of `status` alone: no state of the plant.
      return "";
    case held:
      return "IsSaidOfACallThatIsHeldAndOfItsEnd";
    case no_gateway:
      return "SaysToAToolOfAnotherFabricWhichFabricsThereAre";
    case gateway_gone:
      return "IsSaidOfAGatewayThatIsGone";
    case link_down:
      return "IsSaidOfAControllerThatIsGone";
    case journal:
      return "IsSaidOfAJournalThatCannotBeWrittenAndOfItsReturn";
    case unserved:
      return "IsSaidOfAServiceThatIsNotThereAndOfItsReturn";
    case program_aborted:
      return "IsSaidOfAnNcProgramThatWasAborted";
    case alarm:
      return "IsSaidOfAProcessThatReportsAProblemAndOfItsEnd";
    case overdue:
      return "IsSaidOfACallThatIsLaterThanItsDeadlineAndFailsNothing";
    case waiting:
      return "IsSaidOfACallThatWaitsForTheOnlyInstanceAndFailsNothing";
    case errors:
      return "IsSaidOfAServiceWhoseResponsesAreErrors";
    case redundancy:
      return "IsSaidOfOneOfTwoInstancesThatIsLostAndFailsNothing";
    case process_gone:
      return "IsSaidOfARecorderThatIsGoneWithoutAWord";
    case program_on_hold:
      return "IsSaidOfAnNcProgramOnHoldAndFailsNothing";
    case unknown:
      // tests/compat/future_test: a gateway of a later version.
      return "";
  }
  throw std::logic_error("a kind without a test");
}

TEST(EachKindOfConcern, IsMadeInATest) {
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  std::set<std::string> tests;
  for (int suite = 0; suite < all.total_test_suite_count(); ++suite) {
    for (int test = 0; test < all.GetTestSuite(suite)->total_test_count(); ++test) {
      tests.insert(all.GetTestSuite(suite)->GetTestInfo(test)->name());
    }
  }
  using fabric::plant::Kind;
  for (auto kind = Kind::missing; kind <= Kind::unknown;
       kind = static_cast<Kind>(static_cast<int>(kind) + 1)) {
    EXPECT_TRUE(test_of(kind).empty() || tests.contains(test_of(kind))) << name_of(kind);
  }
}

TEST_F(OneJudgement, IsSaidOfARecorderThatIsGoneWithoutAWord) {
  cnc.emplace(chain.cnc());
  gateway.emplace(chain.gateway());
  gateway->await_error("link up");
  Process recorder = chain.millrace({"record", "-o", (chain.folder() / "a.mcap").string()});
  await("the recorder to be known", [&] {
    return HttpClient(port).get("/api/alarms").body.find("\"recording\"") != std::string::npos;
  });
  begin_fault();
  recorder.kill();
  const auto has_it = [&](const std::set<std::string>& concerns) {
    return concerns.size() == 1 &&
           concerns.begin()->starts_with("look process gone millrace record");
  };
  await("the page to have it", [&] { return has_it(on_the_page()); });
  expect_on_the_page(*on_the_page().begin());
  await("the metrics to have it", [&] { return has_it(in_the_metrics()); });
  in_a_terminal();
  EXPECT_EQ(exit_code, 0);
  Process next = chain.millrace({"record", "-o", (chain.folder() / "b.mcap").string()});
  expect_nothing_anywhere();
  next.terminate();
  EXPECT_EQ(next.wait(), 0) << next.error_output();
  expect_nothing_anywhere();
}

TEST_F(OneJudgement, IsSaidOfAServiceWhoseResponsesAreErrors) {
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--run", "1=" + calls_of(square_root, "no number")}));
  gateway.emplace(chain.gateway());
  expect_everywhere("act errors " + square_root, "what_errors", 6);
}

}  // namespace
}  // namespace millrace::tests::integration
