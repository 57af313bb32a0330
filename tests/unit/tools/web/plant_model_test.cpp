#include "tools/web/plant/plant_model.hpp"

#include <algorithm>

#include <boost/json/serialize.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::web::plant {
namespace {

using recording::Change;
using recording::Entry;
using recording::InstanceNews;
using recording::tests::at;
using recording::tests::one_call;
using recording::tests::square_root;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

fabric::InstanceId id(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

Entry instance(Change change, std::uint8_t byte = 0x11) {
  InstanceNews news{.change = change, .identity = {.id = id(byte)}};
  news.identity.uuid = square_root;
  news.identity.name = "sq1";
  news.identity.host = "hall";
  return {.at = at(0), .sample = news};
}

Entry channel(fabric::ChannelState state, std::uint64_t call = 0) {
  fabric::ChannelStatus status{.key = {"cnc", 1}, .state = state, .since = at(0)};
  if (call != 0) {
    status.call = {0x5f, call};
    status.uuid = square_root;
    status.instance = id(0x11);
  }
  return {.at = at(0), .sample = status};
}

Entry machine(std::uint8_t gateway, const std::string& host, bool connected = true) {
  return {.at = at(0),
          .sample = fabric::MachineStatus{.machine = "cnc",
                                          .gateway = id(gateway),
                                          .connected = connected,
                                          .host = host,
                                          .gone = host.empty()}};
}

class APlantModel : public testing::Test {
 protected:
  fabric::Moment after(double milliseconds) const {
    return {start_ + std::chrono::microseconds(static_cast<std::int64_t>(milliseconds * 1000)),
            at(milliseconds)};
  }
  void add(const std::vector<Entry>& entries, double milliseconds = 0) {
    for (const Entry& entry : entries) {
      sut.add(entry, after(milliseconds));
    }
  }
  /// The first object of a list.
  static boost::json::object first(const boost::json::object& object, const char* list) {
    return object.at(list).as_array().at(0).as_object();
  }

  PlantModel sut{{.version = "1", .fabric = "hall-3", .actions = true}};

 private:
  fabric::SteadyTime start_ = std::chrono::steady_clock::now();
};

TEST_F(APlantModel, IsSentWholeToANewReader) {
  add({machine(1, "gw"), channel(fabric::ChannelState::idle), instance(Change::ready)});
  add(one_call(17, 0));
  const boost::json::object snapshot = sut.snapshot(after(10));
  EXPECT_EQ(snapshot.at("about").at("fabric"), "hall-3");
  EXPECT_EQ(first(snapshot, "machines").at("gateway_host"), "gw");
  EXPECT_EQ(first(snapshot, "channels").at("channel_state"), "idle");
  EXPECT_EQ(first(snapshot, "services").at("name"), "sq1");
  EXPECT_EQ(first(snapshot, "calls").at("call"), "5f-17");
  EXPECT_EQ(first(snapshot, "calls").at("service"), "sq1");
  EXPECT_EQ(snapshot.at("totals").at("calls"), 1);
}

TEST_F(APlantModel, SendsEachChangeOnce) {
  add({machine(1, "gw"), channel(fabric::ChannelState::idle), instance(Change::ready)});
  const auto first_changes = sut.changes(after(250));
  ASSERT_TRUE(first_changes);
  EXPECT_THAT(first_changes->at("machines").as_array(), SizeIs(1));
  EXPECT_THAT(first_changes->at("channels").as_array(), SizeIs(1));
  EXPECT_THAT(first_changes->at("services").as_array(), SizeIs(1));
  EXPECT_EQ(sut.changes(after(500)), std::nullopt);
}

TEST_F(APlantModel, SendsASignOfLifeWhenNothingChanges) {
  ASSERT_TRUE(sut.changes(after(0)));
  EXPECT_FALSE(sut.changes(after(1999)));
  const auto beat = sut.changes(after(2000));
  ASSERT_TRUE(beat);
  EXPECT_TRUE(beat->contains("time"));
  EXPECT_FALSE(beat->contains("channels"));
}

TEST_F(APlantModel, SendsAProblemOfAChannelAtOnceAndARunningChannelNowAndThen) {
  add({channel(fabric::ChannelState::idle)});
  ASSERT_TRUE(sut.changes(after(0)));
  add({channel(fabric::ChannelState::running, 1)});
  EXPECT_FALSE(sut.changes(after(250)));
  add({channel(fabric::ChannelState::held, 1)});
  const auto held = sut.changes(after(300));
  ASSERT_TRUE(held);
  EXPECT_EQ(first(*held, "channels").at("channel_state"), "held");
  add({channel(fabric::ChannelState::idle)});
  EXPECT_FALSE(sut.changes(after(500)));
  const auto later = sut.changes(after(800));
  ASSERT_TRUE(later);
  EXPECT_EQ(first(*later, "channels").at("channel_state"), "idle");
}

TEST_F(APlantModel, ShowsRequestAndInstanceOfTheCallUnderWay) {
  add({machine(1, "gw"), instance(Change::ready), channel(fabric::ChannelState::running, 17)});
  const auto entries = one_call(17, 0);
  add({entries[0], entries[1], entries[2]});
  const boost::json::object channel_json = first(sut.snapshot(after(10)), "channels");
  EXPECT_EQ(channel_json.at("request"), "2");
  EXPECT_EQ(channel_json.at("request_state"), 1);
  EXPECT_EQ(channel_json.at("name"), "sq1");
  EXPECT_EQ(channel_json.at("host"), "hall");
  EXPECT_EQ(channel_json.at("service"), "sq1");
  EXPECT_EQ(channel_json.at("view").at("state"), "running");
}

TEST_F(APlantModel, ShowsTheDataOfAGatewayAgainAfterAShortSilence) {
  fabric::DataSample data{.key = {"cnc", 1}, .group = "slow", .at = at(0)};
  data.values.push_back({.name = "V.E.LABEL"});
  const auto is_gone = [&] { return sut.data().samples({}).at(0).at("gone"); };
  add({machine(1, "gw"), {.at = at(0), .sample = data}});
  add({machine(1, "", false)});
  EXPECT_EQ(is_gone(), true);
  add({machine(1, "gw")});
  EXPECT_EQ(is_gone(), false);
  add({machine(1, "", false)});
  add({machine(2, "gw")});
  EXPECT_EQ(is_gone(), true) << "another gateway sends its groups itself";
}

TEST_F(APlantModel, ShowsWhetherAChannelsGatewayIsAlive) {
  const auto state = [&](const boost::json::object& from) {
    return first(from, "channels").at("view").at("state");
  };
  add({channel(fabric::ChannelState::idle)});
  EXPECT_EQ(state(sut.snapshot(after(0))), "gateway gone");
  add({machine(1, "gw", false)});
  EXPECT_EQ(state(sut.snapshot(after(0))), "link down");
  add({machine(1, "gw")});
  EXPECT_EQ(state(*sut.changes(after(0))), "idle");
  add({machine(1, "", false)});
  EXPECT_EQ(state(*sut.changes(after(1000))), "gateway gone");
}

TEST_F(APlantModel, SendsAChannelAgainWhenItsWaitLastsTooLong) {
  Entry waiting = channel(fabric::ChannelState::waiting);
  std::get<fabric::ChannelStatus>(waiting.sample).since = at(0);
  std::get<fabric::ChannelStatus>(waiting.sample).uuid = square_root;
  add({machine(1, "gw"), instance(Change::ready), waiting});
  const auto level = [&](const boost::json::object& from) {
    return first(from, "channels").at("view").at("level");
  };
  EXPECT_EQ(level(*sut.changes(after(0))), "fine");
  EXPECT_EQ(level(*sut.changes(after(6000))), "look");
  EXPECT_FALSE(sut.changes(after(7000)));
  EXPECT_EQ(level(*sut.changes(after(61'000))), "act");
}

TEST_F(APlantModel, SendsTheConcernsWhenTheyChange) {
  add({machine(1, "gw")});
  EXPECT_EQ(sut.snapshot(after(0)).at("concerns").as_array().size(), 0U);
  ASSERT_TRUE(sut.changes(after(0)));
  add({channel(fabric::ChannelState::held)});
  EXPECT_EQ(first(*sut.changes(after(500)), "concerns").at("kind"), "held");
  EXPECT_FALSE(sut.changes(after(1000)));
  add({channel(fabric::ChannelState::idle)});
  EXPECT_EQ(sut.changes(after(1500))->at("concerns").as_array().size(), 0U);
}

TEST_F(APlantModel, SaysThatAConcernIsOverToAPageThatCameMeanwhile) {
  add({machine(1, "gw"), channel(fabric::ChannelState::idle)});
  ASSERT_TRUE(sut.changes(after(0)));
  add({channel(fabric::ChannelState::held)});
  EXPECT_EQ(first(sut.greeting(after(100)), "concerns").at("kind"), "held");
  add({channel(fabric::ChannelState::idle)});
  EXPECT_EQ(sut.changes(after(250))->at("concerns").as_array().size(), 0U);
  EXPECT_FALSE(sut.changes(after(1000))->contains("concerns")) << "it says it once";
}

TEST_F(APlantModel, SaysThatAChannelIsThereNoLonger) {
  add({machine(1, "gw"), channel(fabric::ChannelState::idle)});
  ASSERT_TRUE(sut.changes(after(0)));
  Entry gone = channel(fabric::ChannelState::link_down);
  std::get<fabric::ChannelStatus>(gone.sample).gone = true;
  add({gone, machine(1, "gw")});
  const auto changes = *sut.changes(after(1000));
  EXPECT_EQ(changes.at("gone").at("channels").at(0).at("machine"), "cnc");
  EXPECT_EQ(sut.snapshot(after(1000)).at("channels").as_array().size(), 0U);
}

TEST_F(APlantModel, ShowsThatTheProgramOfAChannelWasAborted) {
  add({channel(fabric::ChannelState::idle)});
  ASSERT_TRUE(sut.changes(after(0)));
  EXPECT_FALSE(first(sut.snapshot(after(0)), "channels").contains("program"));
  const fabric::ProgramEvent aborted{.key = {"cnc", 1},
                                     .kind = fabric::ProgramEventKind::aborted,
                                     .at = at(0),
                                     .program = "good.nc",
                                     .error = 455};
  add({{.at = at(0), .sample = aborted}});
  const auto changes = sut.changes(after(1000));
  ASSERT_TRUE(changes);
  const auto program = first(*changes, "channels").at("program").as_object();
  EXPECT_EQ(program.at("state"), "aborted");
  EXPECT_EQ(program.at("name"), "good.nc");
  EXPECT_EQ(program.at("error"), 455);
  // Its gateway may be heard later than the program.
  add({machine(1, "gw")});
  EXPECT_TRUE(first(sut.snapshot(after(1500)), "channels").contains("program"));
  // The next gateway publishes it again if it still holds.
  add({machine(1, "", false), machine(2, "gw")});
  EXPECT_FALSE(first(sut.snapshot(after(2000)), "channels").contains("program"));
}

TEST_F(APlantModel, ForgetsAMachinesFormerGatewayWhenItHasAnother) {
  add({machine(1, "gw")});
  ASSERT_TRUE(sut.changes(after(0)));
  add({machine(1, "", false)});
  EXPECT_EQ(first(*sut.changes(after(250)), "machines").at("connected"), false);
  add({machine(2, "gw2")});
  const auto changes = sut.changes(after(500));
  ASSERT_TRUE(changes);
  EXPECT_EQ(changes->at("gone").at("machines").at(0).at("gateway").as_string(), id(1).to_string());
  EXPECT_EQ(first(*changes, "machines").at("gateway_host"), "gw2");
  EXPECT_THAT(sut.machines(), SizeIs(1));
}

TEST_F(APlantModel, ReportsThatAMachineWasRemovedWithItsChannels) {
  add({machine(1, "gw"), channel(fabric::ChannelState::idle)});
  ASSERT_TRUE(sut.changes(after(0)));
  Entry removed = machine(1, "", false);
  auto& status = std::get<fabric::MachineStatus>(removed.sample);
  status.gone = true;
  status.reason = base::messages::machine_removed();
  add({removed});
  const auto changes = sut.changes(after(500));
  ASSERT_TRUE(changes);
  EXPECT_EQ(changes->at("gone").at("machines").at(0).at("machine").as_string(), "cnc");
  EXPECT_EQ(changes->at("gone").at("channels").at(0).at("channel"), 1);
  EXPECT_THAT(sut.machines(), IsEmpty());
}

TEST_F(APlantModel, ReportsThatAnInstanceIsGone) {
  add({instance(Change::ready)});
  ASSERT_TRUE(sut.changes(after(0)));
  add({instance(Change::gone)});
  const auto changes = sut.changes(after(250));
  ASSERT_TRUE(changes);
  EXPECT_EQ(changes->at("gone").at("services").at(0).as_string(), id(0x11).to_string());
}

TEST_F(APlantModel, SendsANewReaderTheInstancesOfTheLastQuarterOfAnHour) {
  add({instance(Change::ready), instance(Change::gone)});
  ASSERT_TRUE(sut.changes(after(0)));
  const boost::json::object gone = first(sut.snapshot(after(250)), "services");
  EXPECT_EQ(gone.at("name"), "sq1");
  EXPECT_TRUE(gone.contains("gone"));
  constexpr double quarter = 15 * 60'000;
  ASSERT_TRUE(sut.changes(after(quarter)));
  EXPECT_THAT(sut.services(after(quarter)), SizeIs(1));
  ASSERT_TRUE(sut.changes(after(quarter + 2000)));
  EXPECT_THAT(sut.services(after(quarter + 2000)), IsEmpty());
  // The name of its service is known to channels that request it.
  Entry unserved = channel(fabric::ChannelState::unserved, 1);
  std::get<fabric::ChannelStatus>(unserved.sample).instance = {};
  add({unserved});
  EXPECT_EQ(first(sut.snapshot(after(quarter + 3000)), "channels").at("service"), "sq1");
}

TEST_F(APlantModel, CountsRatesDownWithoutCalls) {
  add({instance(Change::ready), channel(fabric::ChannelState::idle)});
  for (int i = 1; i <= 20; ++i) {
    add(one_call(static_cast<std::uint64_t>(i), i * 100.0), i * 100.0);
  }
  const auto busy = sut.changes(after(2000));
  ASSERT_TRUE(busy);
  EXPECT_NEAR(first(*busy, "services").at("calls_per_second").as_double(), 10, 1);
  EXPECT_NEAR(first(*busy, "services").at("p50_ms").as_double(), 7.1, 0.01);
  const auto idle = sut.changes(after(14'000));
  ASSERT_TRUE(idle);
  EXPECT_EQ(first(*idle, "services").at("calls_per_second"), 0.0);
  EXPECT_EQ(first(*idle, "channels").at("calls_per_second"), 0.0);
}

TEST_F(APlantModel, ShowsTheSameRateOfAServiceWhenANewInstanceTakesHalfOfItsCalls) {
  add({instance(Change::ready)});
  for (int i = 1; i <= 240; ++i) {
    const double time = i * 100.0;
    if (i == 200) {
      add({instance(Change::ready, 0x22)}, time);
    }
    std::vector<Entry> entries = one_call(static_cast<std::uint64_t>(i), time);
    for (Entry& entry : entries) {
      if (auto* event = std::get_if<fabric::Event>(&entry.sample); event && i > 200 && i % 2 == 0) {
        event->instance = id(0x22);
      }
    }
    add(entries, time);
  }
  double sum = 0;
  for (const auto& service : sut.services(after(24'000))) {
    sum += service.at("calls_per_second").as_double();
  }
  EXPECT_NEAR(sum, 10, 0.2);
}

TEST_F(APlantModel, SendsTheFailedAndTheNewestOfManyCallsAndCountsTheRest) {
  for (std::uint64_t i = 1; i <= 120; ++i) {
    std::vector<Entry> entries = one_call(i, static_cast<double>(i));
    if (i == 3) {
      std::get<fabric::Reply>(entries[3].sample).code = fabric::ServiceCode::failed;
    }
    add(entries);
  }
  const auto changes = sut.changes(after(250));
  ASSERT_TRUE(changes);
  EXPECT_EQ(changes->at("skipped"), 70);
  const auto& calls = changes->at("calls").as_array();
  ASSERT_THAT(calls, SizeIs(50));
  EXPECT_EQ(calls.front().at("call"), "5f-3");
  EXPECT_EQ(calls.front().at("failed"), true);
  EXPECT_EQ(calls.back().at("call"), "5f-120");
}

TEST_F(APlantModel, CountsAnswersWithAnotherStateApartFromFailures) {
  add({instance(Change::ready)});
  std::vector<Entry> entries = one_call(1, 0);
  std::get<fabric::Reply>(entries[3].sample).state = 99;
  std::get<fabric::Event>(entries[5].sample).state = 99;
  add(entries);
  const boost::json::object snapshot = sut.snapshot(after(0));
  EXPECT_EQ(first(snapshot, "calls").at("result"), "other_state");
  EXPECT_EQ(first(snapshot, "calls").at("failed"), false);
  EXPECT_EQ(first(snapshot, "services").at("other_states"), 1);
  EXPECT_EQ(snapshot.at("totals").at("failed"), 0);
  EXPECT_EQ(snapshot.at("totals").at("other_states"), 1);
}

TEST_F(APlantModel, ShowsTheNumberOfInstancesForAWaitingCall) {
  Entry waits = channel(fabric::ChannelState::waiting, 1);
  std::get<fabric::ChannelStatus>(waits.sample).instance = {};
  add({machine(1, "gw"), waits});
  ASSERT_TRUE(sut.changes(after(0)));
  add({instance(Change::ready)});
  EXPECT_EQ(first(*sut.changes(after(1000)), "channels").at("instances"), 1);
  add({instance(Change::gone)});
  EXPECT_EQ(first(*sut.changes(after(2000)), "channels").at("instances"), 0);
}

TEST_F(APlantModel, ShowsOnItsChannelsThatAGatewayAcceptsNoCalls) {
  add({machine(1, "gw"), channel(fabric::ChannelState::unserved)});
  ASSERT_TRUE(sut.changes(after(0)));
  const fabric::Alarm full{.key = {id(1), "journal", ""}, .text = "disk full"};
  add({{.sample = recording::AlarmNews{.alarm = full}}});
  EXPECT_EQ(first(*sut.changes(after(1000)), "channels").at("view").at("state"), "journal");
  add({{.sample = recording::AlarmNews{.over = true, .alarm = full}}});
  EXPECT_EQ(first(*sut.changes(after(2000)), "channels").at("view").at("state"), "unserved");
}

TEST_F(APlantModel, ShowsWhatAnUnservedRequestContains) {
  Entry unserved = channel(fabric::ChannelState::unserved);
  std::get<fabric::ChannelStatus>(unserved.sample).uuid = square_root;
  add({machine(1, "gw"), unserved});
  add({{.at = at(0),
        .sample = fabric::Event{.key = {"cnc", 1},
                                .kind = fabric::EventKind::unserved,
                                .uuid = square_root,
                                .text = "part 7",
                                .state = 3}}});
  const boost::json::object channel_json = first(sut.snapshot(after(10)), "channels");
  EXPECT_EQ(channel_json.at("request"), "part 7");
  EXPECT_EQ(channel_json.at("request_state"), 3);
  EXPECT_EQ(channel_json.at("uuid").as_string(), square_root);
  add({channel(fabric::ChannelState::idle)});
  EXPECT_FALSE(first(sut.snapshot(after(20)), "channels").contains("request"));
}

TEST_F(APlantModel, ShowsTheLastHostOfAGatewayThatIsGone) {
  add({machine(1, "gw"), machine(1, "", false)});
  EXPECT_EQ(first(sut.snapshot(after(0)), "machines").at("last_gateway_host"), "gw");
}

TEST_F(APlantModel, ShowsWhateverIsInATextAsText) {
  std::vector<Entry> entries = one_call(1, 0);
  std::get<fabric::Event>(entries[0].sample).text = "<script>\x01\xe4\n";
  add(entries);
  EXPECT_EQ(first(sut.snapshot(after(0)), "calls").at("request"), "<script>\x01ä\n");
}

TEST_F(APlantModel, KeepsALineOfEachService) {
  add({instance(Change::ready)});
  ASSERT_TRUE(sut.changes(after(0)));
  for (std::uint64_t i = 1; i <= 10; ++i) {
    add(one_call(i, static_cast<double>(i)));
  }
  ASSERT_TRUE(sut.changes(after(5000)));
  const boost::json::object history = sut.history();
  const auto& line = history.at("services").at(square_root).as_object();
  EXPECT_EQ(line.at("calls_per_second").at(0), 2.0);
  EXPECT_NEAR(line.at("p99_ms").at(0).as_double(), 7.1, 0.01);
  EXPECT_EQ(history.at("instances").at(id(0x11).to_string()).at("running").at(0), 0);
  EXPECT_EQ(history.at("step_ms"), 5000);
}

TEST_F(APlantModel, ShowsWhichInstanceHasServedWhichChannelInTheLastMinute) {
  add({instance(Change::ready)});
  ASSERT_TRUE(sut.changes(after(0)));
  add(one_call(1, 1));
  add(one_call(2, 2));
  EXPECT_TRUE(sut.history().at("served").as_array().empty()) << "no step has ended";
  ASSERT_TRUE(sut.changes(after(10'000)));
  EXPECT_EQ(sut.history().at("served"), boost::json::array({{{"instance", id(0x11).to_string()},
                                                             {"machine", "cnc"},
                                                             {"channel", 1},
                                                             {"calls_per_second", 0.2}}}));
  ASSERT_TRUE(sut.changes(after(70'000)));
  EXPECT_TRUE(sut.history().at("served").as_array().empty()) << "it was more than a minute ago";
}

TEST_F(APlantModel, ShowsWhoAcknowledgedACauseLast) {
  const fabric::Moment now = after(1000);
  sut.acknowledge({.cause = "held cnc/1", .name = "cnc/1", .by = "anna"}, now.wall);
  sut.acknowledge({.cause = "held cnc/1", .name = "cnc/1", .by = "bert", .note = "mine"}, now.wall);
  const auto changes = sut.changes(now);
  ASSERT_TRUE(changes);
  const boost::json::array& acknowledged = changes->at("acknowledged").as_array();
  ASSERT_EQ(acknowledged.size(), 1U);
  EXPECT_EQ(acknowledged.at(0).at("by"), "bert");
  EXPECT_EQ(sut.snapshot(now).at("acknowledged"), acknowledged);
  EXPECT_EQ(sut.events().at(0).at("text"), "bert: mine");
  EXPECT_EQ(sut.events().at(1).at("text"), "anna");
  EXPECT_FALSE(sut.changes(now));
  for (std::size_t i = 0; i < PlantModel::most_acknowledged; ++i) {
    sut.acknowledge({.cause = std::to_string(i), .by = "anna"}, now.wall);
  }
  EXPECT_EQ(sut.acknowledged().size(), PlantModel::most_acknowledged);
  EXPECT_EQ(sut.acknowledged().at(0).at("cause"), "0") << "the oldest is forgotten";
}

TEST_F(APlantModel, ShowsWhatWasAcknowledgedAsAMessage) {
  const fabric::Alarm alarm{.key = {id(7), "archive", ""},
                            .level = fabric::AlarmLevel::problem,
                            .text = "disk full",
                            .program = "archiver",
                            .host = "hall",
                            .pid = 7};
  add({{.at = at(0), .sample = recording::AlarmNews{.alarm = alarm}}});
  const fabric::Moment now = after(1000);
  const auto concerns = sut.concerns(now);
  const auto found =
      std::ranges::find(concerns, fabric::plant::Kind::alarm, &fabric::plant::Concern::kind);
  ASSERT_NE(found, concerns.end());
  const fabric::Message subject = sut.subject_of(found->cause, now);
  EXPECT_EQ(subject, base::messages::process_on_host("archiver", "hall", "7"));
  EXPECT_TRUE(sut.subject_of("another cause", now).empty());
  sut.acknowledge({.cause = found->cause, .name = subject, .by = "anna"}, now.wall);
  const auto changes = sut.changes(now);
  ASSERT_TRUE(changes);
  const boost::json::object taken = first(*changes, "acknowledged");
  EXPECT_EQ(taken.at("name"), "archiver on hall, pid 7");
  EXPECT_EQ(taken.at("name_code"), "process_on_host");
  EXPECT_EQ(sut.events().at(0).at("name_code"), "process_on_host");
  EXPECT_EQ(taken.at("name_arguments"), boost::json::array({"archiver", "hall", "7"}));
}

TEST_F(APlantModel, ForgetsMachinesWithoutAGateway) {
  add({machine(1, "gw"), channel(fabric::ChannelState::idle), instance(Change::ready)});
  ASSERT_TRUE(sut.changes(after(0)));
  EXPECT_FALSE(sut.forget({"cnc"}, "anna", at(0))) << "its gateway is there";
  add({machine(1, "", false)});
  EXPECT_FALSE(sut.forget({"cnc", "press"}, "anna", at(1))) << "one of them is unknown";
  EXPECT_THAT(sut.machines(), SizeIs(1));
  EXPECT_TRUE(sut.forget({"cnc"}, "anna", at(1)));
  const auto changes = sut.changes(after(250));
  ASSERT_TRUE(changes);
  const boost::json::object& gone = changes->at("gone").as_object();
  EXPECT_EQ(first(gone, "machines").at("gateway").as_string().c_str(), id(1).to_string());
  EXPECT_EQ(first(gone, "channels").at("channel"), 1);
  EXPECT_EQ(sut.events().at(0).at("kind"), "machine forgotten");
  EXPECT_EQ(sut.events().at(0).at("machines"), boost::json::array({"cnc"}));
  EXPECT_EQ(sut.events().at(0).at("text"), "anna");
  EXPECT_TRUE(sut.machines().empty());
  EXPECT_TRUE(sut.snapshot(after(300)).at("channels").as_array().empty());
  add({machine(1, "gw")});
  EXPECT_THAT(sut.machines(), SizeIs(1)) << "its gateway is back";
}

TEST_F(APlantModel, ShowsTheNameOfAnInstanceAtTheTimeOfTheCall) {
  add({instance(Change::ready)});
  add(one_call(17, 0));
  Entry renamed = instance(Change::ready, 0x22);
  std::get<InstanceNews>(renamed.sample).identity.name = "another";
  add({instance(Change::gone), renamed});
  EXPECT_EQ(first(sut.snapshot(after(10)), "calls").at("service"), "sq1");
}

TEST_F(APlantModel, ShowsTheUuidOfAServiceWhoseInstancesHaveNamesOfTheirOwn) {
  Entry other = instance(Change::ready, 0x22);
  std::get<InstanceNews>(other.sample).identity.name = "sq2";
  Entry waits = channel(fabric::ChannelState::waiting, 1);
  std::get<fabric::ChannelStatus>(waits.sample).instance = {};
  add({instance(Change::ready), waits});
  EXPECT_EQ(first(sut.snapshot(after(0)), "channels").at("service"), "sq1");
  add({other});
  EXPECT_FALSE(first(sut.snapshot(after(0)), "channels").contains("service"));
  // The instance of the call is known.
  add({channel(fabric::ChannelState::running, 1)});
  EXPECT_EQ(first(sut.snapshot(after(0)), "channels").at("service"), "sq1");
}

}  // namespace
}  // namespace millrace::tools::web::plant
