#include "gateway/machines/machines.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/machines/claims.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

using Channels = std::vector<std::uint16_t>;

/// Of a link that is up at once and answers nothing.
class NoLink final : public machines::Link {
 public:
  NoLink(std::vector<Channels>& watched, std::vector<Channels>& unwatched)
      : watched_(watched), unwatched_(unwatched) {}
  void watch(const Channels& channels) override { watched_.push_back(channels); }
  void unwatch(const Channels& channels) override { unwatched_.push_back(channels); }
  void read(std::uint16_t, ReadSet) override {}
  void write(std::uint16_t, Variable, const Value&) override {}
  [[nodiscard]] machines::LinkLoad load() const override { return {}; }

 private:
  std::vector<Channels>& watched_;
  std::vector<Channels>& unwatched_;
};

constexpr std::uint64_t own_epoch = 1;
constexpr std::uint64_t other_epoch = 2;

fabric::InstanceId gateway(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

class MachinesTest : public testing::Test,
                     public machines::MachinesIo,
                     public machines::MachinesListener {
 protected:
  MachinesTest() {
    settings::MachineSettings machine;
    machine.name = "cnc";
    sut.set({machine});
  }

  // Hands.
  [[nodiscard]] Moment now() const override { return time; }
  void after(std::chrono::nanoseconds, std::function<void()> act) override {
    waiting.push_back(std::move(act));
  }
  std::unique_ptr<machines::Link> connect(const settings::MachineSettings&,
                                          machines::LinkEvents& events) override {
    link = &events;
    linked = true;
    return std::make_unique<NoLink>(watched, unwatched);
  }
  void say(Level, const std::string& text) override { said.push_back(text); }
  // Listener.
  void on_link_up(const std::string&, const std::vector<std::uint16_t>& channels) override {
    EXPECT_TRUE(linked);
    served = channels;
  }
  void on_link_down(const std::string&, const std::string&) override {}
  void on_link_dropped(const std::string&, const std::string&) override { linked = false; }
  void on_retired(const fabric::ChannelKey&) override {}
  void on_refused(const fabric::ChannelKey&, const std::string&) override {}
  void on_inherited(const fabric::ChannelStatus& status, const std::string& from) override {
    inherited.emplace_back(status.key.channel, from);
  }
  void on_machine_status(const fabric::MachineStatus& status) override {
    told = status;
    ++times_told;
  }
  void on_machine_left(const fabric::MachineStatus&) override {}
  void on_contested() override {}
  [[nodiscard]] std::vector<std::uint16_t> channels_of(const std::string&) const override {
    return served;
  }
  void on_read(const fabric::ChannelKey&, const Snapshot&) override {}
  void on_read_failed(const fabric::ChannelKey&, const std::string&) override {}
  void on_write(const fabric::ChannelKey&, WriteOutcome, const std::string&) override {}
  void on_pushed(const fabric::ChannelKey& key, bool is) override { pushed[key.channel] = is; }
  void on_change(const fabric::ChannelKey& key, Variable) override {
    changed.push_back(key.channel);
  }

  void time_passes() {
    for (const auto& act : std::exchange(waiting, {})) {
      act();
    }
  }
  void serve() {
    time_passes();
    link->on_link_up("cnc", {1, 2});
  }
  /// Another gateway's word.
  static fabric::MachineStatus claim(std::chrono::seconds since) {
    fabric::MachineStatus status;
    status.machine = "cnc";
    status.gateway = gateway(9);
    status.claimed = machines::Claims::earliest + since;
    status.connected = true;
    status.host = "host7";
    status.pid = 1;
    status.epoch = other_epoch;
    return status;
  }
  static fabric::ChannelStatus call(std::uint64_t epoch, fabric::ChannelState state,
                                    std::uint32_t attempt) {
    fabric::ChannelStatus status;
    status.key = {"cnc", 1};
    status.state = state;
    status.call = {epoch, 5};
    status.attempt = attempt;
    return status;
  }

  Moment time{SteadyTime(1h), machines::Claims::earliest + 1h};
  std::vector<std::function<void()>> waiting;
  machines::LinkEvents* link = nullptr;
  bool linked = false;
  std::vector<std::uint16_t> served;
  std::vector<std::pair<std::uint16_t, std::string>> inherited;
  fabric::MachineStatus told;
  int times_told = 0;
  std::vector<Channels> watched;
  std::vector<Channels> unwatched;
  std::map<std::uint16_t, bool> pushed;
  std::vector<std::uint16_t> changed;
  std::vector<std::string> said;
  machines::Machines sut{{gateway(5), "host1", 4711, "1", own_epoch}, *this, *this};
};

using enum fabric::ChannelState;
const std::string other = "gateway 000000000002 (pid 1 on host7)";

TEST_F(MachinesTest, ServesAfterItHasListened) {
  EXPECT_EQ(link, nullptr);
  serve();
  EXPECT_THAT(served, ElementsAre(1, 2));
}

TEST_F(MachinesTest, ListensOnWhereItsTimersAreLate) {
  time.steady += 400ms;
  time_passes();
  EXPECT_EQ(link, nullptr);
  time.steady += 300ms;
  serve();
  EXPECT_THAT(served, ElementsAre(1, 2));
}

TEST_F(MachinesTest, ServesInTheEndWhereItsTimersAreAlwaysLate) {
  for (int times = 0; times < 20 && link == nullptr; ++times) {
    time.steady += 400ms;
    time_passes();
  }
  EXPECT_NE(link, nullptr);
}

TEST_F(MachinesTest, LetGoOfWhatOthersMayHaveTakenOverWhenTheyStoodStill) {
  serve();
  EXPECT_FALSE(sut.stood_still());
  EXPECT_TRUE(linked);
  sut.on_machine(claim(2h));
  EXPECT_TRUE(sut.stood_still());
  EXPECT_FALSE(linked);
}

TEST_F(MachinesTest, AreToldAnewWhenTheyStoodStill) {
  serve();
  const int before = times_told;
  EXPECT_FALSE(sut.stood_still());
  EXPECT_EQ(times_told, before + 1);
  EXPECT_TRUE(told.connected);
}

// Who takes this gateway for gone although it is there has forgotten what it told.
TEST_F(MachinesTest, AreToldAnewToAGatewayThatServesThemToo) {
  serve();
  auto later = claim(2h);
  later.connected = false;
  sut.on_machine(later);
  const int before = times_told;
  later.connected = true;
  sut.on_machine(later);
  EXPECT_EQ(times_told, before + 1);
}

// Else two that share a machine would go on telling each other.
TEST_F(MachinesTest, AreNotToldAnewByWhoCameLater) {
  auto first = claim(1s);
  first.claims = {7};
  sut.on_machine(first);
  serve();
  const int before = times_told;
  sut.on_machine(first);
  EXPECT_EQ(times_told, before);
}

// The link that is taken away may be the one that was about to speak.
TEST_F(MachinesTest, HearNothingOfALinkThatWasTakenAwayBeforeItsWord) {
  serve();
  sut.on_machine(claim(2h));
  machines::LinkGate gate([this] { sut.stood_still(); }, *link);
  gate.on_link_up("cnc", {1});
  EXPECT_FALSE(linked);
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_FALSE(told.connected);
}

TEST_F(MachinesTest, DoesNotConnectToAMachineThatAnotherOneServes) {
  sut.on_machine(claim(1s));
  time_passes();
  EXPECT_EQ(link, nullptr);
  EXPECT_FALSE(told.connected);
}

TEST_F(MachinesTest, InheritsTheCallOfAGatewayThatIsGone) {
  sut.on_machine(claim(1s));
  time_passes();
  sut.on_channel(call(other_epoch, running, 1));
  sut.on_machine_gone("cnc", gateway(9));
  serve();
  EXPECT_THAT(inherited, ElementsAre(Pair(1, other)));
}

// A gateway that had stood still heard of a call before it was given out, and not after, and gave
// it out again. Found by the simulation.
TEST_F(MachinesTest, InheritsACallThatWaitedWhenItWasLastHeardOf) {
  sut.on_machine(claim(1s));
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::waiting, 0));
  sut.on_machine_gone("cnc", gateway(9));
  serve();
  EXPECT_THAT(inherited, ElementsAre(Pair(1, other)));
}

// It was overwritten by what a gateway without a link, or this one itself, said of the channel.
// Found by the simulation.
TEST_F(MachinesTest, InheritsACallOfWhichAnotherGatewayKnowsNothing) {
  sut.on_machine(claim(1s));
  time_passes();
  sut.on_channel(call(other_epoch, running, 1));
  auto nothing = call(other_epoch, link_down, 0);
  nothing.call = {};
  sut.on_channel(nothing);
  sut.on_machine_gone("cnc", gateway(9));
  serve();
  EXPECT_THAT(inherited, ElementsAre(Pair(1, other)));
}

TEST_F(MachinesTest, InheritsNothingOfAGatewayThatEndsInOrder) {
  sut.on_machine(claim(1s));
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::waiting, 0));
  auto last = call(other_epoch, idle, 0);
  last.call = {};
  sut.on_channel(last);
  sut.on_machine_gone("cnc", gateway(9));
  serve();
  EXPECT_THAT(inherited, IsEmpty());
}

// A gateway that had started again and held a call of its journal was not understood, and the
// at-most-once call ran twice. Found by the simulation.
TEST_F(MachinesTest, InheritsACallThatTheOtherOneKnowsFromItsJournal) {
  sut.on_machine(claim(1s));
  time_passes();
  sut.on_channel(call(other_epoch, link_down, 0));
  sut.on_machine_gone("cnc", gateway(9));
  serve();
  EXPECT_THAT(inherited, ElementsAre(Pair(1, other)));
}

// Of two that had not heard each other the one that went on serving did not ask what the other had
// done. Found by the simulation.
TEST_F(MachinesTest, InheritsFromAnotherOneThatServedTheSameMeanwhile) {
  serve();
  sut.on_machine(claim(2h));
  sut.on_channel(call(other_epoch, running, 1));
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_THAT(inherited, ElementsAre(Pair(1, other)));
}

// Found by the simulation.
TEST_F(MachinesTest, InheritsACallThatItHeardOfBeforeItsConfigurationNamedTheMachine) {
  serve();
  sut.set({});
  served.clear();
  time_passes();
  sut.on_channel(call(other_epoch, running, 1));
  settings::MachineSettings machine;
  machine.name = "cnc";
  sut.set({machine});
  serve();
  EXPECT_THAT(inherited, ElementsAre(Pair(1, "")));
}

// Found by the simulation.
TEST_F(MachinesTest, InheritsNothingFromItself) {
  sut.on_machine(claim(1s));
  time_passes();
  sut.on_channel(call(own_epoch, running, 1));
  sut.on_machine_gone("cnc", gateway(9));
  serve();
  EXPECT_THAT(inherited, IsEmpty());
}

TEST_F(MachinesTest, AreNotStoppedByAClaimThatNobodyCanHaveMade) {
  serve();
  const std::size_t before = said.size();
  for (int i = 0; i < 10'000; ++i) {
    auto liar = claim(0s);
    liar.gateway = fabric::InstanceId::random();
    liar.claimed = i % 2 == 0 ? fabric::Time(1ns) : fabric::Time::max();
    sut.on_machine(liar);
  }
  EXPECT_TRUE(linked);
  EXPECT_THAT(served, ElementsAre(1, 2));
  ASSERT_EQ(said.size(), before + 1) << "said once";
  EXPECT_THAT(said.back(), testing::HasSubstr("claimed=1"));
}

TEST_F(MachinesTest, InheritNothingOfAnotherControllerOfTheirName) {
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.net_id = cnc::ads::NetId{{10, 0, 0, 7, 1, 1}};
  sut.set({machine});
  time_passes();
  auto namesake = claim(1s);
  namesake.address = "10.0.0.8:48898, 10.0.0.8.1.1";
  sut.on_machine(namesake);
  serve();
  sut.on_channel(call(other_epoch, running, 1));
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_THAT(inherited, IsEmpty());
  EXPECT_THAT(said, testing::Contains(testing::HasSubstr("another controller")));
}

TEST_F(MachinesTest, RememberSoManyChannelsOfOthersAndNoMore) {
  for (std::size_t i = 0; i < 16'384 + 100; ++i) {
    auto status = call(other_epoch, running, 1);
    status.key = {"m" + std::to_string(i / 50), static_cast<std::uint16_t>(1 + i % 50)};
    sut.on_channel(status);
  }
  ASSERT_THAT(said, testing::SizeIs(1)) << "said once";
  EXPECT_THAT(said.back(), testing::HasSubstr("of more than 16384 channels"));
}

class WatchedMachine : public MachinesTest {
 protected:
  void be_pushed() {
    serve();
    link->on_watched("cnc", {{1, "", false}, {2, "", false}});
    for (const std::uint16_t channel : Channels{1, 2}) {
      link->on_told({"cnc", channel}, Variable::request_state, 0);
      look(channel, 0);
    }
  }
  void look(std::uint16_t channel, std::uint32_t state) {
    Snapshot snapshot;
    snapshot.look = ReadSet::state;
    snapshot.request_state = state;
    link->on_read({"cnc", channel}, snapshot);
  }
};

TEST_F(WatchedMachine, IsAskedToTellOfTheChannelsThatAreServedAndSaysSoInItsStatus) {
  be_pushed();
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2)));
  EXPECT_THAT(pushed, ElementsAre(Pair(1, true), Pair(2, true)));
  EXPECT_TRUE(told.connected);
  EXPECT_EQ(told.reason, "pushed");
}

TEST_F(WatchedMachine, TellsOfAChangeAndOfWhatItWroteItselfNot) {
  be_pushed();
  changed.clear();
  link->on_told({"cnc", 2}, Variable::request_state, 7);
  EXPECT_THAT(changed, ElementsAre(2));
  look(2, 7);
  sut.write({"cnc", 2}, Variable::request_state, Value(0U));
  EXPECT_TRUE(pushed[2]);
  link->on_write({"cnc", 2}, WriteOutcome::written, "");
  EXPECT_FALSE(pushed[2]) << "until the controller has told it";
  link->on_told({"cnc", 2}, Variable::request_state, 0);
  EXPECT_TRUE(pushed[2]);
  EXPECT_THAT(changed, ElementsAre(2));
}

TEST_F(WatchedMachine, AWriteThatWasRefusedHasChangedNothing) {
  be_pushed();
  sut.write({"cnc", 2}, Variable::request_state, Value(9U));
  link->on_write({"cnc", 2}, WriteOutcome::refused, "");
  EXPECT_TRUE(pushed[2]);
}

TEST_F(WatchedMachine, IsAskedAnewOnANewLink) {
  be_pushed();
  link->on_link_down("cnc", "cable");
  link->on_link_up("cnc", {1, 2});
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2), ElementsAre(1, 2)));
  EXPECT_THAT(unwatched, IsEmpty()) << "the controller has forgotten it";
  EXPECT_EQ(told.reason, "polled");
}

TEST_F(WatchedMachine, ForgetsTheChannelThatAnotherGatewayServes) {
  be_pushed();
  fabric::MachineStatus other_claim = claim(30min);
  other_claim.claims = {2};
  sut.on_machine(other_claim);
  EXPECT_THAT(served, ElementsAre(1));
  EXPECT_THAT(unwatched, ElementsAre(ElementsAre(2)));
  EXPECT_FALSE(pushed[2]);
  EXPECT_THAT(told.reason, testing::EndsWith("; pushed"));
}

TEST_F(WatchedMachine, ObeysANewConfigurationOnTheSameLink) {
  be_pushed();
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.watch = WatchMode::poll;
  sut.set({machine});
  EXPECT_TRUE(linked);
  EXPECT_THAT(unwatched, ElementsAre(ElementsAre(1, 2)));
  EXPECT_EQ(told.reason, "polled, as configured");
}

TEST_F(WatchedMachine, IsAskedAgainLaterWhereItDidNotAnswer) {
  serve();
  link->on_watched("cnc", {{1, "no answer", true}, {2, "", false}});
  time.steady += 1s;
  time_passes();
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2), ElementsAre(1)));
}

}  // namespace
}  // namespace millrace::gateway
