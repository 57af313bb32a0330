// Variables of a controller through its gateway: `millrace vars` and other clients.
#include <chrono>
#include <csignal>
#include <memory>
#include <optional>

#include <boost/asio/io_context.hpp>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/variable_endpoints.hpp"
#include "fabric/wire/reader.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/data.hpp"
#include "tests/support/wait_for.hpp"
#include "tools/bus/operator.hpp"

namespace millrace::tests::integration {
namespace {

using fabric::VariableReply;
using fabric::VariableRequest;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string machine(const std::string& more = {}) {
  return "machine { name: \"press\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
         "watch: POLL " +
         more + " }\n";
}

constexpr const char* writable = "variables { write: \"V.E.*\" write: \"V.A.*\" }";

/// A virtual CNC with variables of every kind, and a client.
class VariablesOverTheFabric : public testing::Test {
 protected:
  Process start_cnc() { return chain.cnc({"--config", test_data("vars/cnc.textproto")}); }
  Process start_gateway(const std::string& more = writable) {
    Process gateway = chain.configured_gateway(machine(more));
    gateway.await_error("link up");
    return gateway;
  }

  /// Runs `millrace vars press ARGS` to its end; returns its output.
  std::string vars(const Flags& args, const std::string& name = "press") {
    Flags command{"vars", name};
    command.insert(command.end(), args.begin(), args.end());
    Process process = chain.millrace(std::move(command));
    exit_code = process.wait();
    errors = process.error_output();
    return process.output();
  }

  Chain chain;
  int exit_code = -1;
  std::string errors;
};

TEST_F(VariablesOverTheFabric, AreListedReadAndWrittenAsDirectlyAtTheController) {
  Process cnc = start_cnc();
  Process gateway = start_gateway();
  const std::string direct = "cnc=127.0.0.1:" + std::to_string(chain.port()) + "/127.0.0.1.1.1";

  EXPECT_EQ(vars({"write", "V.E.LIMIT", "-3.5"}), "V.E.LIMIT was 0, is -3.5\n") << errors;
  EXPECT_EQ(vars({"write", "V.E.TABLE", "1", "-2", "3"}),
            "V.E.TABLE was [0, 0, 0], is [1, -2, 3]\n");
  EXPECT_EQ(vars({"write", "V.E.TABLE[1]", "7"}), "V.E.TABLE[1] was -2, is 7\n");
  EXPECT_EQ(vars({"write", "V.E.ON", "true"}), "V.E.ON was FALSE, is TRUE\n");
  EXPECT_EQ(vars({"write", "V.E.NOTE", "Maß"}), "V.E.NOTE was \"\", is \"Maß\"\n");
  EXPECT_THAT(vars({"write", "V.E.LIMIT", "2", "--json"}),
              AllOf(HasSubstr(R"("before":-3.5)"), HasSubstr(R"("value":2)")));
  EXPECT_EQ(exit_code, 0) << errors;
  gateway.await_error(
      "press/1: V\\.E\\.TABLE was \\[0, 0, 0\\], is written as \\[1, -2, 3\\], by ");

  for (const Flags& args :
       {Flags{"list"}, Flags{"list", "--json"}, Flags{"list", "--family", "V.E"},
        Flags{"read", "V.E.LIMIT", "V.E.TABLE", "V.E.TABLE[1]", "V.E.ON", "V.E.NOTE", "V.A.ABS.X"},
        Flags{"read", "V.E.LIMIT", "V.E.TABLE", "V.E.ON", "V.E.NOTE", "V.E.COUNT", "--json"}}) {
    Flags directly = args;
    directly.emplace_back("--direct");
    const std::string through = vars(args);
    EXPECT_EQ(exit_code, 0) << errors;
    EXPECT_EQ(through, vars(directly, direct)) << errors;
    EXPECT_THAT(through, Not(IsEmpty()));
  }
  EXPECT_THAT(vars({"read", "mode", "cnc_number_of_channel_r"}),
              ContainsRegex("mode +UNS32 +READ_ONLY +1\n"));
}

TEST_F(VariablesOverTheFabric, OfProgramsAreListedAsWhatTheyAre) {
  Process cnc = chain.cnc({"--config", test_data("vars/cnc.textproto"), "--run",
                           "1=" + test_data("vars/variables_of_its_own.nc").string()});
  cnc.await("\\[ch1\\] waits");
  Process gateway = start_gateway();
  const std::string direct = "cnc=127.0.0.1:" + std::to_string(chain.port()) + "/127.0.0.1.1.1";

  const std::string listed = vars({"list", "--family", "V.P", "--family", "P"});
  EXPECT_THAT(listed, ContainsRegex("V.P.TABLE +SGN16.2. +4 +READ_WRITE")) << errors;
  EXPECT_THAT(listed, ContainsRegex("V.P.TEXT +STRING +21 +READ_WRITE"));
  EXPECT_THAT(listed, ContainsRegex("P12 +REAL64 +8 +READ_WRITE"));
  EXPECT_EQ(listed, vars({"list", "--family", "V.P", "--family", "P", "--direct"}, direct));
  EXPECT_THAT(vars({"read", "V.P.TEXT", "V.P.TABLE"}),
              AllOf(ContainsRegex("STRING +READ_WRITE +\"part\""), HasSubstr("[7, -8]")));
}

TEST_F(VariablesOverTheFabric, ThatCannotBeReadAreNamedWithTheReason) {
  Process cnc = start_cnc();
  Process gateway = start_gateway();
  EXPECT_THAT(vars({"read", "V.E.NONE", "V.E.LIMIT"}), HasSubstr("V.E.LIMIT"));
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors,
              ContainsRegex("millrace: press, channel 1: V.E.NONE: 0x710 symbol not found; "
                            "'millrace vars press list --domain [0-9]+' shows the variables"));
  vars({"read", "V.E.LIMIT", "--channel", "3", "--timeout", "500ms"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors, HasSubstr("has answered for press/3 within 500 ms"));
}

TEST_F(VariablesOverTheFabric, AreWrittenOnlyWhereConfiguredAndTheServiceInterfaceNever) {
  Process cnc = start_cnc();
  Process gateway = start_gateway("variables { write: \"V.E.LIMIT\" channel: 2 }");
  vars({"write", "V.E.LIMIT", "1"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors,
              HasSubstr("V.E.LIMIT may not be written: the gateway's configuration does not "
                        "list it; variables { write: \"V.E.LIMIT\" } does"));
  EXPECT_EQ(vars({"write", "V.E.LIMIT", "1", "--channel", "2"}), "V.E.LIMIT was 0, is 1\n");
  for (const char* name : {"V.G.SERVICE.UUID", "v.g.service.uuid", "V.G.SERVICE .UUID"}) {
    vars({"write", name, "x", "--channel", "2"});
    EXPECT_EQ(exit_code, 1);
    EXPECT_THAT(errors, HasSubstr("never written over the fabric"));
  }
  vars({"write", "V.E.LIMIT", "1", "--force"});
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("--force needs --direct"));
  vars({"read", "V.E.LIMIT"}, "press=127.0.0.1:1/1.1.1.1.1.1");
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("which needs --direct"));

  // A new configuration takes effect at once.
  chain.configure(machine("variables { write: \"V.E.*\" }"));
  gateway.signal(SIGHUP);
  gateway.await_error("read again");
  EXPECT_EQ(vars({"write", "V.E.LIMIT", "4"}), "V.E.LIMIT was 0, is 4\n") << errors;
  EXPECT_THAT(gateway.error_output(), Not(HasSubstr("link down")));
}

TEST_F(VariablesOverTheFabric, ReportAnUnreachableController) {
  std::optional<Process> cnc(start_cnc());
  Process gateway = start_gateway();
  EXPECT_THAT(vars({"read", "V.E.LIMIT"}), HasSubstr("V.E.LIMIT"));
  cnc->kill();
  gateway.await_error("link down");
  vars({"read", "V.E.LIMIT"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors, HasSubstr("press, channel 1: the link to press is down: "));
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);

  Process never = chain.configured_gateway(machine());
  never.await_error("trying again");
  vars({"read", "V.E.LIMIT"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors, HasSubstr("the link to press is down: "));
  never.terminate();
  EXPECT_EQ(never.wait(), 0);

  vars({"read", "V.E.LIMIT", "--timeout", "600ms"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(
      errors,
      AllOf(HasSubstr("no gateway on fabric 'millrace'"), HasSubstr("--direct"),
            HasSubstr(fmt::format("'millrace machines --domain {}' lists", chain.domain()))));
}

TEST_F(VariablesOverTheFabric, AreAnsweredByTheGatewayThatTakesTheMachineOver) {
  Process cnc = start_cnc();
  Process first = start_gateway();
  Process second = chain.configured_gateway(machine(writable));
  second.await_error("stands by");
  EXPECT_EQ(vars({"write", "V.E.LIMIT", "1"}), "V.E.LIMIT was 0, is 1\n") << errors;
  first.kill();
  // The request comes while no gateway serves the machine; the next one answers it.
  EXPECT_THAT(vars({"read", "V.E.LIMIT", "--timeout", "10s"}), HasSubstr(" 1\n")) << errors;
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(second.error_output(), HasSubstr("link up"));
}

TEST_F(VariablesOverTheFabric, AreGivenUpWhenTheGatewayHangsOrDiesDuringTheRequest) {
  Process cnc = start_cnc();
  Process gateway = start_gateway();
  fabric::dds::Participant participant({.domain = chain.domain()});
  tools::bus::VariableClient requester(participant, {"press", 1}, std::chrono::seconds(1), "");
  ASSERT_TRUE(requester.ask({.names = {"V.E.LIMIT"}}));
  const VariableRequest write{
      .action = fabric::VariableAction::write, .names = {"V.E.LIMIT"}, .values = {{"1"}}};
  gateway.signal(SIGSTOP);
  const auto hung = requester.ask({.names = {"V.E.LIMIT"}});
  ASSERT_FALSE(hung);
  EXPECT_THAT(hung.error(),
              AllOf(HasSubstr("has answered for press/1 within 1000 ms"), HasSubstr("or hangs"),
                    Not(HasSubstr("may or may not be written"))));
  const auto unknown = requester.ask(write);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error(), HasSubstr("it may or may not be written; read it"));
  gateway.kill();
  const auto dead = requester.ask(write);
  ASSERT_FALSE(dead);
  EXPECT_THAT(dead.error(), HasSubstr("it may or may not be written; read it"));
}

/// HMIs: clients with their own requests.
struct Panel {
  Panel(const fabric::dds::Participant& participant, boost::asio::io_context& io)
      : end(participant, io.get_executor(), [this](const VariableReply& reply) { last = reply; }) {}

  VariableRequest question(VariableRequest request) const {
    request.requester = end.id();
    request.token = fabric::InstanceId::random();
    request.key = {"press", 1};
    request.issuer = "panel";
    return request;
  }

  std::optional<VariableReply> last;
  fabric::endpoints::VariableRequestEndpoint end;
};

class ManyPanels : public VariablesOverTheFabric {
 protected:
  std::optional<VariableReply> answer(Panel& panel, const VariableRequest& request) {
    panel.last.reset();
    const VariableRequest asked = panel.question(request);
    EXPECT_TRUE(run_until(io, [&] { return panel.end.gateways() > 0; }));
    EXPECT_TRUE(panel.end.publish(asked));
    EXPECT_TRUE(run_until(io, [&] { return panel.last && panel.last->token == asked.token; }));
    return panel.last;
  }

  boost::asio::io_context io;
  fabric::dds::Participant participant{{.domain = chain.domain()}};
};

TEST_F(ManyPanels, AreRefusedExcessRequestsAndServedAfterwards) {
  Process cnc = start_cnc();
  Process gateway = start_gateway();
  Panel panel(participant, io);
  for (const auto& [names, reason] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{std::string(1U << 20U, 'A')}, "the request has 1048576 bytes of names"},
           {std::vector<std::string>(1000, "V.E.LIMIT"), "the request has 1000 names; at most 256"},
           {{std::string("V.E.\0LIMIT", 10)}, "name 0 has a NUL at byte 4"},
           {{std::string(300, 'V')}, "name 0 has 300 bytes"},
           {{}, "names no variable"}}) {
    const auto reply = answer(panel, {.names = names});
    ASSERT_TRUE(reply);
    EXPECT_FALSE(reply->done);
    EXPECT_THAT(reply->reason, HasSubstr(reason));
  }
  const auto reply = answer(panel, {.names = {"V.E.LIMIT"}});
  ASSERT_TRUE(reply);
  EXPECT_TRUE(reply->done) << reply->reason.text;
}

TEST_F(ManyPanels, AreNotifiedWhenTheControllerDoesNotAnswer) {
  Process cnc = start_cnc();
  Process gateway = start_gateway();
  Panel panel(participant, io);
  ASSERT_TRUE(answer(panel, {.names = {"V.E.LIMIT"}}));
  cnc.signal(SIGSTOP);
  // A different question: a value read within the last 2 ms would answer the same one.
  const auto reply = answer(
      panel, {.names = {"V.G.SERVICE.REQUEST_STATE"}, .patience = std::chrono::milliseconds(300)});
  cnc.signal(SIGCONT);
  ASSERT_TRUE(reply);
  EXPECT_FALSE(reply->done);
  EXPECT_THAT(reply->reason, HasSubstr("within 300 ms"));
}

TEST_F(VariablesOverTheFabric, ThatAreWrittenAreRecordedWithTheirWriter) {
  Process cnc = start_cnc();
  const std::string file = (chain.folder() / "run.mcap").string();
  Process record = chain.millrace({"record", "-o", file});
  record.await("^ready: ");
  Process gateway = start_gateway();
  vars({"write", "V.E.LIMIT", "9"});
  vars({"write", "V.G.SERVICE.UUID", "x"});
  await("both in the recording", [&] {
    // While it is being written; it may not exist yet.
    Process cat = chain.millrace({"recording", "cat", file + ".part", "--kind", "outcome"});
    cat.wait();
    return cat.output().find("never written") != std::string::npos;
  });
  record.terminate();
  ASSERT_EQ(record.wait(), 0) << record.error_output();
  Process cat = chain.millrace({"recording", "cat", file, "--kind", "outcome"});
  ASSERT_EQ(cat.wait(), 0) << cat.error_output();
  EXPECT_THAT(cat.output(),
              AllOf(ContainsRegex("done.*press/1: V.E.LIMIT was 0, is written as 9, by [^ ]+@"),
                    ContainsRegex("refused.*press/1: V.G.SERVICE.UUID is never written")));
}

}  // namespace
}  // namespace millrace::tests::integration
