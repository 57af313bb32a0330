#include "tests/unit/gateway/variable_requests_fixture.hpp"

namespace millrace::gateway::variables {
namespace {

using namespace std::chrono_literals;
using cnc::ads::ErrorCode;
using fabric::VariableReply;
using fabric::VariableRequest;
using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(VariableRequestsTest, WritesAllowedVariablesAndReportsOldAndNewValues) {
  ask(write({"V.E.A", "V.E.B"}, {{"-7"}, {"8"}}));
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  const VariableReply& reply = answers[0].reply;
  EXPECT_TRUE(reply.done) << reply.reason;
  EXPECT_EQ(number_in(reply.results[0]), -7);
  EXPECT_EQ(reply.before[1].elements, fabric::Elements(std::vector<std::int64_t>{2}));
  EXPECT_THAT(writes, ElementsAre("V.E.A", "V.E.B"));
  ASSERT_THAT(written, SizeIs(2));
  EXPECT_TRUE(written[0].done);
  EXPECT_EQ(written[0].detail, "press/1: V.E.A was 1, is written as -7, by she@panel");
  EXPECT_THAT(lines, Each(HasSubstr("by she@panel")));
}

TEST_F(VariableRequestsTest, WritesOnceForARepeatedRequest) {
  const VariableRequest change = write({"V.E.A"}, {{"5"}});
  ask(change);
  ask(change);
  settle();
  ask(change);
  settle();
  EXPECT_THAT(writes, SizeIs(1));
  ASSERT_THAT(answers, SizeIs(2));
  EXPECT_EQ(answers[0].reply, answers[1].reply);
}

TEST_F(VariableRequestsTest, ChecksAllOfAWriteBeforeAnyOfItIsWritten) {
  for (const auto& [names, values, reason] :
       std::vector<std::tuple<std::vector<std::string>, std::vector<std::vector<std::string>>,
                              std::string>>{
           {{"V.E.A", "V.E.NONE"}, {{"1"}, {"1"}}, "V.E.NONE is not written: 0x710"},
           {{"V.E.A", "V.E.C"}, {{"1"}, {"1"}}, "V.E.C is not written: it is READ_ONLY"},
           {{"V.E.A", "V.E.B"}, {{"1"}, {"1", "2"}}, "2 values for 1 elements"},
           {{"V.E.A", "V.E.B"}, {{"1"}, {"x"}}, "'x' is not a SGN32"},
           {{"V.E.A", "V.E.B"}, {{"1"}, {}}, "0 values for 1 elements"},
           {{"V.E.A", "V.E.A"}, {{"1"}, {"2"}}, "a variable is named twice"},
           {{"V.E.A", "V.E.B"}, {{"1"}}, "values for 1 variables and 2 names"},
           {{"V.E.A", "V.G.B"}, {{"1"}, {"1"}}, "V.G.B may not be written"},
           {{"V.E.A", "v.g.service.uuid"}, {{"1"}, {"1"}}, "never written over the fabric"}}) {
    pass(1s);
    ask(write(names, values));
    settle();
    EXPECT_FALSE(answers.back().reply.done);
    EXPECT_THAT(answers.back().reply.reason, HasSubstr(reason));
    ASSERT_FALSE(written.empty());
    EXPECT_FALSE(written.back().done);
    EXPECT_THAT(written.back().detail, AllOf(HasSubstr(reason), HasSubstr("by she@panel")));
  }
  EXPECT_THAT(writes, IsEmpty());
}

TEST_F(VariableRequestsTest, StopsAtAVariableThatTheControllerRefuses) {
  unwritable = "V.E.B";
  numbers["V.E.D"] = 4;
  ask(write({"V.E.A", "V.E.B", "V.E.D"}, {{"1"}, {"2"}, {"3"}}));
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_FALSE(answers[0].reply.done);
  EXPECT_THAT(answers[0].reply.reason,
              AllOf(HasSubstr("V.E.B is not written: 0x704"), HasSubstr("the 1 before it are")));
  EXPECT_EQ(answers[0].reply.results[1].error, 0x704U);
  EXPECT_THAT(writes, ElementsAre("V.E.A", "V.E.B"));
  write_error = ErrorCode::timeout;
  ask(write({"V.E.B"}, {{"2"}}));
  settle();
  EXPECT_THAT(answers[1].reply.reason, HasSubstr("V.E.B may or may not be written"));
}

TEST_F(VariableRequestsTest, ReportsAnUnknownOutcomeWhenTheLinkEndsDuringAWrite) {
  ask(write({"V.E.A"}, {{"1"}}));
  ASSERT_TRUE(step());
  ASSERT_TRUE(step());
  auto wanted = sut->next(now);
  ASSERT_TRUE(wanted && std::holds_alternative<WriteOne>(*wanted));
  sut->on_down("reset by peer", now);
  keep_news();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("V.E.A may or may not be written"));
  EXPECT_THAT(written, ElementsAre(Field(&Output::Written::done, false)));
}

TEST_F(VariableRequestsTest, WritesNothingOfAnEarlierRequestToAnotherGateway) {
  pass(1s);
  VariableRequest late = write({"V.E.A"}, {{"1"}});
  late.age = 1001ms;
  ask(late);
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("the request went to another gateway before"));
  // Variables that are not writable may be read here, too.
  VariableRequest read = request({"V.E.A"});
  read.age = 1h;
  ask(read);
  late = write({"V.E.A"}, {{"1"}});
  late.age = 999ms;
  ask(late);
  settle();
  EXPECT_TRUE(answers[1].reply.done);
  EXPECT_TRUE(answers[2].reply.done) << answers[2].reply.reason;
}

TEST_F(VariableRequestsTest, AnswersWithWhatIsThereAfterAWrite) {
  ask(request({"V.E.A"}));
  settle();
  ask(write({"V.E.A"}, {{"77"}}));
  settle();
  ask(request({"V.E.A"}));
  settle();
  EXPECT_EQ(number_in(answers.back().reply.results[0]), 77);
}

TEST_F(VariableRequestsTest, ReportsALimitedNumberOfRefusedWritesASecondAndCountsTheOthers) {
  for (int i = 0; i < 100; ++i) {
    ask(write({"V.G.X"}, {{"1"}}));
  }
  EXPECT_THAT(answers, SizeIs(100));
  EXPECT_THAT(written, SizeIs(testing::Le(20U)));
  const std::size_t told = written.size();
  pass(1s);
  ask(write({"V.G.X"}, {{"1"}}));
  ASSERT_THAT(written, SizeIs(told + 1));
  EXPECT_THAT(written.back().detail, HasSubstr(std::to_string(100 - told) + " more were refused"));
}

}  // namespace
}  // namespace millrace::gateway::variables
