#include "gateway/core/machine_values.hpp"

#include <gmock/gmock.h>

#include "tests/unit/gateway/ports.hpp"

namespace millrace::gateway::core {
namespace {

using fabric::Quality;
using machines::Requester;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// Keeps the requests.
class AskedLink final : public SilentLink {
 public:
  using SilentLink::ask;
  void ask(const machines::Question& question) override { questions.push_back(question); }

  std::vector<machines::Question> questions;
};

/// The variable V.E.A of press/1 is an SGN32 number, as the test answers for the controller.
class AMachinesValues : public testing::Test {
 protected:
  AMachinesValues() { settings.variables.writable = {{"V.E.*"}}; }

  void sample() {
    settings.data = {.groups = {{.name = "all", .names = {"V.E.A"}, .period = 20ms}},
                     .requests_per_second = 1000};
    begin();
  }
  void begin() {
    sut.set(settings, ports.time);
    sut.on_up({1}, ports.time);
    pump();
  }
  void pump() { sut.pump(&link, rests_since, ports.time); }
  void pass(std::chrono::nanoseconds time) {
    ports.time.steady += time;
    if (sut.is_due(ports.time)) {
      pump();
    }
  }

  void request(fabric::VariableAction action, std::uint16_t channel = 1) {
    fabric::VariableRequest request{.requester = gateway_id(3),
                                    .token = gateway_id(++tokens),
                                    .key = {"press", channel},
                                    .action = action,
                                    .names = {"V.E.A"}};
    if (action == fabric::VariableAction::write) {
      request.values = {{"7"}};
    } else if (action == fabric::VariableAction::list) {
      request.names = {"V.E"};
    }
    sut.on_request(request, ports.time);
    pump();
  }
  /// Answers the oldest question.
  void answer() {
    ASSERT_THAT(link.questions, testing::Not(IsEmpty()));
    const machines::Question question = link.questions.front();
    link.questions.erase(link.questions.begin());
    answer(question);
  }
  void answer(const machines::Question& question) {
    machines::Answer result;
    result.requester = question.requester;
    result.number = question.number;
    result.requests = 1;
    if (std::holds_alternative<data::Resolve>(question.step)) {
      cnc::variables::Reading reading;
      reading.length = 4;
      reading.size = 4;
      reading.type = {cnc::variables::Type::sgn32, 4};
      reading.access = cnc::variables::Access::read_write;
      result.found = std::vector<data::Sampler::Resolved>{reading};
    } else if (std::holds_alternative<data::Read>(question.step)) {
      result.found = std::vector<data::Sampler::Answer>{value};
    } else if (std::holds_alternative<variables::WriteOne>(question.step)) {
      result.found = cnc::ads::Result<void>{};
    } else {
      result.found = cnc::ads::Result<variables::Page>(variables::Page{70, {}});
    }
    sut.on_answer(result, ports.time);
    if (sut.is_due(ports.time)) {
      pump();
    }
  }
  std::vector<std::string> reasons() const {
    std::vector<std::string> all;
    for (const auto& reply : ports.replies) {
      all.push_back(reply.reason);
    }
    return all;
  }

  RecordedPorts ports;
  AskedLink link;
  settings::MachineSettings settings;
  std::optional<SteadyTime> rests_since = SteadyTime{};
  cnc::variables::Bytes value{5, 0, 0, 0};
  std::uint8_t tokens = 0;
  MachineValues sut{"press", ports, ports, gateway_id(5)};
};

TEST_F(AMachinesValues, AreSampledOverItsLink) {
  sample();
  answer();
  answer();
  ASSERT_THAT(ports.samples, SizeIs(1));
  EXPECT_EQ(ports.samples[0].values[0].elements, fabric::Elements(std::vector<std::int64_t>{5}));
  EXPECT_THAT(link.questions, IsEmpty());
  pass(20ms);
  EXPECT_THAT(link.questions, SizeIs(1));
}

TEST_F(AMachinesValues, GiveWayWhileACallIsUnderWayAndAMomentLonger) {
  rests_since.reset();
  sample();
  pass(10ms);
  EXPECT_THAT(link.questions, IsEmpty());
  rests_since = ports.time.steady;
  pass(999us);
  EXPECT_THAT(link.questions, IsEmpty());
  pass(1us);
  EXPECT_THAT(link.questions, SizeIs(1));
}

TEST_F(AMachinesValues, DoNotWaitForEverForABusyLink) {
  rests_since.reset();
  sample();
  request(fabric::VariableAction::read);
  pass(25ms - 1us);
  EXPECT_THAT(link.questions, IsEmpty());
  pass(1us);
  ASSERT_THAT(link.questions, SizeIs(1));
  EXPECT_EQ(link.questions[0].requester, Requester::variables);
  pass(25ms - 1us);
  EXPECT_THAT(link.questions, SizeIs(1));
  pass(1us);
  ASSERT_THAT(link.questions, SizeIs(2));
  EXPECT_EQ(link.questions[1].requester, Requester::data);
}

TEST_F(AMachinesValues, WakeWhenTheLinkHasBeenIdleLongEnough) {
  rests_since.reset();
  sample();
  EXPECT_EQ(sut.next_time(), ports.time.steady + 50ms);
  rests_since = ports.time.steady;
  ASSERT_TRUE(sut.is_due(ports.time)) << "the link is idle since then";
  pump();
  EXPECT_EQ(sut.next_time(), ports.time.steady + 1ms);
}

TEST_F(AMachinesValues, AreStaleWithoutTheLinkAndRetractedWhenAnotherGatewayHasTheChannel) {
  sample();
  answer();
  answer();
  sut.on_down("the cable is out", ports.time);
  pump();
  EXPECT_EQ(ports.samples.back().values[0].quality, Quality::stale);
  EXPECT_EQ(ports.samples.back().values[0].reason, "the link is down");
  sut.on_over(1, ports.time);
  pump();
  EXPECT_THAT(ports.disposed, ElementsAre("all"));
}

TEST_F(AMachinesValues, AreRequestedAgainOverANewLink) {
  sample();
  const machines::Question before = link.questions.at(0);
  sut.on_down("the cable is out", ports.time);
  pump();
  link.questions.clear();
  sut.on_up({1}, ports.time);
  pass(1s);
  ASSERT_THAT(link.questions, SizeIs(1));
  answer(before);
  EXPECT_THAT(link.questions, SizeIs(1)) << "an answer from the previous link is ignored";
  answer();
  answer();
  EXPECT_EQ(ports.samples.back().values[0].quality, Quality::good);
}

TEST_F(AMachinesValues, OfARemovedGroupAreRetracted) {
  sample();
  answer();
  answer();
  settings.data.groups[0].name = "other";
  sut.set(settings, ports.time);
  pump();
  EXPECT_THAT(ports.disposed, ElementsAre("all"));
  answer();
  answer();
  EXPECT_EQ(ports.samples.back().group, "other");
}

TEST_F(AMachinesValues, OfAProgramArePublishedAsProgramEvents) {
  settings.programs = {{.channel = 1}};
  begin();
  ASSERT_THAT(link.questions, SizeIs(1));
  const auto& names = std::get<data::Resolve>(link.questions[0].step).names;
  ASSERT_THAT(names, ElementsAre("state", "mode"));
  cnc::variables::Reading reading;
  reading.length = reading.size = 4;
  reading.type = {cnc::variables::Type::uns32, 4};
  const std::uint64_t number = std::exchange(link.questions, {}).front().number;
  sut.on_answer({.number = number, .found = std::vector<data::Sampler::Resolved>{reading, reading}},
                ports.time);
  pump();
  ASSERT_THAT(link.questions, SizeIs(1));
  constexpr std::uint8_t active = 4;
  const cnc::variables::Bytes state{active, 0, 0, 0};
  sut.on_answer({.number = link.questions[0].number,
                 .found = std::vector<data::Sampler::Answer>{state, value}},
                ports.time);
  pump();
  ASSERT_THAT(ports.programs, SizeIs(1));
  EXPECT_EQ(ports.programs[0].kind, fabric::ProgramEventKind::started);
  EXPECT_THAT(ports.samples, IsEmpty());
  EXPECT_THAT(ports.log_lines, ElementsAre(HasSubstr("press/1: program started")));
  sut.on_over(1, ports.time);
  pump();
  EXPECT_THAT(ports.disposed, IsEmpty());
}

TEST_F(AMachinesValues, AreReadOnRequest) {
  begin();
  request(fabric::VariableAction::read);
  answer();
  answer();
  ASSERT_THAT(ports.replies, SizeIs(1));
  EXPECT_TRUE(ports.replies[0].done) << ports.replies[0].reason.text;
}

TEST_F(AMachinesValues, AreWrittenOnRequestAndReportedToRecorders) {
  begin();
  request(fabric::VariableAction::write);
  while (!link.questions.empty()) {
    if (std::holds_alternative<variables::WriteOne>(link.questions[0].step)) {
      value = {7, 0, 0, 0};
    }
    answer();
    pass(10ms);
  }
  ASSERT_THAT(ports.replies, SizeIs(1));
  EXPECT_TRUE(ports.replies[0].done) << ports.replies[0].reason.text;
  ASSERT_THAT(ports.outcomes, testing::Not(IsEmpty()));
  EXPECT_EQ(ports.outcomes[0].responder, gateway_id(5));
  EXPECT_EQ(ports.outcomes[0].command, gateway_id(1));
  EXPECT_THAT(ports.outcomes[0].detail, HasSubstr("V.E.A was 5, is written as 7"));
}

TEST_F(AMachinesValues, AreListedOnRequest) {
  begin();
  request(fabric::VariableAction::list);
  answer();
  ASSERT_THAT(ports.replies, SizeIs(1));
  EXPECT_EQ(ports.replies[0].total, 70U);
}

TEST_F(AMachinesValues, OfAChannelOfAnotherGatewayAreLeftToIt) {
  begin();
  request(fabric::VariableAction::read, 2);
  EXPECT_THAT(ports.replies, IsEmpty());
  sut.on_dropped(ports.time);
  request(fabric::VariableAction::read);
  EXPECT_THAT(ports.replies, IsEmpty());
  EXPECT_THAT(link.questions, IsEmpty());
}

TEST_F(AMachinesValues, ReportThatTheLinkIsDownAlsoWhereItNeverWasUp) {
  sut.set(settings, ports.time);
  request(fabric::VariableAction::read);
  EXPECT_THAT(ports.replies, IsEmpty()) << "the owner of the machine is not known yet";
  sut.on_down("no route to host", ports.time);
  request(fabric::VariableAction::read);
  EXPECT_THAT(reasons(), ElementsAre("the link to press is down: no route to host"));
  sut.on_up({1}, ports.time);
  sut.on_down("the cable is out", ports.time);
  request(fabric::VariableAction::read);
  EXPECT_THAT(reasons().back(), HasSubstr("the cable is out"));
}

TEST_F(AMachinesValues, AreGivenUpAfterTheTimeoutOfTheRequest) {
  begin();
  rests_since.reset();
  fabric::VariableRequest request{
      .token = gateway_id(9), .key = {"press", 1}, .names = {"V.E.A"}, .patience = 10ms};
  sut.on_request(request, ports.time);
  pump();
  EXPECT_THAT(reasons(), IsEmpty());
  pass(10ms);
  EXPECT_THAT(reasons(), ElementsAre(HasSubstr("could not be asked within 10 ms")));
}

}  // namespace
}  // namespace millrace::gateway::core
