// Another vendor's DDS on the fabric: a service and a caller on Fast DDS, with our gateway, our
// services and the virtual CNC.
#include <chrono>
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"

namespace millrace::tests::interop {
namespace {

using integration::Chain;
using integration::Flags;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

const std::string foreign_uuid = "fa57dd50-0000-4000-8000-000000000001";
const std::string square_root_uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

/// How often `text` contains `words`.
std::size_t times(const std::string& text, const std::string& words) {
  std::size_t found = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) {
    ++found;
  }
  return found;
}

/// The output of the process may still be on its way.
void expect_times(const Process& process, const std::string& words, std::size_t count) {
  await("its output", [&] { return times(process.output(), words) >= count; });
  EXPECT_EQ(times(process.output(), words), count) << process.output();
}

/// Skipped where Fast DDS is not installed.
class OnFastDds : public testing::Test {
 protected:
  void SetUp() override {
    if (std::string(MILLRACE_FASTDDS_PROGRAMS).empty()) {
      GTEST_SKIP() << "Fast DDS 2 and fastddsgen are not installed (deploy/install-deps; Debian 13 "
                      "has none)";
    }
  }

  static Process start(const std::string& program, Flags flags) {
    flags.insert(flags.begin(), std::string(MILLRACE_FASTDDS_PROGRAMS) + "/" + program);
    return Process(std::move(flags));
  }

  Chain chain;
};

class AForeignService : public OnFastDds {
 protected:
  Process service(Flags flags = {}) {
    flags.insert(flags.end(), {"--domain", std::to_string(chain.domain())});
    Process process = start("fastdds_service", std::move(flags));
    process.await("^ready: ");
    return process;
  }

  /// A controller whose channels make this many calls each and check that each answer is their own.
  Process controller(std::uint32_t channels, std::uint32_t calls_of_each) {
    const std::string program = chain.counting_program(foreign_uuid, calls_of_each);
    Flags flags{"--channels", std::to_string(channels), "--exit-when-idle"};
    for (std::uint32_t channel = 1; channel <= channels; ++channel) {
      flags.insert(flags.end(), {"--run", std::to_string(channel) + "=" + program});
    }
    calls_ = calls_of_each;
    channels_ = channels;
    return chain.cnc(flags);
  }

  void expect_all_answered(Process& cnc, std::chrono::seconds limit = patience) const {
    for (std::uint32_t channel = 1; channel <= channels_; ++channel) {
      cnc.await(
          "\\[ch" + std::to_string(channel) + "\\] " + std::to_string(calls_) + " calls answered",
          limit);
    }
    EXPECT_THAT(cnc.output(), Not(HasSubstr("wrong answer")));
  }

 private:
  std::uint32_t channels_ = 0;
  std::uint32_t calls_ = 0;
};

// Fast DDS limits the number of a reader's keys, by default to 10: the keys of calls must not be
// among them.
TEST_F(AForeignService, AnswersFiveThousandCallsOfSeveralChannels) {
  Process sut = service({"--concurrency", "8", "--max-instances", "10"});
  Process cnc = controller(8, 625);
  Process gateway = chain.gateway();
  expect_all_answered(cnc, std::chrono::seconds(90));
  expect_times(sut, "run ", 5000);
}

class AForeignServiceWithAnIdentity : public AForeignService,
                                      public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    AForeignService::SetUp();
    if (IsSkipped()) {
      return;
    }
    chain.with_trust({square_root_uuid}, GetParam());
    chain.trust().run(
        {"issue", "PKI", "fastdds", "--role", "service", "--uuid", foreign_uuid, "--foreign"});
  }
  Process shown(const std::string& member) {
    return service(
        {"--trust", chain.trust().of(member), "--protection", GetParam(), "--certificate", member});
  }
};

TEST_P(AForeignServiceWithAnIdentity, AnswersCallsAndIsListed) {
  Process sut = shown("fastdds");
  Process cnc = controller(2, 50);
  Process gateway = chain.gateway();
  expect_all_answered(cnc);
  expect_times(sut, "run ", 100);
  await("the foreign service to be listed", [&] {
    Process services = chain.millrace({"services"});
    services.wait();
    return services.output().find(foreign_uuid) != std::string::npos;
  });
}

// Being of another vendor does not give it another UUID.
TEST_P(AForeignServiceWithAnIdentity, AnswersOnlyTheUuidsOfItsCertificate) {
  chain.trust().run(
      {"issue", "PKI", "other", "--role", "service", "--uuid", square_root_uuid, "--foreign"});
  Process sut = start("fastdds_service", {"--trust", chain.trust().of("other"), "--protection",
                                          GetParam(), "--domain", std::to_string(chain.domain())});
  EXPECT_NE(sut.wait(), 0);
  EXPECT_THAT(sut.output(), Not(HasSubstr("ready: ")));
}

INSTANTIATE_TEST_SUITE_P(, AForeignServiceWithAnIdentity, testing::Values("SIGN", "ENCRYPT"),
                         [](const auto& protection) { return protection.param; });

TEST_F(AForeignService, IsListedAsEveryOther) {
  const Process sut = service({"--name", "foreign one", "--concurrency", "3"});
  // Fast DDS may take a second to answer a new participant, which is longer than the command waits.
  std::string listed;
  await("the foreign service to be listed", [&] {
    Process services = chain.millrace({"services"});
    services.wait();
    listed = services.output();
    return listed.find("foreign one") != std::string::npos;
  });
  EXPECT_THAT(listed, HasSubstr(foreign_uuid));
}

TEST_F(AForeignService, ReturnsAfterAStandstillOfASecond) {
  Process sut = service();
  Process cnc = controller(2, 200);
  Process gateway = chain.gateway({"--log-level", "debug"});
  sut.await("run 20 ");
  const auto stopped = std::chrono::steady_clock::now();
  sut.signal(SIGSTOP);
  gateway.await_error("instance .* is gone");
  await("a second to pass",
        [&] { return std::chrono::steady_clock::now() > stopped + std::chrono::seconds(1); });
  sut.signal(SIGCONT);
  expect_all_answered(cnc);
  await("it to be ready again",
        [&] { return times(gateway.error_output(), "is ready: fastdds") >= 2; });
  EXPECT_EQ(times(gateway.error_output(), "is ready: fastdds"), 2U);
}

TEST_F(AForeignService, ReturnsAfterBlockingInAListener) {
  Process sut = service({"--block", "20"});
  Process cnc = controller(1, 100);
  Process gateway = chain.gateway();
  expect_all_answered(cnc);
  sut.await("was blocked");
}

TEST_F(AForeignService, ThatIsKilledHasItsCallDispatchedToAnotherInstance) {
  Process first = service({"--name", "first", "--work", "400"});
  Process cnc = controller(1, 10);
  Process gateway = chain.gateway();
  Process second = service({"--name", "second", "--work", "400"});
  gateway.await_error("is ready: first");
  gateway.await_error("is ready: second");
  // Whichever instance begins a call now.
  const std::size_t of_first = times(first.output(), "run ");
  const std::size_t of_second = times(second.output(), "run ");
  await("a call that begins", [&] {
    return times(first.output(), "run ") > of_first || times(second.output(), "run ") > of_second;
  });
  const bool is_first = times(first.output(), "run ") > of_first;
  (is_first ? first : second).kill();
  (is_first ? second : first).await("run \\d+ attempt 2 ");
  expect_all_answered(cnc);
}

TEST_F(AForeignService, SendsTheSameAnswerToAnotherAttemptAndRunsItOnce) {
  Process sut = service();
  Caller caller(chain.domain());
  ASSERT_TRUE(caller.await_instance(foreign_uuid));
  fabric::Request request = caller.request(foreign_uuid, "four");
  caller.publish(request);
  const fabric::Reply answer = caller.await_reply(request);
  EXPECT_EQ(answer.code, fabric::ServiceCode::ok);
  caller.forget_reply(request);
  request.attempt = 2;
  caller.publish(request);
  const fabric::Reply again = caller.await_reply(request);
  EXPECT_EQ(again.code, fabric::ServiceCode::repeated);
  EXPECT_EQ(again.attempt, 2U);
  EXPECT_EQ(again.text, "four");
  expect_times(sut, "run ", 1);
}

TEST_F(AForeignService, GivesUpACancelledCall) {
  Process sut = service({"--work", "200", "--concurrency", "2"});
  Caller caller(chain.domain());
  ASSERT_TRUE(caller.await_instance(foreign_uuid));
  const fabric::Request request = caller.request(foreign_uuid, "four", 7);
  caller.publish(request);
  sut.await("run ");
  caller.withdraw(request);
  sut.await("taken back: channel 7");
  // One of another channel is answered; an answer to the first would have arrived before.
  EXPECT_EQ(caller.call(foreign_uuid, "five", 8).text, "five");
  fabric::Reply none;
  EXPECT_FALSE(caller.poll_reply(request, none));
}

// It announces room for four calls and has room for one, as if three came from elsewhere.
TEST_F(AForeignService, DeclinesACallBeyondItsConcurrencyAndAnotherInstanceRunsIt) {
  const Process full =
      service({"--name", "full", "--concurrency", "4", "--room", "1", "--work", "20"});
  // Slow, so that the gateway finds the other instance before all calls are made.
  const Process other = service({"--name", "other", "--concurrency", "4", "--work", "80"});
  Process cnc = controller(4, 25);
  Process gateway = chain.gateway({"--log-level", "debug"});
  gateway.await_error("full .* declines it: no room");
  expect_all_answered(cnc);
}

TEST_F(AForeignService, DeclinesTheSameAttemptAgainEvenWithFreeRoom) {
  Process sut = service({"--work", "300"});
  Caller caller(chain.domain());
  ASSERT_TRUE(caller.await_instance(foreign_uuid));
  const fabric::Request first = caller.request(foreign_uuid, "one", 1);
  fabric::Request second = caller.request(foreign_uuid, "two", 2);
  const auto came = [&] { return times(sut.output(), "attempt 1 of channel 2: two"); };
  caller.publish(first);
  sut.await("run 1 ");
  caller.publish(second);
  await("the second call to come", [&] { return came() == 1; });
  EXPECT_EQ(caller.await_reply(first).text, "one");
  caller.publish(second);
  await("the second call to come again", [&] { return came() == 2; });
  second.attempt = 2;
  caller.publish(second);
  EXPECT_EQ(caller.await_reply(second).attempt, 2U);
  expect_times(sut, "run 2 ", 1);
}

TEST_F(AForeignService, RunsACallOnceWhoseGatewayIsKilledAndRestarted) {
  Process sut = service({"--work", "700"});
  Process cnc = controller(1, 2);
  const Flags journal{"--journal", (chain.folder() / "journal").string()};
  Process gateway = chain.gateway(journal);
  sut.await("run 1 ");
  gateway.kill();
  Process next = chain.gateway(journal);
  expect_all_answered(cnc);
  expect_times(sut, "run ", 2);
}

TEST_F(AForeignService, ThatDrainsAnswersItsCallsAndAcceptsNoNewOnes) {
  Process sut = service({"--work", "100"});
  Process cnc = controller(1, 30);  // still calling when the gateway finds the other one
  Process gateway = chain.gateway();
  sut.await("run 2 ");
  Process other = service({"--name", "other"});
  gateway.await_error("is ready: other");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  expect_all_answered(cnc);
  EXPECT_THAT(gateway.error_output(), HasSubstr("it is draining"));
  EXPECT_THAT(other.output(), Not(HasSubstr("attempt 2")));
}

class AForeignCaller : public OnFastDds {};

TEST_F(AForeignCaller, GetsItsAnswersFromAMillraceService) {
  Process service = chain.square_root();
  Process sut = start("fastdds_caller",
                      {"--domain", std::to_string(chain.domain()), "--uuid", square_root_uuid,
                       "--calls", "500", "--channels", "5", "--request", "16"});
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_EQ(times(sut.output(), " state 1: 4"), 500U) << sut.output();
}

TEST_F(AForeignCaller, GetsItsAnswersFromAForeignService) {
  Process service = start("fastdds_service", {"--domain", std::to_string(chain.domain())});
  Process sut = start("fastdds_caller", {"--domain", std::to_string(chain.domain()), "--uuid",
                                         foreign_uuid, "--calls", "100"});
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.output(), ContainsRegex("answer 100 state 1: 100\n"));
}

}  // namespace
}  // namespace millrace::tests::interop
