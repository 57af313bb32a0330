#include "services/archiver/answering.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/text/answer.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

CallInfo call(const std::string& request) {
  return {.call = {.epoch = 0x5f, .number = 3},
          .key = {.machine = "cnc", .channel = 2},
          .state = 9,
          .request = request,
          .replayed = true};
}

TEST(ArchiverAnswering, KeepsTheRequestAndItsFieldsInUtf8) {
  const auto sut = put_of(call("PUT ma\xDF=1 x=Ma\xDF"), morning);
  ASSERT_FALSE(sut) << "keys are ASCII";
  const auto good = put_of(call("PUT x=Ma\xDF"), morning);
  ASSERT_TRUE(good);
  EXPECT_EQ(good->text, "PUT x=Maß");
  EXPECT_THAT(good->fields, ElementsAre(Field{"x", "Maß"}));
  EXPECT_EQ(good->key.channel, 2);
  EXPECT_EQ(good->state, 9U);
  EXPECT_EQ(good->at, morning);
  EXPECT_TRUE(good->replayed);
}

TEST(ArchiverAnswering, KeepsFreeText) {
  const auto sut = put_of(call("tool 5 changed"), morning);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->text, "tool 5 changed");
  EXPECT_THAT(sut->fields, IsEmpty());
}

TEST(ArchiverAnswering, RefusesABadRequest) {
  EXPECT_EQ(put_of(call("PUT a"), morning).error(), text::error(10, "expected key=value at 'a'"));
}

TEST(ArchiverAnswering, AnswersWithTheIdOrTheReason) {
  EXPECT_EQ(answer_to(17), (sdk::Response{.text = "OK 17", .state = 1}));
  EXPECT_EQ(answer_to(tl::unexpected(std::string("disk full"))),
            text::error(11, "the archive cannot be written: disk full"));
}

}  // namespace
}  // namespace millrace::services::archiver
