// The operator's command with the real programs.

#include <algorithm>
#include <csignal>
#include <fstream>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/stuck_loop.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr const char* square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

class TheCommand : public ChainTest {};

TEST_F(TheCommand, ListsEveryInstance) {
  Process first = chain.square_root({"--name", "first"});
  Process second = chain.square_root({"--name", "second", "--channel", "cnc/2"});
  const std::string instances = run({"services", "-i"}).output();
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(instances, HasSubstr(square_root));
  EXPECT_THAT(instances, HasSubstr("first"));
  EXPECT_THAT(instances, HasSubstr("cnc/2"));
  EXPECT_THAT(run({"services", "--csv", "--columns", "uuid,instances"}).output(),
              "uuid,instances\r\n" + std::string(square_root) + ",2\r\n");
  EXPECT_THAT(run({"services", "second", "--full"}).output(),
              AllOf(HasSubstr("channels          cnc/2"), Not(HasSubstr("first"))));
}

TEST_F(TheCommand, AcceptsAbbreviatedNames) {
  Process service = chain.square_root({"--name", "first"});
  for (const char* what : {"560aacbf", "560AACBF", "fir", square_root}) {
    EXPECT_THAT(run({"services", what}).output(), HasSubstr(square_root)) << what;
    EXPECT_EQ(exit_code, 0);
  }
  EXPECT_THAT(run({"services", "--columns", "nosuch"}).error_output(),
              HasSubstr("unknown column 'nosuch'; expected service, uuid, "));
  EXPECT_EQ(exit_code, 2);
}

TEST_F(TheCommand, ListsWhatExistsInsteadOfAnUnknownName) {
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  gateway.await_error("link up");
  Process service = chain.square_root({"--name", "first"});
  for (const auto& [args, answer] : std::vector<std::pair<Flags, std::string>>{
           {{"machines", "nosuch"}, "no machine 'nosuch' on FABRIC; known: cnc\n"},
           {{"channels", "nosuch/1"}, "no channel 'nosuch/1' on FABRIC; known: cnc/1, cnc/2\n"},
           {{"services", "nosuch"}, "no service 'nosuch' on FABRIC; known: first .560aacbf-"},
           {{"services", "-i", "nosuch"}, "no service 'nosuch' on FABRIC; known: first .560aacbf-"},
           {{"calls", "nosuch"}, "no call 'nosuch' on FABRIC; none is known\n"},
           {{"calls", "--machine", "nosuch"}, "no machine 'nosuch' on FABRIC; known: cnc\n"},
           {{"data", "nosuch"}, "no machine 'nosuch' on FABRIC; known: cnc\n"},
           {{"data", "cnc"}, "machine 'cnc' publishes no such data; "},
           {{"programs", "nosuch"}, "no machine 'nosuch' on FABRIC; known: cnc\n"},
           {{"queues", "nosuch"}, "no machine 'nosuch' on FABRIC; known: cnc\n"},
           {{"vars", "nosuch", "list"}, "^[^\n]*no machine 'nosuch' on FABRIC; known: cnc\n$"},
           {{"vars", "read", "nosuch", "V.E.X"}, "no machine 'nosuch' on FABRIC; known: cnc\n"}}) {
    std::string pattern = answer;
    if (const std::size_t at = pattern.find("FABRIC"); at != std::string::npos) {
      pattern.replace(at, 6, "fabric 'millrace', domain " + std::to_string(chain.domain()));
    }
    EXPECT_THAT(run(args).error_output(), ContainsRegex(pattern)) << args.front();
    EXPECT_EQ(exit_code, 1) << args.front();
  }
}

TEST_F(TheCommand, FitsTheWidthOfTheTerminal) {
  Process service = chain.square_root({"--name", "first"});
  Flags command{"/usr/bin/env", "COLUMNS=80"};
  const Flags rest = chain.command({"services", "-i"});
  command.insert(command.end(), rest.begin(), rest.end());
  Process sut(command);
  EXPECT_EQ(sut.wait(), 0);
  std::istringstream lines(sut.output());
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 80U) << line;
  }
  EXPECT_THAT(sut.output(), AllOf(HasSubstr("first"), Not(HasSubstr("DELIVERY"))));
}

TEST_F(TheCommand, AcceptsFabricOptionsBeforeTheCommandAndShowsTheStatusWithoutOne) {
  Process service = chain.square_root({"--name", "first"});
  const std::string domain = std::to_string(chain.domain());
  Process before({binary("millrace"), "--domain", domain, "services"});
  EXPECT_EQ(before.wait(), 0);
  EXPECT_THAT(before.output(), HasSubstr("first"));
  Process alone({binary("millrace"), "--domain", domain});
  EXPECT_EQ(alone.wait(), 3);
  EXPECT_THAT(alone.output(),
              AllOf(HasSubstr("1 problem; "), HasSubstr("1 service, 1 instance\n"),
                    HasSubstr("no gateway on this fabric: no controller is asked for calls")));
}

TEST_F(TheCommand, ShowsTheStateOfEachChannel) {
  Process cnc = chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc")});
  Process gateway = chain.gateway();
  gateway.await_error("no service has the UUID");
  EXPECT_THAT(run({"channels"}).output(), HasSubstr("unserved"));
  Process service = chain.square_root();
  cnc.await("response = 1.732051");
  EXPECT_THAT(run({"channels"}).output(), HasSubstr("idle"));
}

TEST_F(TheCommand, ShowsTheStateOfEachChannelAgainUntilItIsAskedToEnd) {
  Process cnc = chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc")});
  Process gateway = chain.gateway();
  gateway.await_error("no service has the UUID");
  Process sut = chain.millrace({"channels", "cnc/1", "--watch", "--columns", "channel,state"});
  sut.await("cnc/1 +unserved");
  Process service = chain.square_root();
  sut.await("cnc/1 +idle");
  sut.signal(SIGINT);
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.output(), Not(HasSubstr("cnc/2")));
  for (const Flags& form : {Flags{"--json"}, Flags{"--csv"}, Flags{"-o", "json"}}) {
    Flags command{"channels", "--watch"};
    command.insert(command.end(), form.begin(), form.end());
    run(command);
    EXPECT_EQ(exit_code, 2) << form.front();
  }
}

TEST_F(TheCommand, ShowsTheStatusAgainUntilItIsAskedToEnd) {
  Process service = chain.square_root();
  Process sut = chain.millrace({"status", "--watch"});
  sut.await("NO GATEWAY");
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  sut.await(": no problem; 2 channels");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
}

TEST_F(TheCommand, NamesTheFormOfItsOutputInTheWordsOfOtherTools) {
  Process service = chain.square_root({"--name", "first"});
  const Flags listing{"services", "--columns", "uuid,instances"};
  const auto with = [&](Flags more) {
    more.insert(more.begin(), listing.begin(), listing.end());
    return run(more).output();
  };
  EXPECT_EQ(with({"-o", "csv"}), with({"--csv"}));
  EXPECT_EQ(with({"-o", "json"}), with({"--json"}));
  EXPECT_EQ(exit_code, 0);
  with({"-o", "xml"});
  EXPECT_EQ(exit_code, 2);
}

TEST_F(TheCommand, ShowsTheConnectionToEachController) {
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  gateway.await_error("link up, channels 1, 2");
  std::string machines;
  // Requests are counted over a second.
  for (int i = 0; i < 10 && machines.find("\"requests_per_second\":0,") != 0; ++i) {
    machines = run({"machines", "--json"}).output();
    EXPECT_EQ(exit_code, 0);
    if (machines.find("\"requests_per_second\":0,") == std::string::npos) {
      break;
    }
  }
  EXPECT_THAT(machines, HasSubstr("\"machine\":\"cnc\",\"connected\":true"));
  EXPECT_THAT(machines, HasSubstr("\"channels\":2,\"poll_ms\":10"));
  EXPECT_THAT(machines, Not(HasSubstr("\"requests_per_second\":0,")));
  EXPECT_THAT(machines, Not(HasSubstr("\"round_trip_ms\":0,")));
  EXPECT_THAT(machines, HasSubstr("\"gateway_pid\":" + std::to_string(gateway.pid())));
  EXPECT_THAT(run({"machines"}).output(), HasSubstr("127.0.0.1.1.1"));
  cnc.kill();
  gateway.await_error("link down");
  const std::string down = run({"machines"}).output();
  EXPECT_THAT(down, HasSubstr("down"));
  EXPECT_THAT(down, HasSubstr("127.0.0.1"));
}

TEST_F(TheCommand, PingsEveryInstance) {
  Process first = chain.square_root({"--name", "first"});
  Process second = chain.square_root({"--name", "second"});
  const std::string answers = run({"services", "--ping", square_root}).output();
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(answers, HasSubstr("first"));
  EXPECT_THAT(answers, HasSubstr("second"));
  EXPECT_THAT(answers, Not(HasSubstr("no answer")));
  run({"services", "--ping", "unknown"});
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheCommand, ChecksTheServicesOfAHost) {
  Process service = chain.square_root({"--name", "first"});
  EXPECT_THAT(run({"status", "--host"}).output(), HasSubstr("first"));
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(run({"status", "--host", "elsewhere"}).output(), HasSubstr("'elsewhere'"));
  EXPECT_EQ(exit_code, 1);
  service.signal(SIGSTOP);
  run({"status", "--host"});
  EXPECT_EQ(exit_code, 1);
  service.signal(SIGCONT);
}

TEST_F(TheCommand, CountsAGatewayAsHealthyWhoseControllerIsOff) {
  Process cnc = chain.cnc();
  cnc.terminate();
  EXPECT_EQ(cnc.wait(), 0);
  Process gateway = chain.gateway();
  gateway.await_error("trying again");
  const std::string words = run({"status", "--host"}).output();
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(words, ContainsRegex("\ncnc +down "));
  EXPECT_THAT(run({"status"}).output(), ContainsRegex("LINK DOWN +cnc "));
  EXPECT_EQ(exit_code, 3);
}

TEST_F(TheCommand, ReportsAnUnservedCallByItsExitCode) {
  Process cnc = chain.cnc({"--run", Chain::program(1, "endless_calls.nc")});
  Process gateway = chain.gateway();
  gateway.await_error("link up");
  await("the call to be unserved", [&] {
    run({"status"});
    return exit_code == 5;
  });
  run({"status", "--host"});
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(run({"answer", "cnc/1", "1.5", "--state", "7"}).error_output(),
              AllOf(HasSubstr("the request of cnc/1 has no service: no service has the UUID "),
                    HasSubstr("start the service")));
  EXPECT_EQ(exit_code, 1);
  Process service = chain.square_root();
  await("a plant without problems", [&] {
    run({"status"});
    return exit_code == 0;
  });
}

TEST_F(TheCommand, ReportsACallThatHasWaitedLongerThanAMinuteByItsExitCode) {
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  gateway.await_error("link up");
  Process service = chain.square_root();
  fabric::dds::Participant participant({.domain = chain.domain()});
  fabric::wire::Writer<fabric::ChannelStatus> channels(participant, "millrace");
  fabric::ChannelStatus status{.key = {"cnc", 9},
                               .state = fabric::ChannelState::waiting,
                               .since = std::chrono::system_clock::now(),
                               .uuid = square_root};
  ASSERT_TRUE(channels.write(status));
  EXPECT_THAT(run({"status"}).output(), HasSubstr(": no problem; "));
  EXPECT_EQ(exit_code, 0);
  status.since -= std::chrono::seconds(61);
  ASSERT_TRUE(channels.write(status));
  EXPECT_THAT(run({"status"}).output(),
              ContainsRegex("WAITING +cnc/9 +1m0.s  call waits: all instances are busy"));
  EXPECT_EQ(exit_code, 5);
}

TEST_F(TheCommand, ReportsAFrozenInstanceByItsExitCode) {
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  gateway.await_error("link up");
  Process service = chain.square_root({"--name", "first"});
  EXPECT_THAT(run({"status"}).output(), HasSubstr(": no problem; "));
  EXPECT_EQ(exit_code, 0);
  service.signal(SIGSTOP);
  const std::string who = "pid " + std::to_string(service.pid()) + " on ";
  await("its alarm", [&] { return run({"status"}).output().find(who) != std::string::npos; });
  EXPECT_EQ(exit_code, 5);
  EXPECT_THAT(run({"services"}).output(), HasSubstr(who));
  service.signal(SIGCONT);
  await("its return", [&] {
    run({"status"});
    return exit_code == 0;
  });
}

TEST_F(TheCommand, ReportsMissingGatewaysAndInstancesByItsExitCode) {
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  gateway.await_error("link up");
  Process service = chain.square_root({"--name", "first"});
  run({"status", "--expect-gateway", "cnc", "--expect-service", std::string(square_root) + "=1",
       "--expect-service", "first=1"});
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(run({"status", "--expect-gateway", "cnc", "--expect-gateway", "press"}).output(),
              HasSubstr("no gateway of machine 'press'"));
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(run({"status", "--expect-service", std::string(square_root) + "=2"}).output(),
              ContainsRegex(std::string(square_root) + " +-  1 of 2 expected instances"));
  EXPECT_EQ(exit_code, 1);
  run({"status", "--expect-service", square_root});
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(run({"status", "--help"}).output(), ContainsRegex("\n  6 +a process reports"));
}

TEST_F(TheCommand, NamesAGatewayWhoseLoopHangs) {
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  gateway.await_error("link up");
  const std::string who = "\\(pid " + std::to_string(gateway.pid()) + "\\) \\S+ on \\S+: ";
  EXPECT_THAT(run({"status", "--host"}).output(), ContainsRegex(who + "is there, after "));
  EXPECT_EQ(exit_code, 0);
  const StuckLoop stuck(gateway);
  EXPECT_THAT(run({"status", "--host"}).output(), ContainsRegex(who + "no answer"));
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(run({"status", "--host", "--json"}).output(),
              ContainsRegex("\"healthy\":false.*\"gateways\":\\[\\{.*\"answered\":false"));
}

TEST_F(TheCommand, DrainsAnInstance) {
  Process service = chain.square_root({"--name", "first"});
  EXPECT_THAT(run({"drain", "first"}).error_output(), HasSubstr("has no other instance"));
  EXPECT_EQ(exit_code, 0);
  EXPECT_EQ(service.wait(), 0);
}

TEST_F(TheCommand, DrainsSeveralInstancesByTheBeginningOfTheirNamesOnlyOnceConfirmed) {
  Process first = chain.square_root({"--name", "saw"});
  Process second = chain.square_root({"--name", "sawmill"});
  Process third = chain.square_root({"--name", "sawmill"});
  EXPECT_THAT(run({"drain", "sawm"}).error_output(),
              ContainsRegex("'sawm' is the beginning of 2 instances: sawmill .*--yes"));
  EXPECT_EQ(exit_code, 2);
  run({"drain", "saw"});
  EXPECT_EQ(first.wait(), 0);
  EXPECT_TRUE(second.running());
  run({"drain", "sawm", "--yes"});
  EXPECT_EQ(exit_code, 0);
  EXPECT_EQ(second.wait(), 0);
  EXPECT_EQ(third.wait(), 0);
}

TEST_F(TheCommand, AnswersACallWhoseServiceIsStuck) {
  Process service = chain.square_root();
  Process cnc = chain.cnc({"--run", Chain::program(1, "endless_calls.nc")});
  Process gateway = chain.gateway({"--log-level", "debug"});
  gateway.await_error("answered");
  service.signal(SIGSTOP);
  const Process answer = run({"answer", "cnc/1", "1.5", "--state", "7"});
  EXPECT_THAT(answer.output(), HasSubstr("of cnc/1: ")) << answer.error_output();
  EXPECT_EQ(exit_code, 0);
  run({"answer", "cnc/9", "1.5", "--state", "7"});
  EXPECT_EQ(exit_code, 1);
  service.signal(SIGCONT);
}

// An operator's tool repeats its command until it gets the outcome, while another one pings a
// hundred instances.
TEST_F(TheCommand, RetriesACallOnceDuringManyOtherCommands) {
  Process service = chain.square_root();
  Process cnc = chain.cnc({"--run", Chain::program(1, "endless_calls.nc")});
  Process gateway = chain.gateway({"--log-level", "debug"});
  gateway.await_error("answered");
  service.signal(SIGSTOP);

  fabric::dds::Participant participant({.domain = chain.domain()});
  std::map<fabric::InstanceId, std::string> outcomes;
  fabric::wire::Writer<fabric::Command> commands(participant, "millrace");
  fabric::wire::Reader<fabric::Outcome> outcome_reader(participant, "millrace",
                                                       fabric::wire::Keep::all);
  const auto has_outcome = [&](const fabric::Command& command) {
    for (const auto& taken : outcome_reader.take()) {
      outcomes.insert_or_assign(taken.value.command, taken.value.detail);
    }
    return outcomes.contains(command.id);
  };
  const auto for_gateway = [](fabric::CommandKind kind, const std::string& issuer) {
    return fabric::Command{.id = fabric::InstanceId::random(),
                           .kind = kind,
                           .key = {.machine = "cnc", .channel = 1},
                           .issuer = issuer};
  };
  // The refusal of a command about another call shows the id of this one.
  const fabric::Command other = for_gateway(fabric::CommandKind::retry, "stranger");
  await("a refusal", [&] { return commands.write(other) && has_outcome(other); });
  const std::string refusal = outcomes.at(other.id);
  const std::string pending = refusal.substr(refusal.rfind(' ') + 1);
  fabric::Command retry = for_gateway(fabric::CommandKind::retry, "tester");
  retry.call = {.epoch = std::stoull(pending, nullptr, 16),
                .number = std::stoull(pending.substr(pending.find('-') + 1))};
  await("the outcome", [&] { return commands.write(retry) && has_outcome(retry); });
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(commands.write({.id = fabric::InstanceId::random(),
                                .kind = fabric::CommandKind::ping,
                                .instance = fabric::InstanceId::random()}));
  }
  ASSERT_TRUE(commands.write(retry));
  const fabric::Command last = for_gateway(fabric::CommandKind::ping, "tester");
  await("an answer to the last command", [&] { return commands.write(last) && has_outcome(last); });
  EXPECT_EQ(lines_with(gateway.error_output(), "retry by tester"), 1U) << gateway.error_output();
  EXPECT_THAT(gateway.error_output(), Not(HasSubstr("retry by tester: another call")));
  service.signal(SIGCONT);
}

TEST_F(TheCommand, CallsAServiceWithoutAController) {
  Process service = chain.square_root({"--channel", "press/2"});
  const Process answered =
      run({"call", square_root, "16", "--machine", "press", "--channel", "2", "--raw"});
  EXPECT_EQ(answered.output(), "4.000000\n") << answered.error_output();
  EXPECT_EQ(exit_code, 0);
  const std::string json =
      run({"call", square_root, "-1", "--machine", "press", "--channel", "2", "--json"}).output();
  EXPECT_THAT(json, HasSubstr("\"machine\":\"press\",\"channel\":2"));
  EXPECT_THAT(json, HasSubstr("\"response_state\":99"));
  // Its scope has no call of another channel.
  EXPECT_THAT(run({"call", square_root, "16"}).error_output(), HasSubstr("no response: "));
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheCommand, SendsNoCallForATextThatIsNoUuidAndNamesNoService) {
  Process service = chain.square_root({"--name", "first"});
  EXPECT_EQ(run({"call", "fir", "16", "--raw"}).output(), "4.000000\n");
  EXPECT_THAT(
      run({"call", "nosuch", "16"}).error_output(),
      AllOf(HasSubstr("no service 'nosuch'"), HasSubstr("first ("), Not(HasSubstr("no answer"))));
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheCommand, WaitsForACallThatRunsWhileItsServiceDrains) {
  Process service = chain.slow_service({"--work", "2500"});
  Process call = chain.millrace({"call", "c0ffee00-0000-4000-8000-000000000001", "7", "--raw"});
  await("the handler", [&] {
    return std::filesystem::exists(chain.record()) &&
           std::filesystem::file_size(chain.record()) > 0;
  });
  service.terminate();
  EXPECT_EQ(call.wait(), 0) << call.error_output();
  EXPECT_EQ(call.output(), "7\n");
  EXPECT_EQ(service.wait(), 0);
}

TEST_F(TheCommand, RequiresTheStateOfAnAnswer) {
  EXPECT_THAT(run({"answer", "cnc/1", "1.5"}).error_output(), HasSubstr("--state"));
  EXPECT_EQ(exit_code, 2);
}

TEST_F(TheCommand, RepairsOnlyRecordings) {
  const auto file = chain.folder() / "puts.csv";
  std::ofstream(file) << "id,at,machine\r\n";
  EXPECT_THAT(run({"recording", "repair", file.string()}).error_output(),
              HasSubstr(file.string() + ": it is not a recording"));
  EXPECT_EQ(exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(chain.folder() / "puts.repaired.csv"));
}

TEST_F(TheCommand, ExplainsWhyACallIsNotAnswered) {
  Process service = chain.square_root();
  const std::string near = "560aacbf-6335-44a9-895a-8b27f3ed5e48";
  EXPECT_THAT(run({"call", near, "16"}).error_output(), HasSubstr(square_root));
  EXPECT_EQ(exit_code, 1);
  service.signal(SIGSTOP);
  EXPECT_THAT(run({"call", square_root, "16", "--timeout", "200ms"}).error_output(),
              HasSubstr("no response: "));
  EXPECT_EQ(exit_code, 1);
  service.signal(SIGCONT);
  EXPECT_THAT(run({"call", square_root, std::string(128, '1')}).error_output(),
              HasSubstr("128 bytes"));
  EXPECT_EQ(exit_code, 2);
}

}  // namespace
}  // namespace millrace::tests::integration
