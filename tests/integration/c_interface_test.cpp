// The C interface as C programs use it: processes that are linked only with libmillrace.so.1.
#include <algorithm>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/dds/entity.hpp"
#include "fabric/wire/reader.hpp"
#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/data.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"

namespace millrace {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;
using tests::Process;

const std::string first = "c0000000-0000-4000-8000-000000000001";
const std::string second = "c0000000-0000-4000-8000-000000000002";

/// DDS participants of a process, as this one has discovered them.
std::size_t participants_of(pid_t pid, std::uint32_t domain) {
  dds_entity_t own = 0;
  dds_lookup_participant(domain, &own, 1);
  const fabric::dds::Entity reader(
      dds_create_reader(own, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr));
  std::size_t count = 0;
  const auto use = [&](const dds_builtintopic_participant_t& sample, const dds_sample_info_t&) {
    char* value = nullptr;
    count += dds_qget_prop(sample.qos, "__Pid", &value) && value == std::to_string(pid) ? 1U : 0U;
    dds_free(value);
  };
  while (fabric::wire::take_lent<dds_builtintopic_participant_t>(reader.handle(), use) > 0) {
  }
  return count;
}

class CInterface : public testing::Test {
 protected:
  [[nodiscard]] Process start(const char* program, std::vector<std::string> arguments = {}) const {
    std::vector<std::string> command{"/usr/bin/env",
                                     "MILLRACE_DOMAIN=" + std::to_string(domain.number()), program};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return Process(std::move(command));
  }
  [[nodiscard]] Process client(std::vector<std::string> arguments) const {
    return start(MILLRACE_C_CLIENT, std::move(arguments));
  }

  tests::Domain domain;
  tests::Caller caller{domain.number()};
};

class CService : public CInterface {
 protected:
  CService() { sut.await("^ready: " + first); }

  Process sut = start(MILLRACE_C_SERVICE, {first, second});
};

TEST_F(CInterface, ReadsTheCallsOfARecording) {
  Process sut = client({"recording", tests::test_data("recordings/demo.mcap")});
  ASSERT_EQ(sut.wait(), 0) << sut.output();
  EXPECT_THAT(sut.output(), HasSubstr("cnc/2 0.25 -> 0.500000, state 1, answered by square_root, "
                                      "total 1, first: seen by the gateway, beyond: 1\n"));
  const std::string output = sut.output();
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 6) << output;
}

TEST_F(CInterface, ReportsARecordingThatCannotBeReadOrIsDamaged) {
  Process missing = client({"recording", "/nowhere.mcap"});
  EXPECT_EQ(missing.wait(), 1);
  EXPECT_THAT(missing.output(), StartsWith("error 1: "));
  EXPECT_THAT(missing.output(), HasSubstr("/nowhere.mcap"));
  Process foreign = client({"recording", tests::test_data("recordings/earlier.hex")});
  EXPECT_EQ(foreign.wait(), 0);
  EXPECT_THAT(foreign.output(), StartsWith("problem: at byte 0: "));
}

TEST_F(CService, ServesSeveralUuidsOnOneParticipant) {
  ASSERT_TRUE(caller.await_instance(first));
  ASSERT_TRUE(caller.await_instance(second));
  const fabric::InstanceIdentity identity = caller.identity(first);
  EXPECT_EQ(identity.name, "obedient");
  EXPECT_EQ(identity.concurrency, 4U);
  EXPECT_EQ(identity.channels.size(), 3U);
  EXPECT_EQ(identity.pid, caller.identity(second).pid);
  EXPECT_EQ(participants_of(sut.pid(), domain.number()), 1U);
  EXPECT_EQ(caller.identity(second).delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(caller.identity(second).completion_signal, fabric::CompletionSignal::response);
  EXPECT_EQ(caller.call(first, "hello").text, "hello, attempt 1");
  const fabric::Reply length = caller.call(second, "hello");
  EXPECT_EQ(length.text, "5");
  EXPECT_EQ(length.state, 0U);
}

TEST_F(CService, GetsAllDataOfACall) {
  ASSERT_TRUE(caller.await_instance(first));
  fabric::Request request = caller.request(first, "who");
  request.attempt = 3;
  request.replayed = true;
  request.state = 7;
  caller.publish(request);
  const fabric::Reply reply = caller.await_reply(request);
  EXPECT_EQ(reply.text, request.key.to_string() + " attempt 3 state 7 id " +
                            request.call.to_string() + " replayed 1 deadline 0");
  EXPECT_EQ(reply.state, 8U);
}

TEST_F(CService, AnswersMoreCallsThanItHasThreadsFromAnotherThread) {
  ASSERT_TRUE(caller.await_instance(first));
  std::vector<fabric::Request> kept;
  for (std::uint16_t channel = 1; channel <= 3; ++channel) {
    kept.push_back(caller.request(first, "keep", channel));
    caller.publish(kept.back());
  }
  for (const fabric::Request& request : kept) {
    fabric::Reply reply;
    // A thread may still have this call in hand when the other one releases those that are kept.
    tests::await("the reply to a kept call", [&] {
      EXPECT_EQ(caller.call(first, "release", 4).text, "released");
      return caller.poll_reply(request, reply);
    });
    EXPECT_EQ(reply.state, request.key.channel);
  }
}

TEST_F(CService, IsNotifiedOfACancelledCallAndMayEndItThere) {
  ASSERT_TRUE(caller.await_instance(first));
  const fabric::Request request = caller.request(first, "wait");
  caller.publish(request);
  sut.await("^waiting");
  caller.withdraw(request);
  caller.attend();
  sut.await("^obedient: wait is cancelled: 1");
  EXPECT_EQ(caller.call(first, "hello").text, "hello, attempt 1");
}

TEST_F(CService, EndsACallWithAnErrorInPlaceOfAnAnswerThatCannotBeSent) {
  ASSERT_TRUE(caller.await_instance(first));
  fabric::Reply reply = caller.call(first, "fail");
  EXPECT_EQ(reply.text, "ERROR: the gauge is off");
  EXPECT_EQ(reply.state, 500U);
  EXPECT_EQ(caller.call(first, "drop").text,
            "ERROR: the service dropped the call without an answer");
  EXPECT_EQ(caller.call(first, "long").code, fabric::ServiceCode::refused);
  sut.await("^long: 1: the service's answer has 200 bytes, at most 127 fit");
  EXPECT_EQ(caller.call(first, "twice").text, "once");
  sut.await("^twice: 5: call \\S+ was answered or declined before");
}

TEST_F(CService, FinishesItsCallsWhenItIsTerminated) {
  ASSERT_TRUE(caller.await_instance(first));
  const fabric::Request request = caller.request(first, "keep");
  caller.publish(request);
  ASSERT_EQ(caller.call(first, "hello", 2).text, "hello, attempt 1");
  sut.terminate();
  sut.await("^second drained");
  sut.await("^first: 3$");
  EXPECT_EQ(caller.await_reply(request).text, "keep");
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.output(), HasSubstr("first drained"));
}

TEST_F(CService, IsCalledByAProgramInC) {
  Process interim = client({"call", first, "interim"});
  EXPECT_EQ(interim.wait(), 0) << interim.output();
  EXPECT_EQ(interim.output(),
            "interim: half way, state 50\nfinal: all the way, state 1, result 0, in time 1\n");
  Process failed = client({"call", first, "fail"});
  EXPECT_EQ(failed.wait(), 0);
  EXPECT_THAT(failed.output(), StartsWith("final: ERROR: the gauge is off, state 500, result 1"));
}

TEST_F(CService, HasADeclinedAttemptDispatchedAgain) {
  Process declined = client({"call", first, "decline"});
  EXPECT_EQ(declined.wait(), 0) << declined.output();
  EXPECT_THAT(declined.output(), StartsWith("final: decline, attempt 2, state 1, result 0"));
}

TEST_F(CService, IsListed) {
  Process sut_of_list = client({"list"});
  EXPECT_EQ(sut_of_list.wait(), 0);
  const std::string pid = std::to_string(sut.pid());
  EXPECT_THAT(sut_of_list.output(),
              HasSubstr(first + " obedient pid " + pid +
                        " channels 'cnc/* press/1 */1' delivery 0 completion 0 calls 4\n"));
  EXPECT_THAT(sut_of_list.output(), HasSubstr(second + " length pid " + pid +
                                              " channels '' delivery 1 completion 1 calls 1\n"));
  EXPECT_THAT(sut_of_list.output(), EndsWith("\nbeyond: 1\n"));
}

TEST_F(CService, IsObserved) {
  Process observer = client({"observe", first, "hello"});
  EXPECT_EQ(observer.wait(), 0) << observer.output();
  observer.await("^seen: call\\.\\S+/1 hello state 1");
  observer.await("^dispatched: call\\.\\S+/1 .*obedient");
  observer.await("^replied: call\\.\\S+/1 hello, attempt 1 state 1");
}

TEST_F(CInterface, ReportsThatNoInstanceHasAUuidOrThatNoneResponds) {
  Process unserved = client({"call", "c0000000-0000-4000-8000-00000000000f", "hello"});
  EXPECT_EQ(unserved.wait(), 1);
  EXPECT_THAT(unserved.output(), StartsWith("error 6: "));
  EXPECT_THAT(unserved.output(), HasSubstr("c0000000-0000-4000-8000-00000000000f"));
  Process service = start(MILLRACE_C_SERVICE, {first, second});
  service.await("^ready: ");
  Process late = client({"call", first, "keep"});
  EXPECT_EQ(late.wait(), 1);
  EXPECT_THAT(late.output(), StartsWith("error 7: "));
}

TEST_F(CInterface, RefusesARequestThatNoNcProgramCanMake) {
  Process sut = client({"call", first, std::string(128, 'x')});
  EXPECT_EQ(sut.wait(), 1);
  EXPECT_THAT(sut.output(), StartsWith("error 1: "));
  EXPECT_THAT(sut.output(), HasSubstr("128 bytes"));
}

TEST_F(CInterface, ReportsWrongUse) {
  Process sut = start(MILLRACE_C_MISTAKES);
  EXPECT_EQ(sut.wait(), 0) << sut.output() << sut.error_output();
  const std::string output = sut.output();
  for (const char* line : {
           "no place: 1 participant is NULL\n",
           "domain: 1 MILLRACE_DOMAIN=500: expected a number from 0 to 232\n",
           "fabric: 1 'a*' is not a fabric name",
           "file: 1 /nowhere.textproto",
           "level: 1 log_level is 9; expected 0 to 5\n",
           "size: 1 millrace_participant_options: its member 'size' is 0; expected "
           "sizeof(millrace_participant_options)\n",
           "join: 0 \n",
           "no uuid: 1 millrace_service_options: uuid is NULL\n",
           "wildcard: 1 ",
           "channel: 1 channels: 'cnc/0' is not a channel",
           "calls: 1 concurrent_calls is 257; expected 1 to 256\n",
           "delivery: 1 delivery is 2; expected 0 or 1\n",
           "threads: 1 threads is set, but handler is NULL\n",
           "no discovery: 1 millrace_request_send needs a participant that discovers the others",
           "null call: 1 call is NULL\n",
           "later header: 0 \n",
           "next with a handler: 1 the service has a handler, which gets its calls\n",
           "later member: 1 millrace_service_options: the member at byte ",
           "earlier header: 0 \n",
           "nothing: 3 ",
           "leave: 0 \n",
           "closed: 4 ",
           "child: 9 the handle belongs to process ",
           ", unknown code\n",
       }) {
    EXPECT_THAT(output, HasSubstr(line));
  }
}

TEST_F(CInterface, ExportsItsOwnFunctionsAndNothingElse) {
  Process sut({"/usr/bin/nm", "--dynamic", "--defined-only", "--format=posix", MILLRACE_C_LIBRARY});
  ASSERT_EQ(sut.wait(), 0) << sut.error_output();
  std::istringstream lines(sut.output());
  int functions = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.find(' '));
    if (name != "MILLRACE_1") {
      EXPECT_THAT(name, testing::MatchesRegex("millrace_[a-z_]+@@MILLRACE_1"));
      ++functions;
    }
  }
  EXPECT_EQ(functions, 39);
}

}  // namespace
}  // namespace millrace
