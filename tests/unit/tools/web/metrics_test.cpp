#include "tools/web/metrics/metrics.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::web::metrics {
namespace {

using recording::Change;
using recording::Entry;
using recording::InstanceNews;
using recording::tests::at;
using recording::tests::one_call;
using recording::tests::square_root;
using testing::HasSubstr;
using testing::Not;

fabric::InstanceId id(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

class TheMetrics : public testing::Test {
 protected:
  void add(const Entry& entry) { sut.add(entry, plant.add(entry, {})); }
  void add(const std::vector<Entry>& entries) {
    for (const Entry& entry : entries) {
      add(entry);
    }
  }
  void add_instance(Change change, const std::string& uuid = square_root) {
    InstanceNews news{.change = change, .identity = {.id = id(0x11)}};
    news.identity.uuid = uuid;
    news.identity.name = "sq1";
    add(Entry{.sample = news});
  }
  void add_channel(fabric::ChannelState state, const std::string& reason = "") {
    add(Entry{.sample = fabric::ChannelStatus{
                  .key = {"cnc", 1}, .state = state, .since = at(0), .reason = reason}});
  }
  [[nodiscard]] std::string text() const {
    return sut.text(plant, {.version = "1.2"}, {.steady = {}, .wall = at(0)});
  }

  plant::PlantModel plant{{}};
  Metrics sut;
};

TEST_F(TheMetrics, CountCallsByServiceMachineAndResult) {
  add(one_call(1, 0));
  std::vector<Entry> failed = one_call(2, 10);
  std::get<fabric::Reply>(failed[3].sample).code = fabric::ServiceCode::failed;
  add(failed);
  EXPECT_THAT(text(), HasSubstr("millrace_calls_total{service=\"" + square_root +
                                "\",machine=\"cnc\",result=\"answered\"} 1\n"));
  EXPECT_THAT(text(), HasSubstr("result=\"failed\"} 1\n"));
}

TEST_F(TheMetrics, SpreadTheTimesOfEachHopOverBuckets) {
  add(one_call(1, 0));
  EXPECT_THAT(text(), HasSubstr("# TYPE millrace_call_hop_duration_seconds histogram"));
  EXPECT_THAT(text(), HasSubstr("hop=\"total\",le=\"0.005\"} 0\n"));
  EXPECT_THAT(text(), HasSubstr("hop=\"total\",le=\"0.01\"} 1\n"));
  EXPECT_THAT(text(), HasSubstr("hop=\"total\",le=\"+Inf\"} 1\n"));
  EXPECT_THAT(text(), HasSubstr("hop=\"to_service\""));
}

TEST_F(TheMetrics, ShowTheStateOfAChannelAndWhatWaits) {
  add_channel(fabric::ChannelState::held);
  EXPECT_THAT(
      text(),
      HasSubstr("millrace_channel_state{machine=\"cnc\",channel=\"1\",state=\"held\"} 1\n"));
  EXPECT_THAT(text(), HasSubstr("state=\"link_down\"} 0\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_calls_waiting{machine=\"cnc\"} 1\n"));
  // Nothing is wrong: metrics are requested while the disk is busy.
  add_channel(fabric::ChannelState::waiting,
              "the journal has not confirmed new call numbers yet; the call waits for it");
}

TEST_F(TheMetrics, ShowWhetherALinkIsUp) {
  const fabric::MachineStatus up{.machine = "cnc",
                                 .gateway = id(1),
                                 .connected = true,
                                 .requests_per_second = 60,
                                 .host = "gw"};
  add(Entry{.sample = up});
  EXPECT_THAT(text(), HasSubstr("millrace_link_up{machine=\"cnc\"} 1\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_link_requests_per_second{machine=\"cnc\"} 60\n"));
  add(Entry{.sample = fabric::MachineStatus{.machine = "cnc", .gateway = id(1), .gone = true}});
  EXPECT_THAT(text(), HasSubstr("millrace_link_up{machine=\"cnc\"} 0\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_gateways{machine=\"cnc\"} 0\n"));
}

TEST_F(TheMetrics, ShowWhetherAControllerSendsNotifications) {
  fabric::MachineStatus machine;
  machine.machine = "cnc";
  machine.host = "host1";
  machine.connected = true;
  machine.watch = fabric::WatchMode::pushed;
  add(Entry{.sample = machine});
  EXPECT_THAT(text(), HasSubstr("millrace_link_pushed{machine=\"cnc\"} 1\n"));
  machine.watch = fabric::WatchMode::polled;
  add(Entry{.sample = machine});
  EXPECT_THAT(text(), HasSubstr("millrace_link_pushed{machine=\"cnc\"} 0\n"));
  machine.watch = fabric::WatchMode::partly_pushed;
  add(Entry{.sample = machine});
  EXPECT_THAT(text(), HasSubstr("millrace_link_pushed{machine=\"cnc\"} 0\n"));
}

TEST_F(TheMetrics, ShowAServiceWithoutInstances) {
  add_instance(Change::ready);
  const std::string line = "millrace_service_instances{service=\"" + square_root + "\"} ";
  EXPECT_THAT(text(), HasSubstr(line + "1\n"));
  add_instance(Change::gone);
  EXPECT_THAT(text(), HasSubstr(line + "0\n"));
}

TEST_F(TheMetrics, HaveNoMoreSeriesThanTheyHaveRoomFor) {
  for (int i = 0; i < 1000; ++i) {
    std::vector<Entry> entries = one_call(static_cast<std::uint64_t>(i) + 1, i);
    for (Entry& entry : entries) {
      entry.uuid = "service " + std::to_string(i);
      if (auto* event = std::get_if<fabric::Event>(&entry.sample)) {
        event->uuid = entry.uuid;
        event->key.machine = "machine " + std::to_string(i);
      }
    }
    add(entries);
  }
  const std::string all = text();
  std::size_t lines = 0;
  for (std::size_t at = all.find("\nmillrace_calls_total{"); at != std::string::npos;
       at = all.find("\nmillrace_calls_total{", at + 1)) {
    ++lines;
  }
  // Four results each.
  EXPECT_LE(lines, 4 * (Metrics::most_services + 1));
  EXPECT_THAT(all, HasSubstr("{service=\"other\",machine=\"other\",result=\"answered\"} 800\n"));
  EXPECT_THAT(all, Not(HasSubstr("service 900")));
}

TEST_F(TheMetrics, ShowALimitedNumberOfChannels) {
  for (std::size_t channel = 1; channel <= most_channels + 1; ++channel) {
    add(Entry{.sample = fabric::ChannelStatus{.key = {"cnc", static_cast<std::uint16_t>(channel)},
                                              .since = at(0)}});
  }
  const std::string all = text();
  EXPECT_THAT(all, HasSubstr(fmt::format("millrace_channel_state{{machine=\"cnc\",channel=\"{}\"",
                                         most_channels)));
  EXPECT_THAT(all, Not(HasSubstr(fmt::format("channel=\"{}\"", most_channels + 1))));
}

TEST_F(TheMetrics, KeepForeignNamesInTheirQuotes) {
  std::vector<Entry> entries = one_call(1, 0);
  for (Entry& entry : entries) {
    if (auto* event = std::get_if<fabric::Event>(&entry.sample)) {
      event->key.machine = "a\"} 1\nup{x=\"\xe4";
    }
  }
  add(entries);
  EXPECT_THAT(text(), HasSubstr("machine=\"a\\\"} 1\\nup{x=\\\"ä\""));
}

TEST_F(TheMetrics, ShowTheAlarmsOfProcesses) {
  fabric::Alarm alarm{.key = {id(0x11), "gauge", "G1"},
                      .text = "it is silent",
                      .program = "dial_gauge",
                      .host = "press"};
  add(Entry{.sample = recording::AlarmNews{.alarm = alarm}});
  EXPECT_THAT(text(),
              HasSubstr("millrace_alarm{program=\"dial_gauge\",host=\"press\",kind=\"gauge\","
                        "subject=\"G1\",level=\"problem\"} 1\n"));
  add(Entry{.sample = recording::AlarmNews{.over = true, .alarm = alarm}});
  EXPECT_THAT(text(), Not(HasSubstr("millrace_alarm{")));
}

TEST_F(TheMetrics, ShowNoControlCharactersOfOthers) {
  add(Entry{.sample =
                recording::AlarmNews{.alarm = {.key = {id(0x44), "gauge", "G1\x1b[2J\x7f\n"}}}});
  EXPECT_THAT(text(), HasSubstr("subject=\"G1\\\\x1b[2J\\\\x7f\\n\""));
}

TEST_F(TheMetrics, ShowWhatNeedsAttention) {
  add(Entry{.sample = fabric::MachineStatus{
                .machine = "cnc", .gateway = id(0x33), .connected = true, .host = "gw"}});
  EXPECT_THAT(text(), Not(HasSubstr("millrace_concern{")));
  const fabric::Alarm full{.key = {id(0x33), "journal", ""}, .text = "disk full"};
  add(Entry{.sample = recording::AlarmNews{.alarm = full}});
  EXPECT_THAT(text(), HasSubstr("millrace_concern{kind=\"journal\",level=\"act\",who=\"engineer\","
                                "subject=\"cnc\",what=\"journal not writable\"} 1\n"));
  add(Entry{.sample = recording::AlarmNews{.over = true, .alarm = full}});
  EXPECT_THAT(text(), Not(HasSubstr("millrace_concern{")));
}

TEST_F(TheMetrics, CountEndedProgramsButNotEarlierOrReplayedOnes) {
  using fabric::ProgramEventKind;
  const auto tell = [this](ProgramEventKind kind, double ms, bool replayed = false) {
    add(Entry{.at = at(20'000),
              .sample = fabric::ProgramEvent{
                  .key = {"press", 1}, .kind = kind, .at = at(ms), .replayed = replayed}});
  };
  tell(ProgramEventKind::ended, 0);
  EXPECT_THAT(text(), HasSubstr("millrace_programs_total{machine=\"press\",channel=\"1\","
                                "result=\"ended\"} 0\n"));
  tell(ProgramEventKind::started, 19'000);
  tell(ProgramEventKind::aborted, 19'500);
  tell(ProgramEventKind::aborted, 19'500, true);
  EXPECT_THAT(text(), HasSubstr("channel=\"1\",result=\"aborted\"} 1\n"));
  // The next gateway finds the error, and the operator clears it.
  tell(ProgramEventKind::aborted, 19'600);
  tell(ProgramEventKind::reset, 19'700);
  EXPECT_THAT(text(), HasSubstr("channel=\"1\",result=\"aborted\"} 1\n"));
  EXPECT_THAT(text(), HasSubstr("channel=\"1\",result=\"reset\"} 0\n"));
}

TEST_F(TheMetrics, CountProgramsOfNoMoreChannelsThanTheyHaveRoomFor) {
  for (std::uint16_t channel = 1; channel <= 1000; ++channel) {
    add(Entry{
        .at = at(0),
        .sample = fabric::ProgramEvent{
            .key = {"press", channel}, .kind = fabric::ProgramEventKind::ended, .at = at(0)}});
  }
  EXPECT_THAT(text(), HasSubstr("machine=\"other\",channel=\"other\",result=\"ended\"} "));
  EXPECT_THAT(text(), Not(HasSubstr("channel=\"999\"")));
}

fabric::DataSample queue_of(const std::string& machine, std::int64_t filled, std::int64_t got) {
  const auto number = [](const char* name, std::int64_t value) {
    return fabric::Value{.name = name, .elements = std::vector<std::int64_t>{value}};
  };
  return {.key = {machine, 1},
          .group = "queue",
          .values = {number("last_filled", filled), number("last_get", got), number("elements", 5),
                     number("messages", 7), number("answered", 4), number("waiting", 3)}};
}

TEST_F(TheMetrics, ShowHowFarMessageQueuesAreFilledReadAndAnswered) {
  add(Entry{.at = at(0), .sample = queue_of("press.ALARMS", 1, 4)});
  const std::string labels = "{machine=\"press\",queue=\"ALARMS\",channel=\"1\"} ";
  EXPECT_THAT(text(), HasSubstr("millrace_queue_filled_messages" + labels + "2\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_queue_capacity_messages" + labels + "4\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_queue_waiting_messages" + labels + "3\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_queue_messages_total" + labels + "7\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_queue_answered_messages_total" + labels + "4\n"));
}

TEST_F(TheMetrics, HideHowFarAQueueWasFilledWhenItsControllerDoesNotAnswer) {
  auto sample = queue_of("press.ALARMS", 1, 4);
  sample.values.front().quality = fabric::Quality::stale;
  add(Entry{.at = at(0), .sample = sample});
  EXPECT_THAT(text(), Not(HasSubstr("millrace_queue_filled_messages")));
  EXPECT_THAT(text(), HasSubstr("millrace_queue_waiting_messages"));
}

TEST_F(TheMetrics, HideAQueueWhoseGatewayIsGone) {
  add(Entry{.at = at(0), .sample = fabric::MachineStatus{.machine = "press", .host = "hall"}});
  add(Entry{.at = at(0), .sample = queue_of("press.ALARMS", 1, 4)});
  ASSERT_THAT(text(), HasSubstr("millrace_queue_waiting_messages"));
  add(Entry{.at = at(1), .sample = fabric::MachineStatus{.machine = "press", .gone = true}});
  EXPECT_THAT(text(), Not(HasSubstr("millrace_queue_waiting_messages")));
}

TEST_F(TheMetrics, HideAnImpossibleQueue) {
  add(Entry{.at = at(0), .sample = queue_of("press.ALARMS", 9, 4)});
  add(Entry{.at = at(0), .sample = queue_of("press.NO", 1, 4)});
  add(Entry{.at = at(0), .sample = fabric::DataSample{.key = {"press.NO", 1}, .group = "queue"}});
  add(Entry{.at = at(0), .sample = queue_of("press", 1, 4)});
  EXPECT_THAT(text(), Not(HasSubstr("millrace_queue_filled_messages")));
}

TEST_F(TheMetrics, CountValuesByQuality) {
  add(Entry{.at = at(0),
            .sample = fabric::DataSample{
                .key = {"press", 1},
                .group = "axes",
                .at = at(0),
                .values = {{.name = "X"}, {.name = "Y", .quality = fabric::Quality::refused}}}});
  EXPECT_THAT(text(), HasSubstr("millrace_data_values{machine=\"press\",quality=\"refused\"} 1\n"));
  EXPECT_THAT(text(), HasSubstr("millrace_data_values{machine=\"press\",quality=\"stale\"} 0\n"));
}

}  // namespace
}  // namespace millrace::tools::web::metrics
