#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/variables/write_rules.hpp"
#include "tests/unit/gateway/variable_requests_fixture.hpp"

namespace millrace::gateway::variables {
namespace {

using namespace std::chrono_literals;
using cnc::ads::ErrorCode;
using fabric::Quality;
using fabric::VariableAction;
using fabric::VariableReply;
using fabric::VariableRequest;
using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

TEST_F(VariableRequestsTest, ReadsManyNamesInOneRequest) {
  const VariableRequest asked = request({"V.E.A", "V.E.B", "V.E.C"});
  ask(asked);
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].requester, asked.requester);
  const VariableReply& reply = answers[0].reply;
  EXPECT_TRUE(reply.done);
  EXPECT_EQ(reply.token, asked.token);
  ASSERT_THAT(reply.results, SizeIs(3));
  EXPECT_EQ(reply.results[1].value.name, "V.E.B");
  EXPECT_EQ(reply.results[1].value.type, fabric::ValueType::sgn32);
  EXPECT_EQ(reply.results[1].value.at, now.wall);
  EXPECT_EQ(number_in(reply.results[1]), 2);
  EXPECT_TRUE(reply.results[1].writable);
  EXPECT_FALSE(reply.results[2].writable);
  EXPECT_THAT(look_ups, SizeIs(1));
  EXPECT_THAT(reads, ElementsAre(SizeIs(3)));
}

TEST_F(VariableRequestsTest, LooksUpANameOnceAndThenReadsIt) {
  for (int i = 1; i <= 5; ++i) {
    pass(10ms);
    numbers["V.E.A"] = i;
    ask(request({"V.E.A"}));
    settle();
    ASSERT_THAT(answers, SizeIs(i));
    EXPECT_EQ(number_in(answers.back().reply.results[0]), i);
  }
  EXPECT_THAT(look_ups, SizeIs(1));
  EXPECT_THAT(reads, SizeIs(5));
}

TEST_F(VariableRequestsTest, SharesOneReadAmongEqualRequestsOfACycle) {
  ask(request({"V.E.A"}, 1));
  // Two more while it is under way.
  auto look_up = sut->next(now);
  ASSERT_TRUE(look_up);
  ask(request({"V.E.A", "V.E.B"}, 2));
  do_it(*look_up);
  ask(request({"V.E.A"}, 3));
  settle();
  EXPECT_THAT(answers, SizeIs(3));
  EXPECT_THAT(reads.front(), ElementsAre("V.E.A"));
  const std::size_t asked = reads.size();
  // And within 2 ms of the answer.
  ask(request({"V.E.A"}, 4));
  pass(1ms);
  ask(request({"V.E.A"}, 5));
  EXPECT_THAT(answers, SizeIs(5));
  EXPECT_FALSE(step());
  EXPECT_THAT(reads, SizeIs(asked));
  pass(2ms);
  ask(request({"V.E.A"}, 6));
  settle();
  EXPECT_THAT(answers, SizeIs(6));
  EXPECT_THAT(reads, SizeIs(asked + 1));
}

TEST_F(VariableRequestsTest, NamesARefusedVariableWithItsError) {
  ask(request({"V.E.A", "V.E.NONE"}));
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_TRUE(answers[0].reply.done);
  const auto& none = answers[0].reply.results[1];
  EXPECT_EQ(none.value.quality, Quality::refused);
  EXPECT_EQ(none.value.reason, "0x710 symbol not found");
  EXPECT_EQ(none.error, 0x710U);
  EXPECT_EQ(number_in(answers[0].reply.results[0]), 1);
}

TEST_F(VariableRequestsTest, LooksUpAgainWhatTheControllerNoLongerHas) {
  ask(request({"V.E.A"}));
  settle();
  pass(10ms);
  failure = ErrorCode::invalid_handle;
  ask(request({"V.E.A"}));
  ASSERT_TRUE(step());
  EXPECT_THAT(answers, SizeIs(1));
  failure = ErrorCode::none;
  settle();
  ASSERT_THAT(answers, SizeIs(2));
  EXPECT_EQ(number_in(answers[1].reply.results[0]), 1);
  EXPECT_THAT(look_ups, SizeIs(2));

  // The controller refuses it although its description was just read: the answer is the refusal.
  pass(10ms);
  failure = ErrorCode::access_denied_index;
  ask(request({"V.E.A"}));
  settle();
  ASSERT_THAT(answers, SizeIs(3));
  EXPECT_EQ(answers[2].reply.results[0].error, 0x704U);
}

TEST_F(VariableRequestsTest, ReportsThatTheControllerDoesNotAnswer) {
  ask(request({"V.E.A"}));
  ASSERT_TRUE(step());
  failure = ErrorCode::timeout;
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].reply.results[0].value.quality, Quality::stale);
  EXPECT_THAT(answers[0].reply.results[0].value.reason, HasSubstr("0x745"));
}

TEST_F(VariableRequestsTest, ReadsNothingWhileTheLinkIsDown) {
  ask(request({"V.E.A"}));
  sut->on_down("Connection refused", now);
  keep_news();
  ask(request({"V.E.A"}));
  ASSERT_THAT(answers, SizeIs(2));
  for (const auto& answer : answers) {
    EXPECT_FALSE(answer.reply.done);
    EXPECT_EQ(answer.reply.reason, "the link to press is down: Connection refused");
  }
  EXPECT_FALSE(sut->next(now));
  EXPECT_EQ(sut->next_time(now.steady), std::nullopt);
  sut->on_up({1}, now);
  ask(request({"V.E.A"}));
  settle();
  EXPECT_TRUE(answers[2].reply.done);
}

TEST_F(VariableRequestsTest, AnswersARequestAfterItsTimeout) {
  begin({.writable = {}, .requests_per_second = 1});
  ask(request({"V.E.A"}));
  ASSERT_TRUE(step());
  VariableRequest hasty = request({"V.E.B"});
  hasty.patience = 20ms;
  ask(hasty);
  const auto next = sut->next_time(now.steady);
  ASSERT_TRUE(next);
  EXPECT_EQ(*next - now.steady, 20ms);
  pass(20ms);
  sut->on_time(now);
  keep_news();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].reply.token, hasty.token);
  EXPECT_THAT(answers[0].reply.reason, AllOf(HasSubstr("press could not be asked within 20 ms"),
                                             HasSubstr("1 requests a second are allowed")));
}

TEST_F(VariableRequestsTest, KeepsToItsBudget) {
  begin({.writable = {}, .requests_per_second = 100});
  const SteadyTime begun = now.steady;
  std::size_t requests = 0;
  for (int i = 0; i < 200; ++i) {
    pass(3ms);
    ask(request({"V.E.A"}));
    while (auto wanted = sut->next(now)) {
      requests += std::holds_alternative<data::Resolve>(*wanted) ? 2U : 1U;
      do_it(*wanted);
      keep_news();
    }
  }
  const double seconds = std::chrono::duration<double>(now.steady - begun).count();
  EXPECT_LE(static_cast<double>(requests), 100 * seconds + 12);
  EXPECT_THAT(answers, SizeIs(testing::Ge(190U)));
}

TEST_F(VariableRequestsTest, ListsAPage) {
  VariableRequest list = request({"V.E"});
  list.action = VariableAction::list;
  list.first = 64;
  ask(list);
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].reply.total, 2U);
  ASSERT_THAT(answers[0].reply.results, SizeIs(1));
  EXPECT_EQ(answers[0].reply.results[0].value.name, "V.E.A");
  EXPECT_THAT(pages, ElementsAre(64U));
  list = request({"V.CYC"});
  list.action = VariableAction::list;
  ask(list);
  EXPECT_THAT(answers[1].reply.reason, HasSubstr("V.CYC cannot be listed; one of V.G, V.E"));
}

TEST_F(VariableRequestsTest, RefusesWhatIsNoRequest) {
  VariableRequest excess = request({});
  excess.excess = "1000 names; at most 256 are answered in one request";
  VariableRequest valued = request({"V.E.A"});
  valued.values = {{"1"}};
  VariableRequest kind = request({"V.E.A"});
  kind.action = static_cast<VariableAction>(9);
  for (const auto& [sent, reason] : std::vector<std::pair<VariableRequest, std::string>>{
           {excess, "the request has 1000 names"},
           {request({}), "names no variable"},
           {request({"V.E.A", ""}), "name 1 is empty"},
           {request({std::string(256, 'V')}), "name 0 has 256 bytes"},
           {request({std::string("V.E\0A", 5)}), "name 0 has a NUL at byte 3"},
           {request({"V.E.\nA"}), "name 0 has a control character at byte 4"},
           {valued, "a request to read has values"},
           {kind, "of a kind that this gateway does not know"}}) {
    ask(sent);
    EXPECT_FALSE(answers.back().reply.done);
    EXPECT_EQ(answers.back().reply.token, sent.token);
    EXPECT_THAT(answers.back().reply.reason, HasSubstr(reason));
  }
  EXPECT_FALSE(sut->next(now));
}

TEST_F(VariableRequestsTest, LimitsTheRequestsOfOneAndOfAll) {
  for (std::size_t i = 0; i < VariableRequests::most_of_one; ++i) {
    ask(request({"V.E.A"}, 1));
  }
  EXPECT_THAT(answers, IsEmpty());
  ask(request({"V.E.A"}, 1));
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("at most 16 do"));
  for (std::size_t i = VariableRequests::most_of_one; i < VariableRequests::most_requests; ++i) {
    ask(request({"V.E.A"}, static_cast<std::uint8_t>(2 + i / VariableRequests::most_of_one)));
  }
  EXPECT_THAT(answers, SizeIs(1));
  ask(request({"V.E.A"}, 200));
  ASSERT_THAT(answers, SizeIs(2));
  EXPECT_THAT(answers[1].reply.reason, HasSubstr("256 requests wait already for press"));
  settle();
  EXPECT_THAT(answers, SizeIs(2 + VariableRequests::most_requests));
}

TEST_F(VariableRequestsTest, LimitsTheNumberOfNames) {
  std::uint32_t number = 0;
  for (std::size_t asked = 0; asked < VariableRequests::most_names;
       asked += fabric::most_variables) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < fabric::most_variables; ++i) {
      names.push_back("V.E.N" + std::to_string(++number));
    }
    ask(request(names, static_cast<std::uint8_t>(1 + number / 1024)));
  }
  EXPECT_THAT(answers, IsEmpty());
  ask(request({"V.E.A"}, 99));
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("8192 variables of press are being requested"));
}

TEST_F(VariableRequestsTest, LimitsTheBytesOfAReply) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < fabric::most_variables; ++i) {
    numbers[names.emplace_back("V.E.S" + std::to_string(i))] = 0;
  }
  for (const std::uint32_t each : {256U, 257U}) {
    text_size = each;
    begin();
    ask(request(names));
    settle();
  }
  ASSERT_THAT(answers, SizeIs(2));
  EXPECT_EQ(answers[0].reply.reason, fabric::Message());
  EXPECT_THAT(answers[1].reply.reason, HasSubstr("65792 bytes together; at most 65536"));
}

TEST_F(VariableRequestsTest, HasRoomAgainForNamesThatItHasAnswered) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < fabric::most_variables; ++i) {
    names.push_back("V.E.N" + std::to_string(i));
  }
  for (std::size_t asked = 0; asked <= VariableRequests::most_names; asked += names.size()) {
    ask(request(names));
    settle();
    pass(1s);
  }
  EXPECT_THAT(answers.back().reply.reason, Not(HasSubstr("are being requested")));
}

TEST_F(VariableRequestsTest, LeavesPendingRequestsToTheGatewayThatServesTheChannelNow) {
  ask(request({"V.E.A"}));
  auto wanted = sut->next(now);
  ASSERT_TRUE(wanted);
  sut->on_over(1, now);
  do_it(*wanted);
  keep_news();
  EXPECT_THAT(answers, IsEmpty());
  EXPECT_FALSE(sut->next(now));
}

TEST_F(VariableRequestsTest, KeepsUnknownNamesFromDelayingOthers) {
  ask(request({"V.E.A"}));
  settle();
  pass(10ms);
  int number = 0;
  ask(request({"V.E.A"}, 2));
  for (int i = 0; i < 3 && answers.size() < 2; ++i) {
    std::vector<std::string> names;
    for (int n = 0; n < 64; ++n) {
      names.push_back("V.E.NONE" + std::to_string(++number));
    }
    ask(request(names, 3));
    step();
  }
  EXPECT_THAT(answers, SizeIs(testing::Ge(2U)));
}

TEST_F(VariableRequestsTest, WritesAllowedVariablesAndReportsOldAndNewValues) {
  ask(write({"V.E.A", "V.E.B"}, {{"-7"}, {"8"}}));
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  const VariableReply& reply = answers[0].reply;
  EXPECT_TRUE(reply.done) << reply.reason.text;
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

TEST_F(VariableRequestsTest, ReportsWhatIsWrittenWhenTheLinkEndsBetweenTwoWrites) {
  ask(write({"V.E.A", "V.E.B"}, {{"1"}, {"2"}}));
  while (writes.empty()) {
    ASSERT_TRUE(step());
  }
  sut->on_down("reset by peer", now);
  keep_news();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].reply.reason,
            "V.E.B is not written; the 1 before it are. The link to press is down: reset by peer");
  EXPECT_THAT(written, ElementsAre(Field(&Output::Written::done, true),
                                   Field(&Output::Written::done, false)));
}

TEST_F(VariableRequestsTest, ReportsAWriteThatIsDoneWhenTheLinkEndsBeforeItIsReadBack) {
  ask(write({"V.E.A"}, {{"1"}}));
  while (writes.empty()) {
    ASSERT_TRUE(step());
  }
  sut->on_down("reset by peer", now);
  keep_news();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].reply.reason,
            "written, but not read back. The link to press is down: reset by peer");
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
  EXPECT_TRUE(answers[2].reply.done) << answers[2].reply.reason.text;
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

// A write may change more than its variable: an element and its array are two names.
TEST_F(VariableRequestsTest, ReadsAfterAWriteWhatItHadReadBefore) {
  begin({.writable = {{"V.E.*"}}, .requests_per_second = 1000, .cycle = 10s});
  ask(request({"V.E.A", "V.E.B"}));
  settle();
  ask(write({"V.E.A"}, {{"5"}}));
  settle();
  numbers["V.E.B"] = 6;
  ask(request({"V.E.A", "V.E.B"}));
  settle();
  ASSERT_THAT(answers, SizeIs(3));
  EXPECT_EQ(number_in(answers[2].reply.results[0]), 5);
  EXPECT_EQ(number_in(answers[2].reply.results[1]), 6);
}

TEST_F(VariableRequestsTest, ReportsALimitedNumberOfRefusedWritesASecondAndCountsTheOthers) {
  for (int i = 0; i < 100; ++i) {
    ask(write({"V.G.X"}, {{"1"}}));
  }
  EXPECT_THAT(answers, SizeIs(100));
  EXPECT_THAT(written, SizeIs(testing::Le(20U)));
  const std::size_t reported = written.size();
  pass(1s);
  ask(write({"V.G.X"}, {{"1"}}));
  ASSERT_THAT(written, SizeIs(reported + 1));
  EXPECT_THAT(written.back().detail,
              HasSubstr(std::to_string(100 - reported) + " more were refused"));
}

TEST(WriteRules, AllowNoWriteThatNoRuleNames) {
  EXPECT_THAT(objection({}, 1, "V.E.LIMIT"), HasSubstr("variables { write: \"V.E.LIMIT\" } does"));
  EXPECT_THAT(objection({{"V.E.LIMITS"}, {"V.E.LIMI"}, {"V.P.*"}}, 1, "V.E.LIMIT"),
              HasSubstr("V.E.LIMIT may not be written"));
}

TEST(WriteRules, AllowWhatAPatternMatches) {
  const WriteRules sut{{"V.E.*"}, {"V.A.*.X"}, {"P10"}, {"V.P.A*B*C"}};
  for (const char* name : {"V.E.LIMIT", "V.E.TABLE[3]", "V.E.A.B", "V.A.OFFSET.X", "P10", "V.P.ABC",
                           "V.P.AxxBxBxxC"}) {
    EXPECT_THAT(objection(sut, 1, name), IsEmpty()) << name;
  }
  for (const char* name :
       {"V.E", "v.e.limit", "V.A.OFFSET.Y", "P1", "P100", "V.P.AB", "V.P.ACB", " V.E.A", "V.G.A"}) {
    EXPECT_THAT(objection(sut, 1, name), HasSubstr("may not be written")) << name;
  }
}

TEST(WriteRules, AllowNoWriteOfAnObject) {
  for (const char* name : {"state", "mc_command_override_w", "V.CYC.A", "x"}) {
    EXPECT_THAT(objection({{"*"}}, 1, name), HasSubstr("all others are read-only")) << name;
  }
}

TEST(WriteRules, HoldInTheirChannels) {
  const WriteRules sut{{"V.E.*", {2, 4}}};
  EXPECT_THAT(objection(sut, 2, "V.E.A"), IsEmpty());
  EXPECT_THAT(objection(sut, 4, "V.E.A"), IsEmpty());
  EXPECT_THAT(objection(sut, 1, "V.E.A"), HasSubstr("may not be written"));
}

TEST(WriteRules, NeverAllowAWriteOfTheServiceInterfaceHoweverItIsSpelled) {
  // A rule that no configuration may have.
  const WriteRules everything{{"*"}};
  for (const std::string name :
       {"V.G.SERVICE.UUID", "V.G.SERVICE", "V.G.SERVICE.RESPONSE_STATE", "v.g.service.request",
        "V.g.SerVice.REQUEST", " V.G.SERVICE.UUID", "V . G . SERVICE . UUID", "V.G.SERVICE[0].UUID",
        "V.G.SERVICE .UUID", "V.G.\tSERVICE.UUID", "V.G.SERVICE*"}) {
    EXPECT_TRUE(is_service_interface(name)) << name;
    EXPECT_THAT(objection(everything, 1, name), HasSubstr("never written")) << name;
  }
  EXPECT_TRUE(is_service_interface(std::string("V.G.\0SERVICE.UUID", 17)));
  EXPECT_TRUE(is_service_interface("V.G.SER\xA0VICE.UUID"));
  for (const char* name : {"V.G.SERVICES.UUID", "V.G.SERVICE0", "V.G.SERVICE9", "V.G.SERVICEA",
                           "V.G.SERVICEZ", "V.E.SERVICE.UUID", "V.G.SERVICE_2", "V.G.SERVIC"}) {
    EXPECT_FALSE(is_service_interface(name)) << name;
    EXPECT_THAT(objection(everything, 1, name), IsEmpty()) << name;
  }
}

TEST(WriteRules, OfAConfigurationNameAFamily) {
  for (const char* pattern : {"V.E.*", "V.G.NP[*].V", "P10", "V.L.COUNT"}) {
    EXPECT_THAT(wrong_pattern(pattern), IsEmpty()) << pattern;
  }
  for (const char* pattern :
       {"", "*", "V.*", "V.E", "mc_x_w", "P*", "V.E.A B", "V.E.\n", "v.e.a"}) {
    EXPECT_THAT(wrong_pattern(pattern), HasSubstr("expected a variable as programs write it"))
        << pattern;
  }
  EXPECT_THAT(wrong_pattern("V.G.SERVICE.*"), HasSubstr("never written"));
}

}  // namespace
}  // namespace millrace::gateway::variables
