// Faults made with real processes: the command line, the doctor, the page, the metrics and mails
// say the same about each.
#include "tests/integration/one_judgement.hpp"

#include <csignal>
#include <fstream>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/plant/concern.hpp"

namespace millrace::tests::integration {
namespace {

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
