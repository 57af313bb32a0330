#include "tools/doctor/diagnose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "fabric/plant/concern.hpp"

namespace millrace::tools::doctor {
namespace {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;
using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::Not;
using testing::ResultOf;

const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

testing::Matcher<const Diagnosis&> is(Severity severity, const std::string& what,
                                      const std::string& advice = "") {
  return AllOf(Field(&Diagnosis::severity, severity),
               Field(&Diagnosis::what, Field(&fabric::Message::text, HasSubstr(what))),
               Field(&Diagnosis::todo, ResultOf(&fabric::plant::advice_of, HasSubstr(advice))));
}

GuidPrefix prefix(std::uint8_t byte) {
  GuidPrefix bytes{};
  bytes.fill(byte);
  return bytes;
}

class TheDoctor : public testing::Test {
 protected:
  TheDoctor() {
    found.joining = {.fabric = "millrace", .interface = "eth0", .version = "0.1.0"};
    found.joining.now = std::chrono::sys_days(std::chrono::year(2026) / 11 / 28);
    found.interfaces = {{"lo", "127.0.0.1", true, false, true},
                        {"eth0", "10.77.0.1", true, true, false}};
    add_program(0, "doctor").self = true;
  }

  Program& add_program(std::uint8_t byte, const std::string& name) {
    found.programs.push_back({.prefix = prefix(byte),
                              .name = name,
                              .host = "host-" + name,
                              .pid = "17",
                              .addresses = "udp/10.77.0." + std::to_string(byte) + ":7410",
                              .fabrics = {"millrace"}});
    return found.programs.back();
  }

  /// A gateway whose machine is connected, and a service.
  void add_healthy_plant() {
    add_program(1, "gateway").is_gateway = true;
    add_program(2, "sq1").serves = {square_root};
    fabric::observer::InstanceNews news{.change = fabric::observer::Change::ready, .identity = {}};
    news.identity.id.bytes.fill(2);
    news.identity.uuid = square_root;
    news.identity.version = "1.0";
    add(news);
    add(fabric::MachineStatus{.machine = "cnc",
                              .connected = true,
                              .host = "host-gateway",
                              .pid = 17,
                              .version = "0.1.0"});
    add(fabric::ChannelStatus{.key = {"cnc", 1}, .state = fabric::ChannelState::idle});
  }
  void add(fabric::observer::Sample sample) { found.live.add({.sample = std::move(sample)}); }
  void add_alarm(const fabric::Alarm& alarm) { add(fabric::observer::AlarmNews{.alarm = alarm}); }

  void hear(std::uint8_t byte, std::uint32_t domain) {
    found.announcements.push_back(
        {{.prefix = prefix(byte), .name = "sq1", .host = "hall"}, domain, "10.77.0.9"});
  }

  std::vector<Diagnosis> sut() { return diagnose(found); }

  Findings found;
};

TEST_F(TheDoctor, FindsNothingWrongWithAHealthyFabric) {
  add_healthy_plant();
  hear(2, 0);
  EXPECT_TRUE(is_healthy(sut()));
  EXPECT_THAT(sut(), Not(Contains(Field(&Diagnosis::severity, Not(Severity::fine)))));
}

TEST_F(TheDoctor, ReportsWhatIsWrongWithTheInterface) {
  found.joining.interface = "eth9";
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "no interface 'eth9'", "eth0, lo")));
  found.joining.interface = "10.77.0.1";
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "eth0 (10.77.0.1) is up")));
  found.interfaces[1].up = false;
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "eth0 is down", "ip link set eth0 up")));
  found.interfaces[1].up = true;
  found.interfaces[1].carrier = false;
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "eth0 has no carrier", "cable")));
  found.interfaces[1].carrier = true;
  found.interfaces[1].multicast = false;
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "eth0 has no multicast", "peers")));
  found.obstacle = "cannot join\n  Cyclone: no eth0";
  EXPECT_THAT(sut(),
              Contains(is(Severity::problem, "cannot be joined: cannot join;  Cyclone: no eth0")));
}

TEST_F(TheDoctor, FindsTheDomainInWhichTheOthersAre) {
  hear(2, 5);
  found.domains_here = {0, 5, 7};
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "domain 5 has: sq1 on hall (10.77.0.9)",
                                 "--domain 5")));
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "domain 7", "--domain 7")));
  EXPECT_FALSE(is_healthy(sut()));
}

TEST_F(TheDoctor, FindsTheFabricInWhichTheOthersAre) {
  add_program(1, "gateway").fabrics = {"hall-2"};
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "the fabrics: hall-2", "--fabric NAME")));
}

TEST_F(TheDoctor, FindsTheInterfaceOnWhichTheOthersAre) {
  found.listening_interfaces = {"lo"};
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "interface lo, this one uses eth0",
                                 "--fabric-config")));
}

TEST_F(TheDoctor, SuspectsThePacketFilterIfOnlyMulticastArrives) {
  add_healthy_plant();
  hear(9, 0);
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "announces itself on this domain but does not",
                                 "7400 to 7649")));
}

TEST_F(TheDoctor, ReportsItsOwnIdentityAndWhatExpiresSoon) {
  add_healthy_plant();
  found.joining.now = std::chrono::sys_days{std::chrono::year{2026} / 3 / 1};
  found.joining.trusted_as = "office";
  found.joining.trusted_until = found.joining.now + std::chrono::days(31);
  EXPECT_THAT(sut(),
              Contains(is(Severity::fine, "has the certificate of office until 2026-04-01")));
  found.joining.trusted_until = found.joining.now + std::chrono::days(30);
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "which is in 30 days", "trust renew")));
  found.joining.trusted_until = found.joining.now + std::chrono::hours(24);
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "which is in 24 hours", "trust renew")));
}

TEST_F(TheDoctor, NamesAProcessWithoutAnIdentity) {
  add_healthy_plant();
  add_program(9, "old").announces_identity = false;
  found.joining.trusted_as = "office";
  EXPECT_THAT(
      sut(), Contains(is(Severity::problem, "old on host-old, pid 17 has a certificate of this PKI",
                         "millrace trust renew")));
  found.programs.back().fabrics = {"another"};
  EXPECT_THAT(sut(), Not(Contains(is(Severity::problem, "announces no identity"))));
}

TEST_F(TheDoctor, ReportsRevokedParticipantsAndTheDateOfTheList) {
  add_healthy_plant();
  found.joining.trusted_as = "office";
  found.joining.revoked_as_of = std::chrono::sys_days{std::chrono::year{2026} / 3 / 1};
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "revoked as of 2026-03-01 00:00:00 UTC: none")));
  found.joining.revoked = {"old", "o\x1bther"};
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "UTC: o\\x1bther, old")));
}

TEST_F(TheDoctor, NamesTheProcessesThatItAccepts) {
  add_healthy_plant();
  hear(2, 0);
  found.announcements.back().who.shows_certificate = true;
  found.joining.trusted_as = "office";
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "accepted here: sq1 on host-sq1, pid 17")));
  // In the form of another vendor's DDS.
  found.announcements.back().who.certificate = "CN=gateway-1";
  EXPECT_THAT(sut(), Contains(is(Severity::fine,
                                 "accepted here: sq1 on host-sq1, pid 17 as CN=gateway-1")));
}

TEST_F(TheDoctor, ExplainsWhyAProcessIsIgnored) {
  add_healthy_plant();
  hear(9, 0);
  found.joining.trusted_as = "office";
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "has no certificate", "trust issue")));
  found.announcements.back().who.shows_certificate = true;
  EXPECT_THAT(sut(), Contains(is(Severity::problem,
                                 "has a certificate, and this process does not accept it")));
  found.announcements.back().who.certificate = "CN=square-root";
  found.announcements.back().who.authority = "CN=elsewhere identity";
  EXPECT_THAT(sut(), Contains(is(Severity::problem,
                                 "has the certificate CN=square-root of CN=elsewhere identity, "
                                 "and this process does not accept it",
                                 "revoked")));
  found.joining.trusted_as.clear();
  EXPECT_THAT(
      sut(), Contains(is(Severity::problem, "ignores processes without a certificate", "trust {")));
}

// Cyclone lists them among its participants, without endpoints.
TEST_F(TheDoctor, AcceptsNoProcessWithoutEndpoints) {
  add_healthy_plant();
  add_program(9, "square_root").fabrics = {};
  hear(9, 0);
  EXPECT_THAT(sut(), Not(Contains(is(Severity::warning, "has no certificate"))));
  found.joining.trusted_as = "office";
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "has no certificate")));
  // And a participant with an identity does not trust us.
  found.joining.trusted_as.clear();
  found.announcements.back().who.shows_certificate = true;
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "ignores processes without a certificate")));
}

TEST_F(TheDoctor, SuspectsTheConfigurationIfItCannotFindOthers) {
  found.joining.multicast = false;
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "multicast is off and no peers", "peers")));
  found.joining.multicast = true;
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "no announcement came by multicast on eth0",
                                 "list the other hosts in ")));
  found.joining.interface = "lo";
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "only the loopback interface")));
}

TEST_F(TheDoctor, ExplainsWhyAPeerIsUnreachable) {
  add_healthy_plant();
  found.peers = {{"hall-1", "10.77.0.2", Reach::silent, ""},
                 {"hall-3", "10.77.0.3", Reach::refused, ""},
                 {"hall-4", "10.77.0.4", Reach::unreachable, "No route to host"},
                 {"hall-5", "10.77.0.5", Reach::silent, ""},
                 {"hall-6", "", Reach::unknown_name, "Name or service not known"}};
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "hall-1 (10.77.0.2) responds")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "hall-3 (10.77.0.3) is up, but no process")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem,
                                 "hall-4 (10.77.0.4) cannot be reached: No "
                                 "route to host")));
  EXPECT_THAT(sut(),
              Contains(is(Severity::problem, "hall-5 (10.77.0.5) does not respond", "7400")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "hall-6 has no address")));
}

TEST_F(TheDoctor, ReportsMissingGatewaysAndServices) {
  add_program(1, "recorder");
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "no gateway is on this fabric")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "no service is on this fabric")));
}

TEST_F(TheDoctor, NamesEndpointsWithoutAMatch) {
  add_healthy_plant();
  found.misfits = {{"millrace/reply", true, "other on hall", {"reliability: …"}}};
  EXPECT_THAT(sut(),
              Contains(is(Severity::problem,
                          "the writer of millrace/reply of other on hall matches no millrace "
                          "process: reliability")));
}

TEST_F(TheDoctor, FindsMachinesWithoutALink) {
  add_healthy_plant();
  add(fabric::MachineStatus{
      .machine = "press", .reason = "connection refused", .host = "host-gateway"});
  EXPECT_THAT(sut(), Contains(is(Severity::problem,
                                 "press: no connection to the controller: connection refused",
                                 "the gateway's log on host-gateway")));
}

TEST_F(TheDoctor, DoesNotCountAGatewayThatIsNotReceived) {
  add_healthy_plant();
  add_program(9, "gateway").is_gateway = true;
  found.programs.back().host = "host-9";
  EXPECT_THAT(sut(),
              Contains(is(Severity::problem, "the gateway on host-9, pid 17, does not respond",
                          "restart the gateway on host-9")));
  EXPECT_THAT(sut(), Not(Contains(is(Severity::problem, "no gateway is on this fabric"))));
  found.live = {};
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "no gateway is on this fabric")));
}

TEST_F(TheDoctor, NamesTheTransportToEachController) {
  add_healthy_plant();
  add(fabric::MachineStatus{.machine = "press",
                            .connected = true,
                            .address = "10.0.0.5:8016, 10.0.0.5.1.1, Secure ADS",
                            .host = "host-gateway"});
  EXPECT_THAT(sut(),
              Contains(is(Severity::fine,
                          "press is connected to its gateway on host-gateway over Secure ADS")));
  EXPECT_THAT(sut(), Not(Contains(is(Severity::warning, "plain ADS"))));
}

TEST_F(TheDoctor, WarnsOfPlainAdsToAnotherHost) {
  add_healthy_plant();
  fabric::MachineStatus press{.machine = "press",
                              .connected = true,
                              .address = "10.0.0.5:48898, 10.0.0.5.1.1",
                              .host = "host-gateway"};
  add(press);
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "press is connected over plain ADS",
                                 "configure `secure` for press")));
  EXPECT_TRUE(is_healthy(sut()));
  press.address = "127.0.0.1:48898, 127.0.0.1.1.1";
  add(press);
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "over plain ADS")));
  EXPECT_THAT(sut(), Not(Contains(is(Severity::warning, "plain ADS"))));
}

TEST_F(TheDoctor, NamesEachMachineWhoseGatewayIsGoneOnceAndWhereItWas) {
  add_healthy_plant();
  add_program(9, "gateway").is_gateway = true;
  found.programs.back().host = "host-9";
  fabric::MachineStatus lathe{.machine = "lathe", .connected = true, .host = "host-9", .pid = 17};
  lathe.gateway.bytes.fill(9);
  add(lathe);
  EXPECT_TRUE(is_healthy(sut()));
  add(fabric::MachineStatus{.machine = "lathe", .gateway = lathe.gateway, .gone = true});
  // The page's server knew it before.
  found.lost = {{.last = {.machine = "press", .host = "host-9", .pid = 17}}, {.last = lathe}};
  const auto is_of = [](const std::string& machine) {
    return is(Severity::problem,
              machine + ": gateway does not report: the gateway was on host-9, pid 17",
              "restart the gateway on host-9");
  };
  EXPECT_THAT(sut(), Contains(is_of("lathe")).Times(1));
  EXPECT_THAT(sut(), Contains(is_of("press")).Times(1));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "on host-9, pid 17")).Times(2));
}

TEST_F(TheDoctor, DistinguishesTwoGatewaysOfOneHost) {
  add_healthy_plant();
  add_program(9, "gateway").is_gateway = true;
  found.programs.back().pid = "18";
  const auto silent = [](const std::string& pid) {
    return Contains(
        is(Severity::problem, "the gateway on host-gateway, pid " + pid + ", does not respond"));
  };
  EXPECT_THAT(sut(), AllOf(silent("18"), Not(silent("17")))) << "one reports, the other does not";

  fabric::MachineStatus lathe{
      .machine = "lathe", .connected = true, .host = "host-gateway", .pid = 18};
  lathe.gateway.bytes.fill(9);
  add(lathe);
  EXPECT_TRUE(is_healthy(sut()));
  add(fabric::MachineStatus{.machine = "lathe", .gateway = lathe.gateway, .gone = true});
  const auto lost = Contains(is(Severity::problem, "lathe: gateway does not report")).Times(1);
  EXPECT_THAT(sut(), AllOf(lost, Not(silent("18")), Not(silent("17")))) << "named once";

  add_program(10, "gateway").is_gateway = true;
  found.programs.back().pid = "19";
  EXPECT_THAT(sut(), AllOf(lost, silent("19"))) << "a third, beside the lost one";
}

TEST_F(TheDoctor, CountsAProgramOfAnotherVendorToTheHostOfItsAddress) {
  add_healthy_plant();
  add_program(9, "foreign").host.clear();
  found.programs.back().addresses = "udp/10.77.0.2:7410";
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "3 other processes on 2 hosts")));
  found.programs.back().addresses = "udp/10.77.0.3:7410";
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "3 other processes on 3 hosts")));
}

TEST_F(TheDoctor, NamesAnInstanceThatSendsNoHeartbeat) {
  add_healthy_plant();
  fabric::observer::InstanceNews news{.change = fabric::observer::Change::ready, .identity = {}};
  news.identity.id.bytes.fill(3);
  news.identity.name = "sq2";
  news.identity.host = "hall";
  news.identity.pid = 99;
  add(news);
  news.change = fabric::observer::Change::gone;
  add(news);
  EXPECT_THAT(
      sut(), Contains(is(Severity::problem, "no service: the last instance was sq2, pid 99 on hall",
                         "start sq2 again")));
}

TEST_F(TheDoctor, CountsAStandbyGatewayAsNoProblem) {
  add_healthy_plant();
  fabric::MachineStatus second{
      .machine = "cnc", .reason = "host-gateway serves it", .host = "host-2", .version = "0.1.0"};
  second.gateway.bytes.fill(7);
  add(second);
  EXPECT_TRUE(is_healthy(sut()));
  EXPECT_THAT(sut(), Contains(is(Severity::fine, "another gateway of cnc stands by on host-2")));
}

TEST_F(TheDoctor, FindsChannelsThatWait) {
  using enum fabric::ChannelState;
  add_healthy_plant();
  add(fabric::ChannelStatus{
      .key = {"cnc", 1}, .state = unserved, .uuid = "x", .reason = "no service"});
  add(fabric::ChannelStatus{.key = {"cnc", 2}, .state = held});
  add(fabric::ChannelStatus{.key = {"cnc", 3}, .state = waiting, .uuid = "y"});
  add(fabric::ChannelStatus{.key = {"cnc", 4}, .state = waiting, .uuid = square_root});
  add(fabric::ChannelStatus{
      .key = {"lathe", 1}, .state = link_down, .reason = "its gateway is gone"});
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "cnc/1: no service: no service", "start")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "cnc/2: call held for an operator",
                                 "`millrace answer cnc/2 RESPONSE --state N`")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "cnc/2", "it has no running instance")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "cnc/3: no service")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "cnc/4: call waits: all instances are busy")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "lathe: gateway does not report")));
}

TEST_F(TheDoctor, NamesAFullDiskOnceAndNotTheServicesOfTheCallsThatWaitForIt) {
  add_healthy_plant();
  add(fabric::ChannelStatus{.key = {"cnc", 1},
                            .state = fabric::ChannelState::unserved,
                            .uuid = "x",
                            .reason = "the journal cannot be written"});
  add_alarm({.key = {.kind = "journal"}, .text = "the journal cannot be written"});
  EXPECT_THAT(sut(), Not(Contains(is(Severity::problem, "no service"))));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "the journal cannot be written")).Times(1));
}

TEST_F(TheDoctor, NamesWhereTheServiceOfAQueueIsConfiguredAndALostLinkOnce) {
  using enum fabric::ChannelState;
  add_healthy_plant();
  add(fabric::MachineStatus{.machine = "lathe", .reason = "its gateway is gone", .gone = true});
  add(fabric::ChannelStatus{.key = {"cnc.ALARMS", 1},
                            .state = unserved,
                            .uuid = "x",
                            .reason = base::messages::unknown_uuid("x")});
  add(fabric::ChannelStatus{
      .key = {"lathe.ALARMS", 1}, .state = link_down, .reason = "its gateway is gone"});
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "cnc.ALARMS/1: no service",
                                 "in the gateway's configuration (queue { uuid })")));
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "lathe")).Times(1));
}

TEST_F(TheDoctor, WarnsOfVersionsThatDiffer) {
  add_healthy_plant();
  add(fabric::MachineStatus{
      .machine = "cnc", .connected = true, .host = "host-gateway", .pid = 17, .version = "0.0.9"});
  fabric::observer::InstanceNews news{.change = fabric::observer::Change::ready, .identity = {}};
  news.identity.id.bytes.fill(3);
  news.identity.uuid = square_root;
  news.identity.version = "2.0";
  add(news);
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "is millrace 0.0.9, this is millrace 0.1.0")));
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "versions 1.0, 2.0")));
  EXPECT_TRUE(is_healthy(sut()));
}

TEST_F(TheDoctor, NamesAProcessWithoutACommonWireVersionAndWhichToUpgrade) {
  add_healthy_plant();
  found.programs.at(0).version = {.version = "1.1.0", .lowest_wire = 5, .highest_wire = 6};
  found.programs.at(1).version = {.version = "1.0.0", .lowest_wire = 5, .highest_wire = 5};
  EXPECT_TRUE(is_healthy(sut()));
  add_program(3, "later").version = {.version = "2.0.0", .lowest_wire = 6, .highest_wire = 7};
  EXPECT_THAT(sut(),
              Contains(is(Severity::problem,
                          "gateway on host-gateway, pid 17 understands wire version 5 (millrace "
                          "1.0.0), not 6-7 (millrace 2.0.0) of later on host-later, pid 17",
                          "upgrade gateway on host-gateway, pid 17")));
  EXPECT_THAT(sut(), Not(Contains(is(Severity::problem, "doctor on host-doctor"))));
  EXPECT_THAT(sut(), Not(Contains(is(Severity::problem, "sq1 on host-sq1"))));
  found.programs.back().fabrics = {"hall-2"};
  EXPECT_TRUE(is_healthy(sut()));
}

TEST_F(TheDoctor, ComparesClocksOnlyWithinTheirError) {
  add_healthy_plant();
  const auto with = [&](std::chrono::nanoseconds ahead, std::chrono::nanoseconds error) {
    found.clocks = {{"hall", "sq1", {ahead, error}}};
    return sut();
  };
  EXPECT_THAT(with(1ms, 1ms), Contains(is(Severity::fine, "the clock of hall is 1.00 ms ahead")));
  EXPECT_THAT(with(150ms, 100ms), Contains(is(Severity::fine, "± 100 ms")));
  EXPECT_THAT(with(-3s, 1ms), Contains(is(Severity::warning, "3.00 s behind", "NTP")));
  EXPECT_THAT(with(60s, 1ms), Contains(is(Severity::problem, "1m00s ahead", "NTP")));
}

TEST_F(TheDoctor, SeparatesTheDifferenceOfAClockFromItsError) {
  found.clocks = {{"hall", "sq1", {1500ms, 2ms}}};
  const auto clock = json_of(found, {}).at("clocks").at(0);
  EXPECT_EQ(clock.at("ahead_ms"), 1500.0);
  EXPECT_EQ(clock.at("error_ms"), 2.0);
}

TEST_F(TheDoctor, ReportsTheAlarmsOfProcesses) {
  add_healthy_plant();
  fabric::Alarm alarm{.key = {.kind = "recording"},
                      .level = fabric::AlarmLevel::fine,
                      .text = "records to run.mcap",
                      .program = "millrace record",
                      .host = "vm",
                      .pid = 17};
  add_alarm(alarm);
  EXPECT_THAT(sut(),
              Contains(is(Severity::fine, "millrace record on vm, pid 17: records to run.mcap")));
  EXPECT_TRUE(is_healthy(sut()));
  alarm.key.kind = "disk";
  alarm.level = fabric::AlarmLevel::warning;
  alarm.text = "the disk is nearly full";
  alarm.advice = "make room";
  add_alarm(alarm);
  EXPECT_THAT(sut(), Contains(is(Severity::warning, "the disk is nearly full", "make room")));
  EXPECT_TRUE(is_healthy(sut()));
  alarm.key.kind = "archive";
  alarm.level = fabric::AlarmLevel::problem;
  alarm.text = "cannot be written: disk full";
  add_alarm(alarm);
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "cannot be written: disk full")));
  EXPECT_FALSE(is_healthy(sut()));
}

TEST_F(TheDoctor, CountsAnUnknownLevelAsAProblem) {
  add_healthy_plant();
  add_alarm({.level = static_cast<fabric::AlarmLevel>(9), .text = "of tomorrow"});
  EXPECT_THAT(sut(), Contains(is(Severity::problem, "of tomorrow")));
}

}  // namespace
}  // namespace millrace::tools::doctor
