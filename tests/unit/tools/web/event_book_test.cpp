#include "tools/web/plant/event_book.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::web::plant {
namespace {

using fabric::ChannelState;
using recording::Change;
using recording::Entry;
using recording::tests::at;
using recording::tests::square_root;
using testing::ElementsAre;
using testing::IsEmpty;

fabric::InstanceId id_of(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

class AnEventBook : public testing::Test {
 protected:
  void tell(recording::Sample sample, double ms = 0) {
    const Entry entry{.at = at(ms), .sample = std::move(sample)};
    if (auto event = fabric::plant::event_of(entry, live_)) {
      sut.add(std::move(*event));
    }
    live_.add(entry);
  }
  void tell_instance(Change change, std::uint8_t byte, double ms = 0) {
    recording::InstanceNews news{.change = change, .identity = {.id = id_of(byte)}};
    if (!fabric::observer::is_absent(change)) {
      news.identity.uuid = square_root;
      news.identity.name = "sq";
      news.identity.host = "hall";
      news.identity.pid = 7U + byte;
    }
    tell(news, ms);
  }
  void tell_machine(const std::string& machine, const std::string& host, bool connected, double ms,
                    std::uint8_t gateway = 9) {
    tell(fabric::MachineStatus{.machine = machine,
                               .gateway = id_of(gateway),
                               .connected = connected,
                               .since = at(ms),
                               .reason = connected ? "" : "refused",
                               .host = host,
                               .pid = host.empty() ? 0U : 42U,
                               .gone = host.empty()},
         ms);
  }
  void tell_channel(ChannelState state, const fabric::Message& reason, double ms) {
    tell(fabric::ChannelStatus{.key = {"cnc", 1},
                               .state = state,
                               .since = at(ms),
                               .call = {0x5f, 17},
                               .uuid = square_root,
                               .reason = reason});
  }
  [[nodiscard]] std::vector<std::string> kinds() const {
    std::vector<std::string> out;
    for (const auto& event : sut.list(100)) {
      out.emplace_back(event.at("kind").as_string());
    }
    return out;
  }
  [[nodiscard]] boost::json::object newest() const { return sut.list(1).at(0).as_object(); }

  EventBook sut;

 private:
  fabric::plant::Plant live_;
};

TEST_F(AnEventBook, NamesAnInstanceThatEndedAndWhetherItWasTheLast) {
  tell_instance(Change::ready, 1);
  tell_instance(Change::ready, 2);
  tell_instance(Change::gone, 1, 100);
  EXPECT_FALSE(newest().contains("last"));
  tell_instance(Change::gone, 2, 200);
  EXPECT_THAT(kinds(), ElementsAre("instance ended", "instance ended"));
  EXPECT_EQ(newest().at("name"), "sq");
  EXPECT_EQ(newest().at("host"), "hall");
  EXPECT_EQ(newest().at("pid"), 9);
  EXPECT_EQ(newest().at("last"), true);
}

TEST_F(AnEventBook, NamesAnInstanceThatFellSilentAndWhatBecameOfIt) {
  tell_instance(Change::ready, 1);
  tell_instance(Change::silent, 1, 100);
  EXPECT_EQ(newest().at("last"), true);
  tell_instance(Change::ready, 1, 200);
  tell_instance(Change::silent, 1, 300);
  tell_instance(Change::gone, 1, 400);
  tell_instance(Change::gone, 1, 500);
  EXPECT_THAT(kinds(), ElementsAre("instance ended", "instance silent", "instance responds",
                                   "instance silent"));
  EXPECT_EQ(newest().at("name"), "sq");
}

TEST_F(AnEventBook, NamesAMachineThatWasRemoved) {
  tell_machine("cnc", "gw", true, 0);
  tell(fabric::MachineStatus{.machine = "cnc",
                             .gateway = id_of(9),
                             .since = at(1000),
                             .reason = base::messages::machine_removed(),
                             .gone = true},
       1000);
  EXPECT_THAT(kinds(), ElementsAre("machine removed"));
  EXPECT_EQ(newest().at("host"), "gw");
}

TEST_F(AnEventBook, NamesAGatewayThatFellSilentAndWhatBecameOfIt) {
  const auto tell_gone = [&](const fabric::Message& reason, int ms) {
    tell(
        fabric::MachineStatus{
            .machine = "cnc", .gateway = id_of(9), .since = at(ms), .reason = reason, .gone = true},
        ms);
  };
  tell_machine("cnc", "gw", true, 0);
  tell_gone(base::messages::gateway_not_responding(), 1000);
  tell_machine("cnc", "gw", true, 2000);
  tell_gone(base::messages::gateway_not_responding(), 3000);
  tell_gone(base::messages::gateway_gone(), 4000);
  EXPECT_THAT(kinds(),
              ElementsAre("gateway gone", "gateway silent", "gateway responds", "gateway silent"));
  EXPECT_EQ(newest().at("host"), "gw");
}

TEST_F(AnEventBook, NamesAProcessThatIsGoneWithoutAWord) {
  const fabric::Alarm runs{.key = {id_of(3), "recording"},
                           .level = fabric::AlarmLevel::fine,
                           .program = "millrace record",
                           .host = "vm",
                           .pid = 7};
  tell(recording::AlarmNews{.alarm = runs}, 0);
  tell(recording::AlarmNews{.over = true, .alarm = {.key = runs.key}, .lost = true}, 1000);
  EXPECT_THAT(kinds(), ElementsAre("process gone"));
  EXPECT_EQ(newest().at("name"), "millrace record");
}

TEST_F(AnEventBook, UsesTheStartTimeOfTheInstance) {
  tell_instance(Change::ready, 1, 5000);
  EXPECT_THAT(kinds(), IsEmpty());
  tell(fabric::InstanceStatus{.instance = id_of(1), .started = at(1000)}, 5000);
  tell(fabric::InstanceStatus{.instance = id_of(1), .started = at(1000)}, 6000);
  EXPECT_THAT(kinds(), ElementsAre("instance started"));
  EXPECT_EQ(newest().at("time"), "2026-03-01T07:00:01.000000Z");
}

TEST_F(AnEventBook, HasOneEventForAllMachinesOfAGateway) {
  tell_machine("cnc", "gw", true, 0);
  tell_machine("press", "gw", true, 0);
  EXPECT_THAT(kinds(), IsEmpty()) << "they existed before the observation began";
  tell_machine("cnc", "", false, 1000);
  tell_machine("press", "", false, 1100);
  EXPECT_THAT(kinds(), ElementsAre("gateway gone"));
  EXPECT_EQ(newest().at("machines"), boost::json::array({"cnc", "press"}));
  EXPECT_EQ(newest().at("host"), "gw");
  EXPECT_EQ(newest().at("pid"), 42);
  tell_machine("cnc", "gw", true, 5000, 10);
  EXPECT_THAT(kinds(), ElementsAre("gateway started", "gateway gone"));
}

TEST_F(AnEventBook, ShowsWhyALinkIsDownAndWhenItIsUpAgain) {
  tell_machine("cnc", "gw", true, 0);
  tell_machine("cnc", "gw", false, 1000);
  EXPECT_EQ(newest().at("text"), "refused");
  tell_machine("cnc", "gw", false, 1000);
  tell_machine("cnc", "gw", true, 2000);
  EXPECT_THAT(kinds(), ElementsAre("link up", "link down"));
}

TEST_F(AnEventBook, HasNoEventOfALinkThatAGatewayMakesWhenItStarts) {
  tell_machine("cnc", "gw", false, 0);
  tell_machine("cnc", "gw", true, 100);
  EXPECT_THAT(kinds(), IsEmpty()) << "the observation began with the gateway";
  tell_machine("cnc", "", false, 1000);
  tell_machine("cnc", "gw", false, 5000, 10);
  tell_machine("cnc", "gw", true, 5100, 10);
  EXPECT_THAT(kinds(), ElementsAre("gateway started", "gateway gone"));
  tell_machine("cnc", "gw", false, 9000, 10);
  tell_machine("cnc", "gw", true, 9900, 10);
  EXPECT_THAT(kinds(), ElementsAre("link up", "link down", "gateway started", "gateway gone"));
}

TEST_F(AnEventBook, ReportsNoMissingLinkOfAStandbyGateway) {
  tell_machine("cnc", "gw", true, 0);
  tell_machine("cnc", "other", false, 1000, 10);
  EXPECT_THAT(kinds(), testing::Not(testing::Contains("link down")));
}

TEST_F(AnEventBook, ShowsWhichOperatorAnsweredOrRetriedABlockedCall) {
  tell_channel(ChannelState::running, "", 0);
  tell_channel(ChannelState::held, "sq1 is lost", 1000);
  tell_channel(ChannelState::held, "sq1 is lost", 1000);
  EXPECT_EQ(newest().at("call"), "5f-17");
  EXPECT_EQ(newest().at("text"), "sq1 is lost");
  tell_channel(ChannelState::waiting, base::messages::dispatched_again("anna@hall/web"), 2000);
  EXPECT_EQ(newest().at("text"), "anna@hall/web");
  fabric::Event event{
      .key = {"cnc", 1}, .call = {0x5f, 17}, .kind = fabric::EventKind::replied, .at = at(3000)};
  event.detail = base::messages::answered_by("bert@hall/web");
  tell(event);
  tell(event);
  EXPECT_THAT(kinds(), ElementsAre("call answered", "call retried", "call held"));
  EXPECT_EQ(newest().at("text"), "bert@hall/web");
}

TEST_F(AnEventBook, CountsAnAbortedProgramOnce) {
  const fabric::ProgramEvent aborted{.key = {"cnc", 1},
                                     .kind = fabric::ProgramEventKind::aborted,
                                     .at = at(100),
                                     .program = "good.nc",
                                     .error = 455};
  tell(aborted);
  tell(aborted, 5000);
  fabric::ProgramEvent replayed = aborted;
  replayed.at = at(200);
  replayed.replayed = true;
  tell(replayed);
  EXPECT_THAT(kinds(), ElementsAre("program aborted"));
  EXPECT_EQ(newest().at("name"), "good.nc");
  EXPECT_EQ(newest().at("error"), 455);
}

TEST_F(AnEventBook, ShowsAnAlarmAndItsEnd) {
  recording::AlarmNews news{
      .alarm = {
          .key = {.kind = "archive"}, .text = "disk full", .since = at(0), .program = "archiver"}};
  tell(news);
  tell(news, 1000);
  news.over = true;
  tell(news, 2000);
  EXPECT_THAT(kinds(), ElementsAre("problem over", "problem"));
  EXPECT_EQ(newest().at("text"), "disk full");
}

TEST_F(AnEventBook, ReportsEachEventOnceAndAgainWhenItHasChanged) {
  tell_machine("cnc", "gw", true, 0);
  tell_machine("press", "gw", true, 0);
  tell_machine("cnc", "", false, 1000);
  EXPECT_EQ(sut.take().size(), 1);
  EXPECT_FALSE(sut.has_news());
  tell_machine("press", "", false, 1100);
  EXPECT_EQ(sut.take().at(0).at("number"), 1);
}

TEST_F(AnEventBook, ForgetsTheOldest) {
  for (std::size_t i = 0; i < EventBook::most_events + 5; ++i) {
    tell(fabric::ProgramEvent{.key = {"cnc", 1},
                              .kind = fabric::ProgramEventKind::aborted,
                              .at = at(static_cast<double>(i)),
                              .error = static_cast<std::uint32_t>(i)});
  }
  EXPECT_EQ(sut.list(1000).size(), EventBook::most_events);
  EXPECT_EQ(sut.take().size(), EventBook::most_events);
}

}  // namespace
}  // namespace millrace::tools::web::plant
