// Valid and invalid answers of LCM programs.
#include <functional>
#include <optional>

#include <gmock/gmock.h>

#include "fabric/lcm/message.hpp"
#include "tests/integration/lcm/lcm.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;

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

TEST_F(LcmAnswer, ThatCannotBeWrittenIsAClearErrorAtOnce) {
  const fabric::Reply long_one = answer([](LcmProgram& asked, const request_t& request) {
    asked.answer(request, std::string(200, 'x'));
  });
  EXPECT_EQ(long_one.text, "ERROR: the service's answer has 200 bytes, at most 127 fit");
  EXPECT_EQ(long_one.state, 500U);
  const fabric::Reply zero =
      answer([](LcmProgram& asked, const request_t& request) { asked.answer(request, "text", 0); });
  EXPECT_THAT(zero.text, HasSubstr("answered with state 0"));
  const fabric::Reply huge = answer([](LcmProgram& asked, const request_t& request) {
    asked.answer(request, "text", 1LL << 40);
  });
  EXPECT_THAT(huge.text, HasSubstr("state 1099511627776"));
  const fabric::Reply chinese =
      answer([](LcmProgram& asked, const request_t& request) { asked.answer(request, "中"); });
  EXPECT_THAT(chinese.text, HasSubstr("U+4E2D at byte 1 is not in CP1252"));
  const fabric::Reply null = answer([](LcmProgram& asked, const request_t& request) {
    std::string bytes = fabric::lcm::encode(asked.reply_to(request, "a-b"));
    bytes[bytes.find("a-b") + 1] = '\0';
    asked.publish(asked.reply_channel(), bytes);
  });
  EXPECT_THAT(null.text, HasSubstr("contains a NUL byte"));
  const fabric::Reply failed = answer([](LcmProgram& asked, const request_t& request) {
    reply_t reply = asked.reply_to(request, "no paper");
    reply.kind = reply_t::FAILED;
    asked.send(reply);
  });
  EXPECT_EQ(failed.text, "ERROR: no paper");
  EXPECT_EQ(failed.state, 500U);
}

TEST_F(LcmAnswer, IsInTheControllersCodePage) {
  EXPECT_EQ(answer([](LcmProgram& asked, const request_t& request) {
              asked.answer(request, "Maß");
            }).text,
            "Ma\xDF");
}

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

TEST_F(LcmAnswer, CountsOnlyForItsOwnCall) {
  const auto say = [&](LcmProgram& asked, const request_t& request) {
    asked.publish(asked.reply_channel(), fabric::lcm::encode(drain_t{}));
    request_t other = request;
    other.call.id = "5f-17";
    asked.answer(other, "to another one");
    sut->await_error(" warning +a message on MILLRACE_REPLY\\." + uuid +
                     " from \\S+ is not a reply: its fing");
    sut->await_error("answers attempt 1 of call 5f-17, which was not dispatched to it");
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
