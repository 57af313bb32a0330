// millrace-lcm and LCM programs: they start, answer, fall silent, are killed, leave.
#include <fstream>
#include <functional>
#include <optional>

#include <gmock/gmock.h>

#include "fabric/lcm/message.hpp"
#include "tests/integration/lcm/lcm_program.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST_F(Lcm, AnswersWithAProgramInC) {
  start();
  const Process program({MILLRACE_LCM_SQUARE_ROOT});
  ASSERT_TRUE(caller().await_instance(root_uuid));
  EXPECT_EQ(caller().call(root_uuid, "2").text, "1.414214");
  const fabric::Reply bad = caller().call(root_uuid, "-2");
  EXPECT_EQ(bad.text, "ERROR: '-2' has no square root");
  EXPECT_EQ(bad.state, 10U);
  const fabric::InstanceIdentity identity = caller().identity(root_uuid);
  EXPECT_EQ(identity.name, "square_root");
  EXPECT_EQ(identity.description, "Square roots, over LCM");
  EXPECT_EQ(identity.pid, static_cast<std::uint32_t>(sut->pid()));
}

TEST_F(Lcm, ShowsTheProgressOfAProgramInCpp) {
  start();
  const Process program({MILLRACE_LCM_COUNTDOWN});
  Process caller = call(countdown_uuid, "1");
  caller.await_error("^interim: \"still 1\" state 101");
  caller.await("^\"counted 1\" state 1, ok");
  EXPECT_EQ(caller.wait(), 0);
}

TEST_F(Lcm, ServesAnNcProgramThroughAGateway) {
  start();
  LcmProgram program(uuid);
  Process cnc = chain.cnc({"--run", "1=" + chain.counting_program(uuid, 20), "--exit-when-idle"});
  const Process gateway = chain.gateway();
  for (int i = 0; i < 20; ++i) {
    const request_t request = program.await_request();
    EXPECT_EQ(request.machine, "cnc");
    EXPECT_EQ(request.channel, 1);
    program.answer(request, request.text);
  }
  cnc.await("20 calls answered");
}

TEST_F(Lcm, DispatchesACallToAnotherProgramWhenTheFirstIsKilled) {
  start();
  Process first({MILLRACE_LCM_COUNTDOWN});
  Process caller = call(countdown_uuid, "100");
  caller.await_error("^interim: \"still 100\"");
  const Process second({MILLRACE_LCM_COUNTDOWN});
  first.kill();
  sut->await_error("is gone: silent for 1000 ms; 1 of its calls go to other instances");
  sut->await_error("call \\S+ from \\S+: \"100\", state 1, attempt 2");
  sut->await_error("attempt 2\n(.*\n)*.* is in progress: \"still 100\"");
}

TEST_F(Lcm, BlocksAnAtMostOnceCallWhoseProgramIsGone) {
  start("service { uuid: '" + uuid + "' delivery: AT_MOST_ONCE }");
  std::optional<LcmProgram> program(uuid);
  const Process cnc = chain.cnc({"--run", "1=" + chain.counting_program(uuid, 1)});
  const Process gateway = chain.gateway();
  program->await_request();
  program.reset();
  await("the call to be held", [&] {
    Process channels = chain.millrace({"channels"});
    channels.wait();
    return channels.output().find("held") != std::string::npos;
  });
}

TEST_F(Lcm, ResumesACallThatItsProgramContinuedWhenTheBridgeWasKilled) {
  start();
  const Process program({MILLRACE_LCM_COUNTDOWN});
  Process caller = call(countdown_uuid, "4");
  caller.await_error("^interim: \"still 4\"");
  sut->kill();
  start();
  caller.await("^\"counted 4\" state 1, ok");
  // It does not run a second time, but is requested a second time.
  EXPECT_THAT(sut->error_output(),
              AllOf(HasSubstr("\"4\", state 1, attempt 2"), Not(HasSubstr("\"still 4\""))));
}

TEST_F(Lcm, StopsAProgramInCppWhenItsCallIsCancelled) {
  start();
  const Process program({MILLRACE_LCM_COUNTDOWN});
  Process caller = call(countdown_uuid, "100");
  caller.await_error("^interim: \"still 100\"");
  caller.terminate();
  caller.wait();
  sut->await_error("call \\S+ is cancelled");
  // Its room is free for the next call.
  Process next = call(countdown_uuid, "1");
  next.await("^\"counted 1\" state 1, ok");
}

TEST_F(Lcm, DrainsAProgramOnAnOperatorsCommand) {
  start();
  Process program({MILLRACE_LCM_COUNTDOWN});
  ASSERT_TRUE(caller().await_instance(countdown_uuid));
  const std::string instance = caller().identity(countdown_uuid).id.to_string();
  Process drain = chain.millrace({"drain", instance});
  EXPECT_EQ(drain.wait(), 0) << drain.error_output();
  EXPECT_EQ(program.wait(), 0);
  EXPECT_TRUE(caller().await_no_instance(countdown_uuid));
}

TEST_F(Lcm, RepeatsALostRequest) {
  start();
  LcmProgram program(uuid);
  ASSERT_TRUE(caller().await_instance(uuid));
  program.ignore_requests(true);
  const fabric::Request request = caller().request(uuid, "text");
  caller().publish(request);
  sut->await_error("call \\S+ from cnc/1: \"text\"");
  program.ignore_requests(false);
  const request_t lcm_request = program.await_request();
  // It has finished the call, but its answer was lost: it is asked again, and answers the same.
  program.change([](presence_t& presence) { presence.calls.clear(); });
  const request_t again = program.await_request();
  EXPECT_EQ(again.call.id, lcm_request.call.id);
  EXPECT_EQ(again.call.attempt, lcm_request.call.attempt);
  program.answer(again, "done");
  EXPECT_EQ(caller().await_reply(request).text, "done");
}

TEST_F(Lcm, ServesOnlyTheUuidsOfItsConfiguration) {
  start("any_uuid: false service { uuid: '" + root_uuid +
        "' delivery: AT_MOST_ONCE channel: 'cnc/1' }");
  const LcmProgram other(uuid);
  sut->await_error("announces " + uuid + ", which the configuration does not name");
  const Process program({MILLRACE_LCM_SQUARE_ROOT});
  ASSERT_TRUE(caller().await_instance(root_uuid));
  const fabric::InstanceIdentity identity = caller().identity(root_uuid);
  EXPECT_EQ(identity.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(identity.channels, std::vector{(fabric::ChannelScope{"cnc", 1})});
}

TEST_F(Lcm, LeavesWhenTheCallsUnderWayAreAnswered) {
  start();
  LcmProgram program(uuid);
  const fabric::Request request = ask("last");
  const request_t lcm_request = program.await_request();
  sut->terminate();
  EXPECT_TRUE(caller().await_no_instance(uuid));
  program.answer(lcm_request, "done");
  EXPECT_EQ(caller().await_reply(request).text, "done");
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
  // The bridge leaves, not the program.
  EXPECT_EQ(program.drains(), 0U);
}

// Valid and invalid answers of LCM programs.

/// A program's reaction to a call.
class LcmAnswer : public Lcm {
 protected:
  using Say = std::function<void(LcmProgram&, const request_t&)>;

  /// Returns the NC program's answer for this reaction.
  fabric::Reply answer(const Say& say) {
    if (!sut) {
      start();
      program.emplace(uuid);
    }
    const fabric::Request request = ask("text");
    say(*program, program->await_request());
    const fabric::Reply reply = caller().await_reply(request);
    caller().withdraw(request);
    return reply;
  }

  std::optional<LcmProgram> program;
};

TEST_F(LcmAnswer, CountsOnlyFromTheProgramThatGotTheRequest) {
  std::optional<LcmProgram> stranger;
  const auto say = [&](LcmProgram& asked, const request_t& request) {
    stranger.emplace(uuid, "stranger");
    // In its own name, announced before or not, and in the name of the program that was asked.
    stranger->answer(request, "mine");
    stranger->send(asked.reply_to(request, "forged"));
    sut->await_error("answers (attempt 1 of )?call " + request.call.id +
                     ", (which was not dispatched to it|but)");
    sut->await_error("with the number of program");
    asked.answer(request, "the answer");
  };
  EXPECT_EQ(answer(say).text, "the answer");
}

TEST_F(LcmAnswer, ArrivesDuringAFloodThatIsLoggedOnce) {
  const auto say = [&](LcmProgram& asked, const request_t& request) {
    LcmProgram stranger(uuid, "stranger");
    const reply_t forged = asked.reply_to(request, "forged");
    constexpr int many = 20'000;
    for (int i = 0; i < many; ++i) {
      stranger.publish(stranger.reply_channel(), "nonsense");
      stranger.send(forged);
      stranger.publish("MILLRACE_PRESENCE", "nonsense");
      stranger.publish("CAMERA." + std::to_string(i), std::string(1000, 'p'));
    }
    asked.answer(request, "the answer");
  };
  EXPECT_EQ(answer(say).text, "the answer");
  const auto warned = [&](const std::string& what) {
    const std::string log = sut->error_output();
    std::size_t count = 0;
    for (std::size_t at = 0; (at = log.find(what, at)) != std::string::npos; ++at) {
      ++count;
    }
    return count;
  };
  EXPECT_EQ(warned("is not a reply: "), 1U);
  EXPECT_EQ(warned("is not a presence message: "), 1U);
  EXPECT_EQ(warned("with the number of program"), 1U);
}

}  // namespace
}  // namespace millrace::tests::integration
