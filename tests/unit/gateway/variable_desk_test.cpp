#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/bytes.hpp"
#include "gateway/variables/desk.hpp"

namespace millrace::gateway::variables {
namespace {

using namespace std::chrono_literals;
using cnc::ads::ByteWriter;
using cnc::ads::ErrorCode;
using cnc::variables::Access;
using cnc::variables::Reading;
using cnc::variables::Trouble;
using cnc::variables::Type;
using fabric::InstanceId;
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
using testing::SizeIs;

/// A controller whose variables are SGN32 numbers, and the time; both advance at a test's word.
class VariableDesk : public testing::Test {
 protected:
  VariableDesk() {
    numbers = {{"V.E.A", 1}, {"V.E.B", 2}, {"V.E.C", 3}};
    begin();
  }

  void begin(VariableSettings settings = {.writable = {{"V.E.*"}}, .requests_per_second = 1000}) {
    sut.emplace("press", std::move(settings));
    sut->on_up({1}, now);
  }

  void pass(std::chrono::nanoseconds time) {
    now.steady += time;
    now.wall += time;
  }

  static InstanceId id(std::uint8_t number) {
    InstanceId made;
    made.bytes.fill(number);
    return made;
  }

  VariableRequest request(std::vector<std::string> names, std::uint8_t asker = 1) {
    VariableRequest one{.asker = id(asker), .key = {"press", 1}, .names = std::move(names)};
    one.token.bytes[0] = static_cast<std::uint8_t>(++tokens & 0xFF);
    one.token.bytes[1] = static_cast<std::uint8_t>(tokens >> 8);
    one.issuer = "she@panel";
    return one;
  }
  VariableRequest write(std::vector<std::string> names,
                        std::vector<std::vector<std::string>> values) {
    VariableRequest one = request(std::move(names));
    one.action = VariableAction::write;
    one.values = std::move(values);
    return one;
  }

  void ask(const VariableRequest& one) {
    sut->on_request(one, now);
    keep_news();
  }

  Reading reading_of(const std::string& name) const {
    Reading reading;
    reading.length = 4;
    reading.size = 4;
    reading.type = {Type::sgn32, 4};
    reading.input = cnc::ads::Bytes(name.begin(), name.end());
    reading.access = name == "V.E.C" ? Access::read_only : Access::read_write;
    return reading;
  }

  /// Does the step that the desk wants; false if it wants none.
  bool step() {
    auto wanted = sut->next(now);
    if (!wanted) {
      return false;
    }
    pass(round_trip);
    do_it(*wanted);
    keep_news();
    return true;
  }
  void settle() {
    while (step()) {
    }
  }

  void do_it(const Step& wanted) {
    if (const auto* look_up = std::get_if<data::LookUp>(&wanted)) {
      look_ups.push_back(look_up->names);
      std::vector<Found> found;
      for (const std::string& name : look_up->names) {
        found.push_back(numbers.contains(name) ? Found(reading_of(name))
                                               : tl::unexpected(Trouble{ErrorCode::symbol_not_found,
                                                                        "0x710 symbol not found"}));
      }
      sut->on_looked_up(found, 2, now);
    } else if (const auto* read = std::get_if<data::Read>(&wanted)) {
      std::vector<std::string> names;
      std::vector<Answered> values;
      for (const Reading& reading : read->readings) {
        names.emplace_back(reading.input.begin(), reading.input.end());
        if (failure != ErrorCode::none) {
          values.emplace_back(tl::unexpected(failure));
        } else if (!numbers.contains(names.back())) {
          values.emplace_back(tl::unexpected(ErrorCode::invalid_handle));
        } else {
          values.emplace_back(
              ByteWriter().u32(static_cast<std::uint32_t>(numbers[names.back()])).take());
        }
      }
      reads.push_back(names);
      sut->on_read(values, 1, true, now);
    } else if (const auto* one = std::get_if<WriteOne>(&wanted)) {
      writes.push_back(one->name);
      if (unwritable == one->name) {
        sut->on_written(tl::unexpected(write_error), 1, now);
        return;
      }
      cnc::ads::ByteReader in(one->value);
      numbers[one->name] = static_cast<std::int32_t>(in.u32());
      sut->on_written({}, 1, now);
    } else {
      const auto& list = std::get<ListPage>(wanted);
      pages.push_back(list.first);
      sut->on_listed(
          Page{2,
               {{.type = Type::real64, .size = 8, .dimensions = {}, .name = list.family + ".A"}}},
          2, now);
    }
  }

  void keep_news() {
    News news = sut->take_news();
    for (auto& one : news.answers) {
      answers.push_back(std::move(one));
    }
    for (auto& one : news.written) {
      written.push_back(one);
    }
    for (auto& one : news.lines) {
      lines.push_back(one.text);
    }
  }

  static std::int64_t number_in(const fabric::VariableResult& result) {
    return std::get<std::vector<std::int64_t>>(result.value.elements).at(0);
  }

  std::map<std::string, std::int32_t> numbers;
  ErrorCode failure = ErrorCode::none;
  std::string unwritable;
  ErrorCode write_error = ErrorCode::access_denied_index;
  std::chrono::nanoseconds round_trip = 100us;
  Moment now{SteadyTime{} + 1h, fabric::Time(1h)};
  std::uint32_t tokens = 0;
  std::optional<Desk> sut;
  std::vector<std::vector<std::string>> look_ups;
  std::vector<std::vector<std::string>> reads;
  std::vector<std::string> writes;
  std::vector<std::uint32_t> pages;
  std::vector<News::Answer> answers;
  std::vector<News::Written> written;
  std::vector<std::string> lines;
};

TEST_F(VariableDesk, ReadsManyNamesInOneRequest) {
  const VariableRequest asked = request({"V.E.A", "V.E.B", "V.E.C"});
  ask(asked);
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].asker, asked.asker);
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

TEST_F(VariableDesk, LooksANameUpOnceAndThenReadsIt) {
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

TEST_F(VariableDesk, AsksTheSameQuestionOnceInACycle) {
  ask(request({"V.E.A"}, 1));
  // Two more while it is being asked.
  auto look_up = sut->next(now);
  ASSERT_TRUE(look_up);
  ask(request({"V.E.A", "V.E.B"}, 2));
  do_it(*look_up);
  ask(request({"V.E.A"}, 3));
  settle();
  EXPECT_THAT(answers, SizeIs(3));
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

TEST_F(VariableDesk, SaysWhichOfTheNamesTheControllerRefusesAndWithWhichError) {
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

TEST_F(VariableDesk, LooksUpAnewWhatTheControllerDoesNotKnowAnyMore) {
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

  // What it refuses although it was looked up just now, it refuses.
  pass(10ms);
  failure = ErrorCode::access_denied_index;
  ask(request({"V.E.A"}));
  settle();
  ASSERT_THAT(answers, SizeIs(3));
  EXPECT_EQ(answers[2].reply.results[0].error, 0x704U);
}

TEST_F(VariableDesk, SaysThatTheControllerDoesNotAnswer) {
  ask(request({"V.E.A"}));
  ASSERT_TRUE(step());
  failure = ErrorCode::timeout;
  settle();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].reply.results[0].value.quality, Quality::stale);
  EXPECT_THAT(answers[0].reply.results[0].value.reason, HasSubstr("0x745"));
}

TEST_F(VariableDesk, AsksNothingWhileTheLinkIsDown) {
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

TEST_F(VariableDesk, TellsWhoHasWaitedLongEnough) {
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

TEST_F(VariableDesk, KeepsToItsBudget) {
  begin({.writable = {}, .requests_per_second = 100});
  const SteadyTime begun = now.steady;
  std::size_t requests = 0;
  for (int i = 0; i < 200; ++i) {
    pass(3ms);
    ask(request({"V.E.A"}));
    while (auto wanted = sut->next(now)) {
      requests += std::holds_alternative<data::LookUp>(*wanted) ? 2U : 1U;
      do_it(*wanted);
      keep_news();
    }
  }
  const double seconds = std::chrono::duration<double>(now.steady - begun).count();
  EXPECT_LE(static_cast<double>(requests), 100 * seconds + 12);
  EXPECT_THAT(answers, SizeIs(testing::Ge(190U)));
}

TEST_F(VariableDesk, WritesWhatItMayAndTellsHowItWasAndIs) {
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

TEST_F(VariableDesk, WritesOnceHoweverOftenItIsSaid) {
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

TEST_F(VariableDesk, ChecksAllOfAWriteBeforeAnyOfItIsWritten) {
  for (const auto& [names, values, reason] :
       std::vector<std::tuple<std::vector<std::string>, std::vector<std::vector<std::string>>,
                              std::string>>{
           {{"V.E.A", "V.E.NONE"}, {{"1"}, {"1"}}, "V.E.NONE is not written: 0x710"},
           {{"V.E.A", "V.E.C"}, {{"1"}, {"1"}}, "V.E.C is not written: it is READ_ONLY"},
           {{"V.E.A", "V.E.B"}, {{"1"}, {"1", "2"}}, "2 values for 1 elements"},
           {{"V.E.A", "V.E.B"}, {{"1"}, {"x"}}, "'x' is no SGN32"},
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

TEST_F(VariableDesk, StopsAtTheVariableThatTheControllerDoesNotTake) {
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
  EXPECT_THAT(answers[1].reply.reason, HasSubstr("nobody knows whether V.E.B was written"));
}

TEST_F(VariableDesk, SaysThatAWriteIsUnknownWhenTheLinkEndsUnderIt) {
  ask(write({"V.E.A"}, {{"1"}}));
  ASSERT_TRUE(step());
  ASSERT_TRUE(step());
  auto wanted = sut->next(now);
  ASSERT_TRUE(wanted && std::holds_alternative<WriteOne>(*wanted));
  sut->on_down("reset by peer", now);
  keep_news();
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("nobody knows whether V.E.A was written"));
  EXPECT_THAT(written, ElementsAre(Field(&News::Written::done, false)));
}

TEST_F(VariableDesk, WritesNothingThatWasAskedOfAnotherGatewayBefore) {
  pass(1s);
  VariableRequest late = write({"V.E.A"}, {{"1"}});
  late.age = 1001ms;
  ask(late);
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("it was asked of another gateway before"));
  // What is only read may be read here, too.
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

TEST_F(VariableDesk, AnswersWithWhatIsThereAfterAWrite) {
  ask(request({"V.E.A"}));
  settle();
  ask(write({"V.E.A"}, {{"77"}}));
  settle();
  ask(request({"V.E.A"}));
  settle();
  EXPECT_EQ(number_in(answers.back().reply.results[0]), 77);
}

TEST_F(VariableDesk, ListsAPage) {
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

TEST_F(VariableDesk, RefusesWhatIsNoRequest) {
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

TEST_F(VariableDesk, HasRoomForSoManyRequestsOfOneAndOfAll) {
  for (std::size_t i = 0; i < Desk::most_of_one; ++i) {
    ask(request({"V.E.A"}, 1));
  }
  EXPECT_THAT(answers, IsEmpty());
  ask(request({"V.E.A"}, 1));
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("at most 16 do"));
  for (std::size_t i = Desk::most_of_one; i < Desk::most_requests; ++i) {
    ask(request({"V.E.A"}, static_cast<std::uint8_t>(2 + i / Desk::most_of_one)));
  }
  EXPECT_THAT(answers, SizeIs(1));
  ask(request({"V.E.A"}, 200));
  ASSERT_THAT(answers, SizeIs(2));
  EXPECT_THAT(answers[1].reply.reason, HasSubstr("256 requests wait already for press"));
  settle();
  EXPECT_THAT(answers, SizeIs(2 + Desk::most_requests));
}

TEST_F(VariableDesk, HasRoomForSoManyNames) {
  std::uint32_t number = 0;
  for (std::size_t asked = 0; asked < Desk::most_names; asked += fabric::most_variables) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < fabric::most_variables; ++i) {
      names.push_back("V.E.N" + std::to_string(++number));
    }
    ask(request(names, static_cast<std::uint8_t>(1 + number / 1024)));
  }
  EXPECT_THAT(answers, IsEmpty());
  ask(request({"V.E.A"}, 99));
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_THAT(answers[0].reply.reason, HasSubstr("8192 variables of press are being asked for"));
}

TEST_F(VariableDesk, TellsOfSoManyRefusedWritesInASecondAndCountsTheOthers) {
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

TEST_F(VariableDesk, LeavesWhoWaitsToTheGatewayThatServesTheChannelNow) {
  ask(request({"V.E.A"}));
  auto wanted = sut->next(now);
  ASSERT_TRUE(wanted);
  sut->on_over(1, now);
  do_it(*wanted);
  keep_news();
  EXPECT_THAT(answers, IsEmpty());
  EXPECT_FALSE(sut->next(now));
}

TEST_F(VariableDesk, DoesNotLetWhoAsksForWhatIsNotThereKeepOthersWaiting) {
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

}  // namespace
}  // namespace millrace::gateway::variables
