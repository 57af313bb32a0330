// millrace-lcm and LCM programs: they start, answer, fall silent, are killed, leave.
#include <fstream>
#include <optional>

#include <gmock/gmock.h>

#include "tests/integration/lcm/lcm.hpp"
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

TEST_F(Lcm, StopsServingAProgramThatFallsSilent) {
  start();
  {
    const LcmProgram program(uuid);
    ASSERT_TRUE(caller().await_instance(uuid));
  }
  EXPECT_TRUE(caller().await_no_instance(uuid));
  sut->await_error("is gone: silent for 1000 ms; 0 of its calls go to other instances");
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

TEST_F(Lcm, NotifiesAProgramThatItsCallIsWithdrawn) {
  start();
  LcmProgram program(uuid);
  const fabric::Request request = ask("text");
  const request_t heard = program.await_request();
  EXPECT_EQ(heard.text, "text");
  caller().withdraw(request);
  EXPECT_EQ(program.await_withdrawal().call.id, heard.call.id);
  // It behaves as if it had not received the withdrawal, and gets it again.
  EXPECT_EQ(program.await_withdrawal().call.id, heard.call.id);
  program.answer(heard, "late");
  sut->await_error("was answered after it was cancelled; nothing is sent");
  EXPECT_EQ(
      [&] {
        const fabric::Request next = caller().request(uuid, "next");
        caller().publish(next);
        program.answer(program.await_request(), "on time");
        return caller().await_reply(next).text;
      }(),
      "on time");
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

TEST_F(Lcm, UnregistersADrainingProgramWhenItHasAnsweredEverything) {
  start();
  LcmProgram program(uuid);
  const fabric::Request request = ask("last");
  const request_t heard = program.await_request();
  program.change([](presence_t& presence) { presence.draining = 1; });
  // A draining program gets no new calls.
  EXPECT_TRUE(caller().await_no_instance(uuid));
  program.answer(heard, "done");
  EXPECT_EQ(caller().await_reply(request).text, "done");
  sut->await_error("has answered all its calls and is not served any more");
}

TEST_F(Lcm, DistributesCallsAmongTwoProgramsOfAUuid) {
  start();
  LcmProgram one(uuid, "one");
  LcmProgram other(uuid, "other");
  Process first = call(uuid, "first");
  Process second = call(uuid, "second");
  // Each has one call, and not that of the other.
  const request_t for_one = one.await_request();
  const request_t for_other = other.await_request();
  EXPECT_NE(for_one.call.id, for_other.call.id);
  one.answer(for_one, "of one: " + for_one.text);
  other.answer(for_other, "of other: " + for_other.text);
  EXPECT_EQ(first.wait(), 0);
  EXPECT_EQ(second.wait(), 0);
  const std::string both = first.output() + second.output();
  EXPECT_THAT(
      both, AllOf(HasSubstr("of one: " + for_one.text), HasSubstr("of other: " + for_other.text)));
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
  const request_t heard = program.await_request();
  // It has finished the call, but its answer was lost: it is asked again, and answers the same.
  program.change([](presence_t& presence) { presence.calls.clear(); });
  const request_t again = program.await_request();
  EXPECT_EQ(again.call.id, heard.call.id);
  EXPECT_EQ(again.call.attempt, heard.call.attempt);
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
  const request_t heard = program.await_request();
  sut->terminate();
  EXPECT_TRUE(caller().await_no_instance(uuid));
  program.answer(heard, "done");
  EXPECT_EQ(caller().await_reply(request).text, "done");
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
  // The bridge leaves, not the program.
  EXPECT_EQ(program.drains(), 0U);
}

TEST_F(Lcm, ReportsAWrongConfiguration) {
  std::ofstream(config) << "url: 'tcpq://localhost'";
  Process check({binary("millrace-lcm"), "--config", config.string(), "--check"});
  EXPECT_EQ(check.wait(), 2);
  EXPECT_THAT(check.error_output(), HasSubstr(":1:1: url: expected udpm://ADDRESS:PORT?ttl=N"));
  std::ofstream(config) << "mirror { }";
  Process good({binary("millrace-lcm"), "--config", config.string(), "--check"});
  EXPECT_EQ(good.wait(), 0);
  EXPECT_THAT(good.output(), HasSubstr("serves any UUID that a program announces, mirrors"));
}

}  // namespace
}  // namespace millrace::tests::integration
