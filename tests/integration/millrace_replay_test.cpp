// A recording in place of machines, of services and of a controller, with the real programs.
#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/data.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// The requests of the demo's two programs with the answers of a square root service: six calls.
const std::string demo_recording = test_data("recordings/demo.mcap");

class Replay : public ChainTest {
 protected:
  static std::string demo_program(int channel, const std::string& file) {
    return std::to_string(channel) + "=" + MILLRACE_DEMO_PROGRAMS "/" + file;
  }

  /// A virtual CNC that runs the demo's programs to their end.
  Process demo_cnc() {
    return chain.cnc({"--run", demo_program(1, "square_root_of_3.nc"), "--run",
                      demo_program(2, "square_roots.nc"), "--exit-when-idle"});
  }

  Process wrong_square_root() const {
    Process process({MILLRACE_WRONG_SQUARE_ROOT, "--domain", std::to_string(chain.domain())});
    process.await("^ready: ");
    return process;
  }
};

TEST_F(Replay, VerifiesAServiceAgainstARecordedRunAndFindsAWrongDigit) {
  const std::string file = chain.folder() / "run.mcap";
  Process gateway = [&] {
    Process recorder = chain.millrace({"record", "-o", file});
    recorder.await("^ready: ");
    Process service = chain.square_root();
    Process cnc = demo_cnc();
    Process live = chain.gateway();
    EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
    recorder.terminate();
    EXPECT_EQ(recorder.wait(), 0);
    service.terminate();
    EXPECT_EQ(service.wait(), 0);
    return live;
  }();
  {
    // The gateway still runs: a replay takes no channel from it.
    Process service = chain.square_root();
    const Process same = run({"replay", "--to-services", "--verify", file});
    EXPECT_EQ(exit_code, 0) << same.output() << same.error_output();
    EXPECT_THAT(same.output(), HasSubstr("6 same"));
  }
  Process wrong = wrong_square_root();
  const std::string found = run({"replay", "--to-services", "--verify", "--fast", file}).output();
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(found,
              AllOf(HasSubstr("of cnc/1, service 560AACBF"), HasSubstr("request   \"3\" state 1"),
                    HasSubstr("recorded  \"1.732051\" state 1\n  answered  \"1.732052\" state 1\n"
                              "                    ^"),
                    HasSubstr("1 same, 5 differs")));
  run({"replay", "--to-services", "--verify", "--fast", "--tolerance", "0.000001", file});
  EXPECT_EQ(exit_code, 0);
  run({"replay", "--to-services", "--fast", file});
  EXPECT_EQ(exit_code, 0);
}

TEST_F(Replay, MarksEveryCallAsReplayed) {
  const std::string file = chain.folder() / "replayed.mcap";
  Process recorder = chain.millrace({"record", "-o", file});
  recorder.await("^ready: ");
  Process service = chain.square_root();
  run({"replay", "--to-services", "--fast", demo_recording});
  EXPECT_EQ(exit_code, 0);
  recorder.terminate();
  EXPECT_EQ(recorder.wait(), 0);
  for (const char* kind : {"request", "reply"}) {
    const std::string entries = run({"recording", "cat", "--json", "--kind", kind, file}).output();
    EXPECT_GT(lines_with(entries, "\"machine\""), 0U);
    EXPECT_EQ(lines_with(entries, "\"replayed\":true"), lines_with(entries, "\"machine\""));
    EXPECT_THAT(entries, Not(HasSubstr("\"machine\":\"cnc\"")));
  }
  const std::string events = run({"recording", "cat", "--json", "--kind", "event", file}).output();
  EXPECT_EQ(lines_with(events, "\"replayed\":true"), lines_with(events, "\"machine\""));
  EXPECT_GT(lines_with(events, "\"machine\""), 0U);
}

TEST_F(Replay, OfTheDemoRecordingStillVerifies) {
  Process service = chain.square_root();
  const Process replay = run({"replay", "--to-services", "--verify", "--json", demo_recording});
  EXPECT_EQ(exit_code, 0) << replay.output();
  EXPECT_EQ(lines_with(replay.output(), "\"result\":\"same\""), 6U) << replay.output();
  EXPECT_THAT(replay.output(), HasSubstr("{\"summary\":{\"calls\":6,"));
}

TEST_F(Replay, NamesAMissingService) {
  const Process replay = run({"replay", "--to-services", "--wait", "300ms", demo_recording});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(replay.error_output(), HasSubstr("still missing: no service has the UUID 560AACBF"));
  EXPECT_EQ(replay.output(), "");
}

TEST_F(Replay, StandsInForAService) {
  Process replay = chain.millrace({"replay", "--as-service", "--verify", demo_recording});
  replay.await("^ready: ");
  Process cnc = demo_cnc();
  Process gateway = chain.gateway();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] response = 1.732051\n"));
  EXPECT_THAT(cnc.output(), HasSubstr("[ch2] call 4: state 1, 1000.000000\n"));
  EXPECT_EQ(replay.wait(), 0) << replay.output();
  EXPECT_THAT(replay.output(), HasSubstr("6 calls answered from the recording, 0 did not match"));
}

TEST_F(Replay, StandingInForAServiceAnswersAnOperatorAsAnInstanceDoes) {
  Process replay = chain.millrace({"replay", "--as-service", demo_recording});
  replay.await("^ready: ");
  Process gateway = [&] {
    Process cnc = chain.cnc({"--run", demo_program(1, "square_root_of_3.nc"), "--exit-when-idle"});
    Process live = chain.gateway();
    EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
    return live;
  }();
  const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  EXPECT_THAT(run({"services", "--ping", square_root}).output(), HasSubstr("runs 0 calls"));
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(run({"drain", square_root}).output(), HasSubstr("leaves when the calls it runs"));
  EXPECT_EQ(exit_code, 0);
  EXPECT_EQ(replay.wait(), 0) << replay.output();
  EXPECT_THAT(replay.output(), HasSubstr("1 calls answered from the recording, 0 did not match"));
  EXPECT_THAT(replay.error_output(), HasSubstr("commands the replayed service " + square_root));
}

TEST_F(Replay, StandingInForAServiceReportsTheExpectedRequest) {
  Process replay = chain.millrace({"replay", "--as-service", demo_recording});
  replay.await("^ready: ");
  Process cnc = chain.cnc({"--run", Chain::program(2, "negative_number.nc"), "--exit-when-idle"});
  Process gateway = chain.gateway();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch2] 500: ERROR: replay: call 1 of 5 asks \"2\"\n"));
  replay.terminate();
  EXPECT_EQ(replay.wait(), 1);
  EXPECT_THAT(replay.output(),
              AllOf(HasSubstr("expected next is call 1 of 5 of this channel"),
                    HasSubstr("\"2\" state 1"), HasSubstr("answered \"1.414214\" state 1"),
                    HasSubstr("the request was \"-2\" state 1 of cnc/2")));
}

TEST_F(Replay, DoesNotStandInBesideTheServiceItself) {
  Process service = chain.square_root();
  const Process replay = run({"replay", "--as-service", demo_recording});
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(replay.error_output(), HasSubstr("the replay would take its calls"));
}

TEST_F(Replay, StandsInForTheController) {
  Process replay = chain.stand_in({"--verify", "--wait", "30s", demo_recording});
  Process gateway = chain.gateway();
  Process service = chain.square_root();
  EXPECT_EQ(replay.wait(), 0) << replay.output() << replay.error_output();
  EXPECT_THAT(replay.output(), HasSubstr("6 same"));
}

TEST_F(Replay, StandingInForTheControllerAnswersTheLastWriteBeforeItEnds) {
  Process replay = chain.stand_in({"--fast", "--wait", "30s", demo_recording});
  Process gateway = chain.gateway();
  Process service = chain.square_root();
  EXPECT_EQ(replay.wait(), 0) << replay.output() << replay.error_output();
  gateway.await_error("connection|link|down");
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);
  EXPECT_THAT(gateway.error_output(), Not(HasSubstr("may or may not have reached the controller")));
}

TEST_F(Replay, StandsInForAControllerWithTheLastChannelThatThereIs) {
  Process replay = chain.stand_in({"--channel", "cnc/2=cnc/255", demo_recording});
  replay.terminate();
  replay.wait();
}

TEST_F(Replay, StandingInForTheControllerFindsAWrongDigit) {
  Process replay = chain.stand_in({"--verify", "--fast", "--wait", "30s", demo_recording});
  Process gateway = chain.gateway();
  Process wrong = wrong_square_root();
  EXPECT_EQ(replay.wait(), 1) << replay.error_output();
  EXPECT_THAT(replay.output(), HasSubstr("answered  \"1.732052\" state 1"));
}

TEST_F(Replay, RefusesInvalidOptions) {
  for (const Flags& flags : std::vector<Flags>{{},
                                               {"--to-services", "--as-cnc"},
                                               {"--to-services", "--fast", "--rate", "2"},
                                               {"--to-services", "--rate", "0"},
                                               {"--to-services", "--channel", "cnc/x=1"},
                                               {"--to-services", "--tolerance", "much"},
                                               {"--to-services", "--uuid", "unknown"},
                                               {"--as-cnc", "--listen", "nowhere"},
                                               {"--as-service", "--step"}}) {
    Flags command{"replay", demo_recording};
    command.insert(command.end(), flags.begin(), flags.end());
    const Process replay = run(command);
    EXPECT_EQ(exit_code, 2) << testing::PrintToString(flags);
    EXPECT_THAT(replay.error_output(), HasSubstr("millrace: "));
  }
}

}  // namespace
}  // namespace millrace::tests::integration
