#include "services/batch/call.hpp"

#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/batch/catalog.hpp"

namespace millrace::services::batch {
namespace {

using namespace std::chrono_literals;
using sdk::Response;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;

Script script() {
  Script script;
  script.announcement.name = "measure";
  script.program = "/opt/measure";
  return script;
}

Ended exited(int code, std::string output, std::string errors = {}) {
  return {.end = End::exited,
          .code = code,
          .output = {.text = output, .size = output.size()},
          .errors = {.text = errors, .size = errors.size()}};
}

TEST(BatchCall, PassesTheRequestAfterTheConfiguredArguments) {
  Script script = batch::script();
  script.arguments = {"--"};
  const auto sut = command_for(script, {.text = "WELLE7 12"});
  ASSERT_TRUE(sut);
  EXPECT_THAT(sut->arguments, ElementsAre("--", "WELLE7 12"));
  EXPECT_EQ(sut->input, "WELLE7 12\n");
}

TEST(BatchCall, PassesTheRequestInUtf8) {
  EXPECT_EQ(command_for(script(), {.text = "Ma\xDF"})->arguments.back(), "Maß");
}

TEST(BatchCall, PassesTheRequestInTheControllersCodePageWhereConfigured) {
  Script script = batch::script();
  script.encoding = Encoding::cp1252;
  EXPECT_EQ(command_for(script, {.text = "Ma\xDF"})->arguments.back(), "Ma\xDF");
}

TEST(BatchCall, PassesTheDataOfTheCall) {
  const auto sut = command_for(script(), {.key = {.machine = "cnc", .channel = 1},
                                          .call = {.epoch = 0x5f, .number = 17},
                                          .attempt = 2,
                                          .text = "x",
                                          .state = 3,
                                          .replayed = true});
  EXPECT_THAT(sut->environment,
              IsSupersetOf({"MILLRACE_CALL=5f-17", "MILLRACE_ATTEMPT=2", "MILLRACE_MACHINE=cnc",
                            "MILLRACE_CHANNEL=1", "MILLRACE_STATE=3", "MILLRACE_REPLAYED=1"}));
}

TEST(BatchCall, RefusesAnEmptyRequest) {
  EXPECT_EQ(command_for(script(), {}).error(), text::error(10, "the request is empty"));
}

TEST(BatchCall, AcceptsAnEmptyRequestWhereConfigured) {
  Script script = batch::script();
  script.accept_empty = true;
  EXPECT_THAT(command_for(script, {})->arguments, ElementsAre(""));
}

TEST(BatchCall, RefusesANulThatWouldCutTheArgument) {
  EXPECT_EQ(command_for(script(), {.text = std::string("a\0b", 3)}).error().state, 10U);
}

TEST(BatchVerdict, OfExitCodeZeroIsStateOneAndTheOutput) {
  EXPECT_EQ(verdict(script(), exited(0, "12.5 mm\r\n")).answer,
            (Response{.text = "12.5 mm", .state = 1}));
}

TEST(BatchVerdict, OfAnotherExitCodeIsAHundredMore) {
  EXPECT_EQ(verdict(script(), exited(3, "no part")).answer,
            (Response{.text = "no part", .state = 103}));
  EXPECT_EQ(verdict(script(), exited(255, "x")).answer.state, 355U);
}

TEST(BatchVerdict, OfASilentFailureHasTheCode) {
  EXPECT_EQ(verdict(script(), exited(3, "\n")).answer,
            text::error(103, "measure ended with code 3"));
}

TEST(BatchVerdict, OfASilentSuccessIsEmpty) {
  EXPECT_EQ(verdict(script(), exited(0, "")).answer, (Response{.text = "", .state = 1}));
}

TEST(BatchVerdict, OfASignalIsFourHundredMore) {
  const Ended ended{.end = End::signalled, .code = SIGSEGV};
  EXPECT_EQ(verdict(script(), ended).answer, text::error(411, "measure was ended by signal 11"));
}

TEST(BatchVerdict, OfTheTimeLimitNamesIt) {
  const Ended ended{.end = End::time_limit};
  EXPECT_EQ(verdict(script(), ended).answer, text::error(11, "measure took longer than 30000 ms"));
}

TEST(BatchVerdict, OfAProgramThatDoesNotStartHasTheReason) {
  const Ended ended{.end = End::not_started, .reason = "no #! line"};
  EXPECT_EQ(verdict(script(), ended).answer,
            text::error(12, "measure cannot be started: no #! line"));
}

TEST(BatchVerdict, OfAWithdrawnCallHasItsState) {
  const Ended ended{.end = End::unwanted};
  EXPECT_EQ(verdict(script(), ended).answer.state, 14U);
}

TEST(BatchVerdict, AcceptsOutputThatJustFits) {
  const std::string full(127, 'x');
  EXPECT_EQ(verdict(script(), exited(0, full + "\n")).answer, (Response{.text = full, .state = 1}));
}

TEST(BatchVerdict, RefusesOutputThatIsTooLong) {
  const Verdict sut = verdict(script(), exited(0, std::string(128, 'x')));
  EXPECT_EQ(sut.answer, text::error(13, "output of measure: 128 bytes, at most 127 fit"));
}

TEST(BatchVerdict, CutsOutputWhereConfiguredAndRemarksIt) {
  Script script = batch::script();
  script.too_long = TooLong::cut;
  const Verdict sut = verdict(script, exited(0, std::string(128, 'x')));
  EXPECT_EQ(sut.answer, (Response{.text = std::string(127, 'x'), .state = 1}));
  EXPECT_THAT(sut.remark, HasSubstr("128 bytes of output, cut to 127"));
}

/// 127 characters are up to 381 bytes of UTF-8.
TEST(BatchVerdict, CountsCharactersOfUtf8Output) {
  std::string output;
  for (int i = 0; i < 127; ++i) {
    output += "€";
  }
  EXPECT_EQ(verdict(script(), exited(0, output)).answer.text, std::string(127, '\x80'));
}

TEST(BatchVerdict, IgnoresTheHalfCharacterAtTheEndOfWhatWasKept) {
  Script script = batch::script();
  script.too_long = TooLong::cut;
  Ended ended = exited(0, std::string(4095, 'x') + "\xC3");
  ended.output.size = 9000;
  EXPECT_EQ(verdict(script, ended).answer.state, 1U);
}

TEST(BatchVerdict, RefusesOutputOutsideTheControllersCodePage) {
  const Verdict sut = verdict(script(), exited(0, "中"));
  EXPECT_EQ(sut.answer.state, 13U);
  EXPECT_THAT(sut.answer.text, HasSubstr("U+4E2D"));
}

TEST(BatchVerdict, RefusesOutputWithANul) {
  EXPECT_EQ(verdict(script(), exited(0, std::string("a\0b", 3))).answer.state, 13U);
}

TEST(BatchVerdict, RemarksStandardError) {
  EXPECT_EQ(verdict(script(), exited(0, "x", "careful\n")).remark, "says: careful");
  EXPECT_THAT(verdict(script(), exited(0, "x")).remark, IsEmpty());
}

}  // namespace
}  // namespace millrace::services::batch
