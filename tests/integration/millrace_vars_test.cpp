// `millrace vars --direct` with a virtual CNC.

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

using Flags = std::vector<std::string>;

class TheVariables : public testing::Test {
 protected:
  TheVariables()
      : cnc_({binary("millrace-cnc"), "--listen", "127.0.0.1:0", "--dir", folder_.path(),
              "--config", test_data("vars/cnc.textproto")}),
        port_(cnc_.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1)) {}

  /// Runs `millrace vars cnc ARGS --direct` to its end; returns its output.
  std::string run(Flags args, const std::string& machine = {}) {
    args.emplace_back("--direct");
    return vars_direct(args, machine);
  }

  /// The same for ARGS that contain that flag.
  std::string vars_direct(const Flags& args, const std::string& machine = {}) {
    Flags command{binary("millrace"), "vars",
                  machine.empty() ? "cnc=127.0.0.1:" + port_ + "/127.0.0.1.1.1" : machine};
    command.insert(command.end(), args.begin(), args.end());
    Process process(std::move(command));
    exit_code = process.wait();
    errors = process.error_output();
    return process.output();
  }

  std::string gateway_configuration() {
    std::ostringstream text;
    text << std::ifstream(test_data("vars/gateway.textproto")).rdbuf();
    std::string content = text.str();
    content.replace(content.find("@PORT@"), 6, port_);
    const std::filesystem::path file = folder_.path() / "gateway.textproto";
    std::ofstream(file) << content;
    return file;
  }

  TemporaryFolder folder_;
  Process cnc_;
  std::string port_;
  int exit_code = -1;
  std::string errors;
};

TEST_F(TheVariables, AreListedByFamilyWithTypeAndMode) {
  const std::string all = run({"list"});
  EXPECT_EQ(exit_code, 0) << errors;
  EXPECT_THAT(all, ContainsRegex("V.G.SERVICE.REQUEST_STATE +UNS32 +4 +READ_WRITE"));
  EXPECT_THAT(all, ContainsRegex("V.E.TABLE +SGN16.3. +6 +READ_WRITE"));
  EXPECT_THAT(all, ContainsRegex("V.E.COUNT +UNS08 +1 +READ_ONLY"));
  EXPECT_THAT(all, HasSubstr("V.A.ABS.X"));
  const std::string external = run({"list", "--family", "V.E", "--json"});
  EXPECT_THAT(external, Not(HasSubstr("V.G.")));
  EXPECT_THAT(external,
              HasSubstr(R"({"name":"V.E.TABLE","family":"V.E","type":"SGN16","mode":"READ_WRITE",)"
                        R"("size":6,"dimensions":[3]})"));
}

// The forms of the names: IB/hmiviaads/15685595531, documented.
TEST_F(TheVariables, WhoseIndexStandsInTheMiddleAreListedReadAndWritten) {
  const std::string all = run({"list", "--family", "V.G"});
  EXPECT_THAT(all, ContainsRegex("V.G.NP.98..V.X +REAL64.99. +792 +READ_WRITE"));
  EXPECT_EQ(run({"write", "V.G.NP[5].V.X", "1.5"}), "V.G.NP[5].V.X was 0, is 1.5\n") << errors;
  EXPECT_THAT(run({"read", "V.G.NP[5].V.X"}), ContainsRegex("READ_WRITE +1.5"));
  EXPECT_THAT(run({"read", "V.G.NP[6].V.X"}), ContainsRegex("READ_WRITE +0"));
  EXPECT_THAT(run({"read", "V.A.+SWE_MDS.X"}), ContainsRegex("READ_ONLY +12.5"));
}

TEST_F(TheVariables, OfEveryTypeAreWrittenAndReadBack) {
  EXPECT_EQ(run({"write", "V.E.LIMIT", "-3.5"}), "V.E.LIMIT was 0, is -3.5\n") << errors;
  EXPECT_EQ(run({"write", "V.E.TABLE", "1", "-2", "3"}),
            "V.E.TABLE was [0, 0, 0], is [1, -2, 3]\n");
  EXPECT_EQ(run({"write", "V.E.TABLE[1]", "7"}), "V.E.TABLE[1] was -2, is 7\n");
  EXPECT_EQ(run({"write", "V.E.ON", "true"}), "V.E.ON was FALSE, is TRUE\n");
  EXPECT_EQ(run({"write", "V.E.NOTE", "[1,2]"}), "V.E.NOTE was \"\", is \"[1,2]\"\n");
  EXPECT_EQ(run({"write", "V.E.NOTE", ""}), "V.E.NOTE was \"[1,2]\", is \"\"\n");
  EXPECT_EQ(run({"write", "V.E.NOTE", "Maß"}), "V.E.NOTE was \"\", is \"Maß\"\n");
  EXPECT_EQ(run({"write", "V.E.LINES", "a", "[b,c]", "-d"}),
            "V.E.LINES was [\"\", \"\", \"\"], is [\"a\", \"[b,c]\", \"-d\"]\n")
      << errors;
  EXPECT_EQ(vars_direct({"write", "--direct", "--", "V.E.LINES", "--e", "--", "f"}),
            "V.E.LINES was [\"a\", \"[b,c]\", \"-d\"], is [\"--e\", \"--\", \"f\"]\n")
      << errors;
  EXPECT_EQ(exit_code, 0);
  const std::string values =
      run({"read", "V.E.LIMIT", "V.E.TABLE", "V.E.ON", "V.E.NOTE", "--json"});
  EXPECT_THAT(values, AllOf(HasSubstr(R"("value":-3.5)"), HasSubstr(R"("value":[1,7,3])"),
                            HasSubstr(R"("value":true)"), HasSubstr(R"("value":"Maß")")));
}

TEST_F(TheVariables, OfEachChannelAreItsOwn) {
  run({"write", "V.E.LIMIT", "2", "--channel", "2"});
  EXPECT_THAT(run({"read", "V.E.LIMIT", "--channel", "1"}), HasSubstr(" 0\n"));
  EXPECT_THAT(run({"read", "V.E.LIMIT", "--channel", "2"}), HasSubstr(" 2\n"));
  run({"read", "V.E.LIMIT", "--channel", "3"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors, HasSubstr("does the controller have a channel 3?"));
}

TEST_F(TheVariables, AreNotWrittenByAValueThatDoesNotFit) {
  for (const auto& [flags, reason] : std::vector<std::pair<Flags, std::string>>{
           {{"V.E.TABLE[0]", "40000"}, "expected -32768 to 32767"},
           {{"V.E.TABLE", "1", "2"}, "2 values for 3 elements"},
           {{"V.E.ON", "yes"}, "expected TRUE or FALSE"},
           {{"V.E.NOTE", std::string(21, 'x')}, "holds 20"},
           {{"V.E.NOTE", "中"}, "cannot be sent to a controller"},
           {{"V.G.SERVICE.REQUEST", std::string(128, 'x'), "--force"}, "128 bytes"},
           {{"V.E.NONE", "1"}, "0x710"}}) {
    Flags command{"write"};
    command.insert(command.end(), flags.begin(), flags.end());
    run(command);
    EXPECT_EQ(exit_code, 1);
    EXPECT_THAT(errors, HasSubstr(reason));
  }
}

TEST_F(TheVariables, AreNotWrittenWhereAFlagIsUnknown) {
  EXPECT_EQ(run({"write", "V.E.TABLE", "1", "2", "--fast", "3"}), "");
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("unexpected argument: "));
  EXPECT_THAT(run({"read", "V.E.TABLE"}), HasSubstr("[0, 0, 0]"));
}

TEST_F(TheVariables, ThatAreReadOnlyOrTheGatewaysAreWrittenByForceOnly) {
  run({"write", "V.E.COUNT", "5"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors, HasSubstr("READ_ONLY"));
  EXPECT_EQ(run({"write", "V.E.COUNT", "5", "--force"}), "V.E.COUNT was 0, is 5\n") << errors;
  run({"write", "V.A.ABS.X", "5", "--force"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors, HasSubstr("V.A.ABS.X is not written: 0x704"));
  run({"write", "V.G.SERVICE.RESPONSE", "x"});
  EXPECT_THAT(errors, HasSubstr("millrace answer"));
}

TEST_F(TheVariables, OfAMachineInTheGatewaysConfigurationAreReadByItsName) {
  const std::string file = gateway_configuration();
  EXPECT_THAT(run({"read", "V.E.LIMIT", "--config", file}, "press"), HasSubstr("REAL64"));
  run({"read", "V.E.LIMIT", "--config", file}, "cnc");
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("names no machine cnc"));
  run({"read", "V.E.LIMIT"}, "press");
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("where is machine press?"));
}

TEST_F(TheVariables, OfAnUnreachableControllerAreNotRead) {
  cnc_.terminate();
  EXPECT_EQ(cnc_.wait(), 0);
  run({"read", "V.E.LIMIT"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(errors, HasSubstr("cannot reach cnc (127.0.0.1:" + port_));
}

}  // namespace
}  // namespace millrace::tests::integration
