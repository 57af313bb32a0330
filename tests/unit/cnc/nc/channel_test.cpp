// The interface of a channel to a controller around it; the suite of programs tests the language
// itself.
#include "cnc/nc/channel.hpp"

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/run/system_data.hpp"
#include "tests/unit/cnc/nc/scenario.hpp"

namespace millrace::cnc::nc::test {
namespace {

using namespace std::chrono_literals;

class NcChannel : public testing::Test {
 protected:
  void start(Channel& channel, const std::string& program) {
    const auto started = channel.start("test.nc", program);
    ASSERT_TRUE(started) << started.error().front().to_string();
  }

  // The texts of all messages up to a time, in ticks of one second.
  std::vector<std::string> messages(Channel& channel, std::chrono::seconds until) {
    std::vector<std::string> texts;
    for (; now_ <= until; now_ += 1s) {
      for (const Event& event : channel.tick(now_, environment_)) {
        if (const auto* message = std::get_if<MessageEvent>(&event)) {
          texts.push_back(message->text);
        }
      }
    }
    return texts;
  }

  MapEnvironment environment_;
  std::chrono::nanoseconds now_{};
};

using Texts = std::vector<std::string>;

TEST_F(NcChannel, IsExactHoweverCoarseTheTicksAre) {
  Channel sut;
  start(sut,
        "#TIMER START SYN [ID=1]\n"
        "G04 0.25\nG04 0.5\n"
        "#TIMER READ SYN [ID=1]\n"
        "#MSG [\"%d ms\", V.G.TIMER[1]]\nM30\n");
  EXPECT_EQ(messages(sut, 2s), Texts{"750 ms"});
}

TEST_F(NcChannel, SharesTimersWithTheOtherChannelsOfItsController) {
  const auto timers = std::make_shared<Timers>();
  Channel first({}, timers);
  Channel sut({}, timers);
  start(first, "#TIMER START [ID=5]\n#WAIT FOR FALSE\n");
  start(sut, "G04 3\n#FLUSH WAIT\n#TIMER READ [ID=5]\n#MSG [\"%d\", V.G.TIMER[5]]\nM30\n");
  first.tick(0s, environment_);
  EXPECT_EQ(messages(sut, 4s), Texts{"3000"});
}

TEST_F(NcChannel, HasItsOwnTimersByDefault) {
  Channel first;
  Channel sut;
  start(first, "#TIMER START [ID=5]\n#WAIT FOR FALSE\n");
  start(sut, "G04 3\n#FLUSH WAIT\n#TIMER READ [ID=5]\n#MSG [\"%d\", V.G.TIMER[5]]\nM30\n");
  first.tick(0s, environment_);
  EXPECT_EQ(messages(sut, 4s), Texts{"0"});
}

TEST_F(NcChannel, StartsNoProgramWhileOneRuns) {
  Channel sut;
  start(sut, "#WAIT FOR FALSE\n");
  EXPECT_TRUE(sut.active());
  const auto second = sut.start("second.nc", "M30\n");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().front().to_string(),
            "second.nc: error: a program is running; wait for its end or reset the channel");
  sut.reset();
  EXPECT_FALSE(sut.active());
  EXPECT_TRUE(sut.start("second.nc", "M30\n"));
}

TEST_F(NcChannel, StaysIdleIfTheProgramHasMistakes) {
  Channel sut;
  ASSERT_FALSE(sut.start("test.nc", "$ENDIF\n#NOSUCH\n"));
  EXPECT_EQ(sut.state(), ChannelState::idle);
  EXPECT_EQ(check("test.nc", "$ENDIF\n#NOSUCH\n").size(), 2U);
}

TEST(Check, FindsMembersThatTheServiceInterfaceDoesNotHave) {
  const auto found = check("test.nc",
                           "N10 V.G.SERVICE.REQ = \"3\"\n"
                           "N20 P1 = V.G.SERVICE.Response_State\n"
                           "N30 V.G.SERVICE.REQUEST = \"3\"\n"
                           "N40 V.G.SERVICE.REQUEST[1] = \"3\"\n"
                           "M30\n");
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].to_string(),
            "test.nc:1:5: N10: error: V.G.SERVICE.REQ does not exist; V.G.SERVICE has UUID, "
            "REQUEST, REQUEST_STATE, RESPONSE_STATE and RESPONSE");
  EXPECT_EQ(found[1].to_string(),
            "test.nc:2:10: N20: error: V.G.SERVICE.Response_State does not exist; write "
            "V.G.SERVICE.RESPONSE_STATE, in upper case");
  EXPECT_EQ(found[2].place.line, 4);
}

TEST(Check, FindsUnknownMembersBesideOtherMistakes) {
  EXPECT_EQ(check("test.nc", "V.G.SERVICE.REQ = 3\n$ENDIF\n").size(), 2U);
}

TEST_F(NcChannel, KeepsItsAxesWhereAResetFindsThem) {
  Channel sut;
  start(sut, "G01 X100 F6000\nM30\n");
  sut.tick(0s, environment_);
  sut.tick(250ms, environment_);
  sut.reset();
  EXPECT_DOUBLE_EQ(sut.axes().front().position, 25);
  start(sut, "#MSG [\"%.0f\", V.A.ABS.X]\nM30\n");
  EXPECT_EQ(messages(sut, 1s), Texts{"25"});
}

TEST_F(NcChannel, ListsTheVariablesOfAProgram) {
  Channel sut;
  start(sut,
        "#VAR\nV.P.TABLE[2][3] : SGN16 = [1, 2, 3, 4, 5, 6]\nV.P.NAME : STRING[20]\n#ENDVAR\n"
        "P7 = 1\n#WAIT FOR FALSE\n");
  sut.tick(0s, environment_);
  const run::Memory& variables = sut.variables();
  ASSERT_EQ(variables.count(VariableFamily::program), 2U);
  EXPECT_EQ(variables.count(VariableFamily::parameter), 1U);
  EXPECT_EQ(variables.count(VariableFamily::self), 0U);
  const auto name = variables.info(VariableFamily::program, 0);
  EXPECT_EQ(name->name, "V.P.NAME");
  EXPECT_EQ(name->shape, (VariableShape{VariableType::string, 20, {}}));
  const auto table = variables.find("V.P.TABLE[1][1]");
  EXPECT_EQ(table->name, "V.P.TABLE");
  EXPECT_EQ(table->shape, (VariableShape{VariableType::sgn16, 0, {2, 3}}));
  EXPECT_EQ(variables.read("V.P.TABLE[1][1]"), Value(5.0));
  EXPECT_FALSE(variables.read("V.P.TABLE[1][18446744073709551617]")) << "2^64 + 1 is not 1";
  EXPECT_FALSE(variables.info(VariableFamily::program, 2));
  EXPECT_FALSE(variables.find("V.P.NOSUCH"));
}

TEST_F(NcChannel, AllowsWritesOfItsVariablesFromOutside) {
  Channel sut;
  start(sut, "V.P.GO = 0\nV.P.TEXT = \"\"\n#WAIT FOR V.P.GO\n#MSG [\"%s\", V.P.TEXT]\nM30\n");
  sut.tick(0s, environment_);
  EXPECT_TRUE(sut.variables().overwrite("V.P.TEXT", Value("hello")));
  EXPECT_TRUE(sut.variables().overwrite("V.P.GO", Value(1.0)));
  EXPECT_EQ(messages(sut, 1s), Texts{"hello"});
}

TEST_F(NcChannel, RefusesValuesFromOutsideThatDoNotFit) {
  Channel sut;
  start(sut, "#VAR\nV.P.A : UNS08\nV.P.B : STRING[2]\n#ENDVAR\n#WAIT FOR FALSE\n");
  sut.tick(0s, environment_);
  EXPECT_EQ(sut.variables().overwrite("V.P.A", Value("1")).error().id, 21461);
  EXPECT_EQ(sut.variables().overwrite("V.P.A", Value(256.0)).error().id, 21883);
  EXPECT_EQ(sut.variables().overwrite("V.P.B", Value("abc")).error().id, 21462);
  EXPECT_FALSE(sut.variables().overwrite("V.P.NEW", Value(1.0)));
  EXPECT_FALSE(sut.variables().find("V.P.NEW"));
}

TEST_F(NcChannel, IncludesTheCycleThatWaitsForAService) {
  EXPECT_TRUE(shipped_cycle("SysServiceWait.cyc"));
  EXPECT_TRUE(shipped_cycle("SYSSERVICEWAIT.CYC"));
  EXPECT_FALSE(shipped_cycle("NoSuch.cyc"));
  EXPECT_TRUE(
      check("SysServiceWait.cyc", std::string(*shipped_cycle("SysServiceWait.cyc"))).empty());
}

// A controller may have its own SysServiceWait.cyc.
TEST_F(NcChannel, PrefersTheCyclesOfTheController) {
  class OwnCycle : public MapEnvironment {
   public:
    tl::expected<std::string, Fault> load(std::string_view /*program*/) override {
      return "#MSG [\"own\"]\nM17\n";
    }
  } own;
  Channel sut;
  start(sut, "L CYCLE [NAME=\"SysServiceWait.cyc\"]\nM30\n");
  const auto events = sut.tick(0s, own);
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(std::get<MessageEvent>(events.front()).text, "own");
}

// An operator may correct it while no program runs.
TEST_F(NcChannel, RunsASubprogramAsItIsWhenItsRunBegins) {
  class Corrected : public MapEnvironment {
   public:
    tl::expected<std::string, Fault> load(std::string_view /*program*/) override { return text; }
    std::string text;
  } programs;
  Channel sut;
  std::vector<std::string> texts;
  for (const char* text : {"before", "after"}) {
    programs.text = "#MSG [\"" + std::string(text) + "\"]\nM17\n";
    start(sut, "L CYCLE [NAME=\"part.cyc\"]\nM30\n");
    for (int i = 0; i < 3; ++i) {
      for (const Event& event : sut.tick(now_ += 1s, programs)) {
        if (const auto* message = std::get_if<MessageEvent>(&event)) {
          texts.push_back(message->text);
        }
      }
    }
  }
  EXPECT_EQ(texts, (Texts{"before", "after"}));
}

}  // namespace
}  // namespace millrace::cnc::nc::test

namespace millrace::cnc::nc::run {
namespace {

// The writing side of a message queue: the position of the next message, and the order of the
// writes.
/// Records the writes, in their order.
class Notes final : public Environment {
 public:
  explicit Notes(long filled, long got) {
    values_["SD.C.LastFilled"] = static_cast<double>(filled);
    values_["SD.C.LastGet"] = static_cast<double>(got);
  }
  tl::expected<Value, Fault> read(std::string_view name) override {
    return values_.at(std::string(name));
  }
  tl::expected<void, Fault> write(std::string_view name, const Value& value) override {
    written.emplace_back(name);
    values_[std::string(name)] = value;
    return {};
  }
  std::size_t elements(std::string_view) override { return 3; }
  tl::expected<std::string, Fault> load(std::string_view) override { return std::string(); }

  std::vector<std::string> written;

 private:
  std::map<std::string, Value> values_;
};

using Names = std::vector<std::string>;

TEST(MessageQueue, WritesTheElementBeforeLastFilled) {
  Notes sut(1, 1);
  ASSERT_TRUE(carry_out(WriteMessage{"SD.Q", "SD.C", "text"}, sut));
  EXPECT_EQ(sut.written, (Names{"SD.Q[2]", "SD.C.LastFilled"}));
}

TEST(MessageQueue, WritesNothingWhereItIsFull) {
  Notes sut(3, 1);
  EXPECT_FALSE(carry_out(WriteMessage{"SD.Q", "SD.C", "text"}, sut));
  EXPECT_EQ(sut.written, Names{});
}

TEST(MessageQueue, HoldsOneMessageLessThanItHasElementsFromEveryIndexOn) {
  for (const long elements : {3L, 4L, 100L}) {
    for (long begin = 1; begin <= elements; ++begin) {
      QueueControl sut{begin, begin};
      for (long message = 1; message < elements; ++message) {
        const auto next = next_position(sut, elements);
        ASSERT_TRUE(next) << elements << ' ' << begin << ' ' << message;
        EXPECT_EQ(*next, (begin + message - 1) % elements + 1);
        sut.last_filled = *next;
      }
      EXPECT_FALSE(next_position(sut, elements)) << elements << ' ' << begin;
    }
  }
}

TEST(MessageQueue, HasNoPositionOutsideItsArray) {
  EXPECT_FALSE(next_position({0, 0}, 3));
  EXPECT_FALSE(next_position({4, 1}, 3));
  EXPECT_FALSE(next_position({1, -1}, 3));
  EXPECT_FALSE(next_position({1, 1}, 2));
  EXPECT_FALSE(next_position({1, 1}, 0));
}

}  // namespace
}  // namespace millrace::cnc::nc::run
