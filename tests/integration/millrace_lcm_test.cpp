// millrace-lcm with programs that speak LCM, with LCM's own logger and player, in a network of its
// own.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/lcm/message.hpp"
#include "tests/integration/chain.hpp"
#include "tests/integration/lcm/speaker.hpp"
#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/own_network.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Those of deploy/examples/lcm.
const std::string root_uuid = "6c1f3f0a-54a4-4a43-9b8d-2f3a8c1f7e51";
const std::string countdown_uuid = "0d7e3b1c-6f0c-4c39-8a55-0a2d9f4b7c66";
const std::string uuid = "e2b6ae2c-3d6a-4b7b-8f5d-1f6f0d3f9a10";

/// Before any test has threads.
class Network : public testing::Environment {
 public:
  void SetUp() override { obstacle = enter_own_network(); }
  inline static std::string obstacle;
};

const testing::Environment* const network = testing::AddGlobalTestEnvironment(new Network);

class Lcm : public testing::Test {
 protected:
  void SetUp() override {
    if (!Network::obstacle.empty()) {
      GTEST_SKIP() << Network::obstacle;
    }
  }

  void start(const std::string& configuration = {}, const Flags& flags = {}) {
    Flags command{binary("millrace-lcm"), "--domain", std::to_string(chain.domain())};
    if (!configuration.empty()) {
      std::ofstream(config) << configuration;
      command.insert(command.end(), {"--config", config.string()});
    }
    command.insert(command.end(), flags.begin(), flags.end());
    sut.emplace(std::move(command));
    sut->await("^ready: lcm serves LCM programs of udpm://239.255.76.67:7667\\?ttl=0 on domain");
  }
  [[nodiscard]] Caller& caller() {
    if (!caller_) {
      caller_.emplace(chain.domain());
    }
    return *caller_;
  }
  /// `millrace call`, which decides as a gateway does.
  [[nodiscard]] Process call(const std::string& of, const std::string& text) const {
    return chain.millrace({"call", of, text});
  }
  Chain chain;
  const std::filesystem::path config = chain.folder() / "lcm.textproto";
  std::optional<Process> sut;

 private:
  std::optional<Caller> caller_;
};

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
  Speaker program(uuid);
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

TEST_F(Lcm, ServesNobodyAfterTheLastWordOfAProgram) {
  start();
  {
    const Speaker program(uuid);
    ASSERT_TRUE(caller().await_instance(uuid));
  }
  EXPECT_TRUE(caller().await_no_instance(uuid));
  sut->await_error("is gone: silent for 1000 ms; of its calls 0 go on elsewhere");
}

TEST_F(Lcm, GivesACallToAnotherProgramWhenTheFirstIsKilled) {
  start();
  Process first({MILLRACE_LCM_COUNTDOWN});
  Process caller = call(countdown_uuid, "100");
  caller.await_error("^interim: \"still 100\"");
  const Process second({MILLRACE_LCM_COUNTDOWN});
  first.kill();
  sut->await_error("is gone: silent for 1000 ms; of its calls 1 go on elsewhere");
  sut->await_error("call \\S+ from \\S+: \"100\", state 1, attempt 2");
  sut->await_error("attempt 2\n(.*\n)*.* is in progress: \"still 100\"");
}

TEST_F(Lcm, HasAnAtMostOnceCallHeldWhoseProgramIsGone) {
  start("service { uuid: '" + uuid + "' delivery: AT_MOST_ONCE }");
  std::optional<Speaker> program(uuid);
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

TEST_F(Lcm, FindsACallAgainThatItsProgramWentOnWithWhenTheBridgeWasKilled) {
  start();
  const Process program({MILLRACE_LCM_COUNTDOWN});
  Process caller = call(countdown_uuid, "4");
  caller.await_error("^interim: \"still 4\"");
  sut->kill();
  start();
  caller.await("^\"counted 4\" state 1, ok");
  // Not run a second time, but asked for a second time.
  EXPECT_THAT(sut->error_output(),
              AllOf(HasSubstr("\"4\", state 1, attempt 2"), Not(HasSubstr("\"still 4\""))));
}

TEST_F(Lcm, TellsAProgramThatItsCallIsWithdrawn) {
  start();
  Speaker program(uuid);
  ASSERT_TRUE(caller().await_instance(uuid));
  const fabric::Request request = caller().request(uuid, "text");
  caller().publish(request);
  const request_t heard = program.await_request();
  EXPECT_EQ(heard.text, "text");
  caller().withdraw(request);
  EXPECT_EQ(program.await_withdrawal().call.id, heard.call.id);
  // It goes on as if it had not heard it, and hears it again.
  EXPECT_EQ(program.await_withdrawal().call.id, heard.call.id);
  program.answer(heard, "late");
  sut->await_error("was answered after it was withdrawn; nothing is sent");
  EXPECT_EQ(
      [&] {
        const fabric::Request next = caller().request(uuid, "next");
        caller().publish(next);
        program.answer(program.await_request(), "on time");
        return caller().await_reply(next).text;
      }(),
      "on time");
}

TEST_F(Lcm, StopsAProgramInCppWhenNobodyWaitsAnyMore) {
  start();
  const Process program({MILLRACE_LCM_COUNTDOWN});
  Process caller = call(countdown_uuid, "100");
  caller.await_error("^interim: \"still 100\"");
  caller.terminate();
  caller.wait();
  sut->await_error("call \\S+ is withdrawn");
  // Its place is free for the next one.
  Process next = call(countdown_uuid, "1");
  next.await("^\"counted 1\" state 1, ok");
}

TEST_F(Lcm, HasAProgramLeaveThatAnOperatorDrains) {
  start();
  Process program({MILLRACE_LCM_COUNTDOWN});
  ASSERT_TRUE(caller().await_instance(countdown_uuid));
  const std::string instance = caller().identity(countdown_uuid).id.to_string();
  Process drain = chain.millrace({"drain", instance});
  EXPECT_EQ(drain.wait(), 0) << drain.error_output();
  EXPECT_EQ(program.wait(), 0);
  EXPECT_TRUE(caller().await_no_instance(countdown_uuid));
}

TEST_F(Lcm, TakesAProgramOffThatSaysThatItLeavesWhenItHasAnsweredEverything) {
  start();
  Speaker program(uuid);
  ASSERT_TRUE(caller().await_instance(uuid));
  const fabric::Request request = caller().request(uuid, "last");
  caller().publish(request);
  const request_t heard = program.await_request();
  program.change([](presence_t& presence) { presence.draining = 1; });
  // No more for those who have something new.
  EXPECT_TRUE(caller().await_no_instance(uuid));
  program.answer(heard, "done");
  EXPECT_EQ(caller().await_reply(request).text, "done");
  sut->await_error("has answered everything and is served no longer");
}

TEST_F(Lcm, SharesTheCallsOutAmongTwoProgramsOfAUuid) {
  start();
  Speaker one(uuid, "one");
  Speaker other(uuid, "other");
  Process first = call(uuid, "first");
  Process second = call(uuid, "second");
  // Each has one, and none has that of the other.
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

TEST_F(Lcm, AsksAgainForWhatGotLost) {
  start();
  Speaker program(uuid);
  ASSERT_TRUE(caller().await_instance(uuid));
  program.be_deaf(true);
  const fabric::Request request = caller().request(uuid, "text");
  caller().publish(request);
  sut->await_error("call \\S+ from cnc/1: \"text\"");
  program.be_deaf(false);
  const request_t heard = program.await_request();
  // Done, but its answer got lost: it is asked again, and answers the same.
  program.change([](presence_t& presence) { presence.calls.clear(); });
  const request_t again = program.await_request();
  EXPECT_EQ(again.call.id, heard.call.id);
  EXPECT_EQ(again.call.attempt, heard.call.attempt);
  program.answer(again, "done");
  EXPECT_EQ(caller().await_reply(request).text, "done");
}

/// What a program says to a call.
class LcmAnswer : public Lcm {
 protected:
  using Say = std::function<void(Speaker&, const request_t&)>;

  /// The NC program's answer if the program says this.
  fabric::Reply answer(const Say& say) {
    if (!sut) {
      start();
      program.emplace(uuid);
    }
    EXPECT_TRUE(caller().await_instance(uuid));
    const fabric::Request request = caller().request(uuid, "text");
    caller().publish(request);
    say(*program, program->await_request());
    const fabric::Reply reply = caller().await_reply(request);
    caller().withdraw(request);
    return reply;
  }

  std::optional<Speaker> program;
};

TEST_F(LcmAnswer, ThatCannotBeWrittenIsAClearErrorAtOnce) {
  const fabric::Reply long_one = answer([](Speaker& asked, const request_t& request) {
    asked.answer(request, std::string(200, 'x'));
  });
  EXPECT_EQ(long_one.text, "ERROR: the service's answer has 200 bytes, at most 127 fit");
  EXPECT_EQ(long_one.state, 500U);
  const fabric::Reply zero =
      answer([](Speaker& asked, const request_t& request) { asked.answer(request, "text", 0); });
  EXPECT_THAT(zero.text, HasSubstr("answered with state 0"));
  const fabric::Reply huge = answer(
      [](Speaker& asked, const request_t& request) { asked.answer(request, "text", 1LL << 40); });
  EXPECT_THAT(huge.text, HasSubstr("state 1099511627776"));
  const fabric::Reply chinese =
      answer([](Speaker& asked, const request_t& request) { asked.answer(request, "中"); });
  EXPECT_THAT(chinese.text, HasSubstr("U+4E2D at byte 1 is not in CP1252"));
  const fabric::Reply null = answer([](Speaker& asked, const request_t& request) {
    std::string bytes = fabric::lcm::encode(asked.reply_to(request, "a-b"));
    bytes[bytes.find("a-b") + 1] = '\0';
    asked.publish(asked.reply_channel(), bytes);
  });
  EXPECT_THAT(null.text, HasSubstr("contains a NUL byte"));
  const fabric::Reply failed = answer([](Speaker& asked, const request_t& request) {
    reply_t reply = asked.reply_to(request, "no paper");
    reply.kind = reply_t::FAILED;
    asked.send(reply);
  });
  EXPECT_EQ(failed.text, "ERROR: no paper");
  EXPECT_EQ(failed.state, 500U);
}

TEST_F(LcmAnswer, IsInTheControllersCodePage) {
  EXPECT_EQ(
      answer([](Speaker& asked, const request_t& request) { asked.answer(request, "Maß"); }).text,
      "Ma\xDF");
}

TEST_F(LcmAnswer, CountsFromTheProgramThatWasAskedAlone) {
  std::optional<Speaker> stranger;
  const auto say = [&](Speaker& asked, const request_t& request) {
    stranger.emplace(uuid, "stranger");
    // In its own name, which it has announced by then or not, and in that of the one that was
    // asked.
    stranger->answer(request, "mine");
    stranger->send(asked.reply_to(request, "forged"));
    sut->await_error("answers (attempt 1 of )?call " + request.call.id +
                     ", (which it was not given|but)");
    sut->await_error("in the name of program");
    asked.answer(request, "the answer");
  };
  EXPECT_EQ(answer(say).text, "the answer");
}

TEST_F(LcmAnswer, CountsAsAnAnswerToThatCallAlone) {
  const auto say = [&](Speaker& asked, const request_t& request) {
    asked.publish(asked.reply_channel(), fabric::lcm::encode(drain_t{}));
    request_t other = request;
    other.call.id = "5f-17";
    asked.answer(other, "to another one");
    sut->await_error("a message on MILLRACE_REPLY\\." + uuid + " from \\S+ is no reply: its fing");
    sut->await_error("answers attempt 1 of call 5f-17, which it was not given");
    asked.answer(request, "the answer");
  };
  EXPECT_EQ(answer(say).text, "the answer");
}

TEST_F(LcmAnswer, ComesThroughAFloodThatIsToldOnce) {
  const auto say = [&](Speaker& asked, const request_t& request) {
    Speaker stranger(uuid, "stranger");
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
  EXPECT_EQ(warned("is no reply: "), 1U);
  EXPECT_EQ(warned("is no presence: "), 1U);
  EXPECT_EQ(warned("in the name of program"), 1U);
}

TEST_F(Lcm, StaysWithTheUuidsThatItsConfigurationNames) {
  start("any_uuid: false service { uuid: '" + root_uuid +
        "' delivery: AT_MOST_ONCE channel: 'cnc/1' }");
  const Speaker other(uuid);
  sut->await_error("announces " + uuid + ", which the configuration does not name");
  const Process program({MILLRACE_LCM_SQUARE_ROOT});
  ASSERT_TRUE(caller().await_instance(root_uuid));
  const fabric::InstanceIdentity identity = caller().identity(root_uuid);
  EXPECT_EQ(identity.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(identity.channels, std::vector{(fabric::ChannelScope{"cnc", 1})});
}

TEST_F(Lcm, LeavesWhenTheCallsUnderWayAreAnswered) {
  start();
  Speaker program(uuid);
  ASSERT_TRUE(caller().await_instance(uuid));
  const fabric::Request request = caller().request(uuid, "last");
  caller().publish(request);
  const request_t heard = program.await_request();
  sut->terminate();
  EXPECT_TRUE(caller().await_no_instance(uuid));
  program.answer(heard, "done");
  EXPECT_EQ(caller().await_reply(request).text, "done");
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
  // It is the bridge that leaves, not the program.
  EXPECT_EQ(program.drains(), 0U);
}

/// What LCM's own logger keeps of a group.
class LcmLog : public Lcm {
 protected:
  [[nodiscard]] Process logger(const std::string& into, const std::string& group) const {
    // It says nothing when it is ready; what it has heard is seen in its file.
    return Process({"/usr/bin/lcm-logger", "--flush-interval=10", "--lcm-url=" + group, into});
  }
  /// Until what was published is in the log, and the log ends in order.
  static void await_events(const std::filesystem::path& log, const std::string& what,
                           std::size_t many) {
    await("the log", [&] { return count(log, what) >= many; });
  }
  static std::size_t count(const std::filesystem::path& log, const std::string& what) {
    std::ifstream in(log, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    std::size_t found = 0;
    for (std::size_t at = 0; (at = bytes.find(what, at)) != std::string::npos; ++at) {
      ++found;
    }
    return found;
  }
  static void end(Process& logger) {
    logger.signal(SIGINT);
    logger.wait();
  }

  const std::string here = "udpm://239.255.76.67:7667?ttl=0";
  const std::string elsewhere = "udpm://239.255.76.68:7668?ttl=0";
  const std::filesystem::path file = chain.folder() / "run.lcm";
  const std::filesystem::path again = chain.folder() / "again.lcm";
};

TEST_F(LcmLog, OfTheMirrorReplays) {
  start("", {"--mirror"});
  Process keeps = logger(file, here);
  // A plain service, not one of LCM: the mirror shows the fabric.
  const Process service = chain.square_root();
  const std::string of = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  const Speaker flowing(uuid);
  await_events(file, "MILLRACE_PRESENCE", 1);
  for (const char* number : {"2", "9", "x"}) {
    Process caller = call(of, number);
    EXPECT_THAT(caller.wait(), testing::AnyOf(0, 1));
  }
  await_events(file, "MILLRACE_MIRROR.reply", 3);
  end(keeps);

  Process replay = chain.millrace({"replay", "--to-services", "--verify", file.string()});
  EXPECT_EQ(replay.wait(), 0) << replay.output() << replay.error_output();
  EXPECT_THAT(replay.output(), HasSubstr("3 calls"));

  // What LCM's player sends from it is the same again.
  Process hears = logger(again, elsewhere);
  await("the logger", [&] {
    Process player(
        {"/usr/bin/lcm-logplayer", "--speed=100", "--lcm-url=" + elsewhere, file.string()});
    player.wait();
    return count(again, "MILLRACE_MIRROR.reply") >= 3;
  });
  end(hears);
  Process second = chain.millrace({"replay", "--to-services", "--verify", again.string()});
  EXPECT_EQ(second.wait(), 0) << second.output() << second.error_output();
}

TEST_F(LcmLog, OfTheMirrorHasNoTextOfAServiceWhoseTextsAreWithheld) {
  start("mirror { without_text: '560AACBF-6335-44a9-895A-8B27F3ED5E47' }");
  Process keeps = logger(file, here);
  const Process service = chain.square_root();
  const Speaker flowing(uuid);
  await_events(file, "MILLRACE_PRESENCE", 1);
  Process caller = call("560aacbf-6335-44a9-895a-8b27f3ed5e47", "15241578750190521");
  EXPECT_EQ(caller.wait(), 0);
  await_events(file, "MILLRACE_MIRROR.reply", 1);
  end(keeps);
  EXPECT_EQ(count(file, "15241578750190521"), 0U);
  EXPECT_EQ(count(file, "123456789.0"), 0U);
  Process replay = chain.millrace({"replay", "--to-services", file.string()});
  EXPECT_EQ(replay.wait(), 2);
  EXPECT_THAT(replay.error_output(), HasSubstr("its request text is not in the recording"));
}

TEST_F(LcmLog, PlayedIntoTheGroupMakesNobodyAppearAndAnswersNothing) {
  start();
  Process keeps = logger(file, here);
  {
    Process program({MILLRACE_LCM_SQUARE_ROOT});
    ASSERT_TRUE(caller().await_instance(root_uuid));
    caller().call(root_uuid, "2");
    await_events(file, "MILLRACE_PRESENCE", 6);
  }
  end(keeps);
  ASSERT_TRUE(caller().await_no_instance(root_uuid));
  Process player({"/usr/bin/lcm-logplayer", "--lcm-url=" + here, file.string()});
  sut->await_error("the clocks differ, or a log is played; it is not believed");
  player.wait();
  EXPECT_TRUE(caller().await_no_instance(root_uuid));
}

TEST_F(Lcm, SaysWhatIsWrongWithItsConfiguration) {
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
