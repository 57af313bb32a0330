// A fabric with trust, on which a participant tries to exceed its rights: a gateway acts for the
// machines in its certificate, and a revoked participant loses its trust even while it is
// connected.
#include "fabric/registry/identity.hpp"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>

#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/profile/profile.hpp"
#include "fabric/request_key.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/integration/trusted_chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
namespace wire = fabric::wire;

class IdentityTest : public testing::Test {
 protected:
  void SetUp() override {
    sut.set_up_plant();
    sut.trust({"issue", sut.plant(), "slow", "--role", "service", "--uuid", root_uuid});
    sut.trust({"issue", sut.plant(), "gateway-2", "--role", "gateway", "--machine", "press_9"});
  }

  /// Joins as a process of this test does.
  [[nodiscard]] fabric::dds::ParticipantOptions join(const std::string& holder) const {
    auto options = fabric::profile::read_profile(sut.as(holder).at(1)).value();
    options.domain = sut.domain();
    return options;
  }

  /// The same with a modified plugin, which allows any endpoint.
  [[nodiscard]] fabric::dds::ParticipantOptions join_unchecked(const std::string& holder) const {
    auto options = join(holder);
    const std::string library = "libdds_security_ac.so";
    const auto at = options.configuration.find(library);
    const auto begin = options.configuration.rfind('"', at) + 1;
    const std::string real = options.configuration.substr(begin, at + library.size() - begin);
    EXPECT_EQ(::setenv("MILLRACE_TEST_ACCESS_CONTROL", real.c_str(), 1), 0);
    options.configuration.replace(begin, real.size(), MILLRACE_CARELESS_ACCESS_CONTROL);
    return options;
  }

  static fabric::MachineStatus claim(const std::string& machine) {
    return {.machine = machine,
            .gateway = fabric::InstanceId::random(),
            .claimed = std::chrono::sys_days{std::chrono::year{2021} / 1 / 1},
            .connected = true,
            .host = "elsewhere",
            .version = "1",
            .epoch = 77};
  }

  TrustedChain sut;
};

TEST_F(IdentityTest, AGatewayDoesNotStartForAMachineThatItsCertificateDoesNotName) {
  Process cnc = sut.cnc();
  Flags command{binary("millrace-gateway"), "--machine",
                "cnc=127.0.0.1:" + std::to_string(sut.port()) + "/127.0.0.1.1.1", "--domain",
                std::to_string(sut.domain())};
  const Flags who = sut.as("gateway-2");
  command.insert(command.end(), who.begin(), who.end());
  Process gateway(command);
  EXPECT_EQ(gateway.wait(), 2);
  EXPECT_THAT(gateway.error_output(),
              AllOf(HasSubstr("does not name the machine cnc"), HasSubstr("(gateway-2)")));
  // The check is about the file; an administrator runs it without the credentials of the unit.
  command.emplace_back("--check");
  Process check(std::move(command));
  EXPECT_EQ(check.wait(), 0) << check.error_output();
}

// A queue's calls are those of a machine with the name "cnc.ALARMS".
TEST_F(IdentityTest, AnIdentityOfAMachineCountsForItsMessageQueues) {
  const fs::path config = sut.folder() / "cnc.textproto";
  std::ofstream(config) << "system_data { name: \"ALARMS\" type: STRING elements: 3 }\n"
                           "system_data { name: \"CONTROL\" member { name: \"LastFilled\" } "
                           "member { name: \"LastGet\" } }\n";
  Flags flags = sut.as("slow");
  flags.insert(flags.end(), {"--uuid", root_uuid});
  Process service = sut.slow_service(flags);
  Process cnc = sut.cnc(
      {"--config", config.string(), "--run", Chain::program(1, "messages.nc"), "--exit-when-idle"});
  Flags of_gateway = sut.as("gateway-1");
  of_gateway.insert(of_gateway.end(), {"--log-level", "debug"});
  Process gateway = sut.configured_gateway(
      fmt::format(
          "machine {{ name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: "
          "\"127.0.0.1.1.1\" queue {{ name: \"ALARMS\" control: \"SD.CONTROL\" uuid: \"{}\" "
          "}} }}\njournal {{ folder: \"{}\" }}\n",
          root_uuid, (sut.folder() / "journal").string()),
      of_gateway);
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output() << gateway.error_output();
  gateway.await_error("call .* answered with state");
  EXPECT_THAT(gateway.error_output() + service.error_output(), Not(HasSubstr("does not name")));
}

TEST_F(IdentityTest, AMachineIsNotTakenOverByAnUnauthorizedGateway) {
  Process service = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  fabric::dds::Participant participant(join("gateway-2"));
  wire::Writer<fabric::MachineStatus> machines(participant, "millrace");
  ASSERT_TRUE(machines.write(claim("cnc")));
  ASSERT_TRUE(machines.write(claim("press_9")));
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("gateway-2 speaks for cnc, which its certificate does not name");
  cnc.await("response = 1.732051");
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  const std::string seen = sut.ask({"machines"}, sut.as("screen"));
  EXPECT_THAT(seen, HasSubstr("press_9"));
  EXPECT_EQ(seen.find("elsewhere"), seen.rfind("elsewhere")) << seen;
  Flags doctor{"doctor", "--all"};
  const Flags who = sut.as("screen");
  doctor.insert(doctor.end(), who.begin(), who.end());
  Process report = sut.millrace(std::move(doctor));
  report.wait();
  EXPECT_THAT(report.output() + report.error_output(),
              AllOf(HasSubstr("gateway-2 speaks for cnc, which its certificate does not name"),
                    HasSubstr("gateway-1 as gateway of cnc"), HasSubstr("square-root as service")));
}

TEST_F(IdentityTest, AnInstanceDeclinesRequestsOfAGatewayForAnotherMachine) {
  Process service = sut.square_root(sut.as("square-root"));
  fabric::dds::Participant participant(join("gateway-2"));
  boost::asio::io_context io;
  const auto work = boost::asio::make_work_guard(io);
  struct Listener : fabric::observer::ObserverListener {
    void on_entry(fabric::observer::Entry entry) override {
      if (const auto* news = std::get_if<fabric::observer::InstanceNews>(&entry.sample)) {
        instance = news->identity;
      }
    }
    fabric::InstanceIdentity instance;
  } listener;
  const fabric::observer::Observer observer(participant, io.get_executor(), listener,
                                            fabric::observer::Interest::states);
  await("the instance", [&] {
    io.poll();
    return !listener.instance.uuid.empty();
  });
  EXPECT_EQ(listener.instance.certificate, "square-root");
  wire::Writer<fabric::Request> requests(
      participant, wire::request_partition("millrace", root_uuid, listener.instance.id));
  wire::Reader<fabric::Reply> replies(participant, wire::service_partition("millrace", root_uuid),
                                      wire::Keep::all);
  await("the partition", [&] { return !requests.matched().empty(); });
  const auto ask = [&](const std::string& machine, std::uint64_t number) {
    EXPECT_TRUE(requests.write({.key = {machine, 1},
                                .call = {77, number},
                                .assigned = listener.instance.id,
                                .uuid = root_uuid,
                                .text = "4",
                                .state = 1}));
    fabric::Reply reply;
    await("a reply to " + machine, [&] {
      for (const auto& taken : replies.take()) {
        if (taken.valid && taken.value.call.number == number) {
          reply = taken.value;
        }
      }
      return reply.call.number == number;
    });
    return reply;
  };
  EXPECT_EQ(ask("press_9", 1).kind, fabric::ReplyKind::final);
  EXPECT_EQ(ask("cnc", 2).kind, fabric::ReplyKind::declined);
  service.await_error("gateway-2 speaks for cnc, which its certificate does not name");
}

TEST_F(IdentityTest, RequestsOfATesterAreAlwaysMarkedAsReplayed) {
  Process service = sut.square_root(sut.as("square-root"));
  fabric::dds::Participant participant(join("screen"));
  boost::asio::io_context io;
  const auto work = boost::asio::make_work_guard(io);
  struct Listener : fabric::observer::ObserverListener {
    void on_entry(fabric::observer::Entry entry) override {
      if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
        requests.push_back(*request);
      }
    }
    std::vector<fabric::Request> requests;
  } listener;
  const fabric::observer::Observer observer(participant, io.get_executor(), listener,
                                            fabric::observer::Interest::everything);
  // A short-lived instance may be gone before the observer has authenticated it.
  await("the request", [&] {
    EXPECT_THAT(sut.ask({"call", root_uuid, "2"}, sut.as("bench")), HasSubstr("1.414214"));
    io.poll();
    return !listener.requests.empty();
  });
  EXPECT_TRUE(listener.requests.front().replayed);
}

// Its own plugin lets it publish any identity; those of the others reject it.
TEST_F(IdentityTest, AnIdentityThatTheCertificateDoesNotAllowIsIgnored) {
  Process service = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  auto options = join_unchecked("gateway-2");
  auto trust = *options.trust;
  trust.identity_partitions = fabric::identity_partitions(
      "millrace", {.name = "gateway-1", .roles = {"gateway"}, .machines = {"cnc", "press_9"}});
  options.trust = std::make_shared<const fabric::dds::Trust>(trust);
  fabric::dds::Participant participant(options);
  wire::Writer<fabric::MachineStatus> machines(participant, "millrace");
  ASSERT_TRUE(machines.write(claim("cnc")));
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error(
      "a process that announces no identity \\(participant [0-9a-f:]+\\): its samples on "
      "millrace/v5/machine are ignored");
  cnc.await("response = 1.732051");
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
}

// The writers enforce this, whatever the reader's own DDS allows.
TEST_F(IdentityTest, AServiceReadsNoPartitionOfAnotherUuid) {
  const std::string another = "00000000-0000-4000-8000-000000000002";
  sut.trust({"issue", sut.plant(), "another", "--role", "service", "--uuid", another});
  {
    fabric::dds::Participant honest(join("slow"));
    EXPECT_THAT(
        [&] {
          const wire::Reader<fabric::Request> spy(honest, "millrace/" + another + "/*",
                                                  wire::Keep::all);
        },
        testing::ThrowsMessage<std::runtime_error>(
            AllOf(HasSubstr("may not read millrace/v5/request"), HasSubstr(another))));
  }
  Flags flags = sut.as("another");
  // Enough time for a handshake between the caller and the observer.
  flags.insert(flags.end(), {"--uuid", another, "--work", "3000"});
  Process service = sut.slow_service(flags);
  const auto requests_seen_by = [&](const std::string& holder) {
    fabric::dds::Participant careless(join_unchecked(holder));
    wire::Reader<fabric::Request> spy(careless, wire::all_services("millrace"), wire::Keep::all);
    EXPECT_THAT(sut.ask({"call", another, "a secret recipe"}, sut.as("bench")),
                HasSubstr("a secret recipe"));
    return spy.take().size();
  };
  // Otherwise no request could have been seen at all.
  EXPECT_GT(requests_seen_by("office"), 0U);
  EXPECT_EQ(requests_seen_by("slow"), 0U);
}

/// A service of another UUID, which announces an instance that it has no permission for. Only its
/// own process lets it: everyone else's DDS refuses the matches.
class FalseInstance {
 public:
  FalseInstance(const fabric::dds::ParticipantOptions& join, const fabric::InstanceId& id)
      : participant_(join),
        requests_(participant_, wire::request_partition("millrace", root_uuid, id), wire::Keep::all,
                  {.user_data = fabric::registry::format_identity(
                       {.id = id, .uuid = root_uuid, .name = "false"})}),
        replies_(participant_, wire::service_partition("millrace", root_uuid),
                 {.user_data = fabric::registry::format_instance(id)}),
        commands_(participant_, "millrace", wire::Keep::all),
        outcomes_(participant_, "millrace"),
        thread_([this](const std::stop_token& over) {
          while (!over.stop_requested()) {
            for (const auto& taken : commands_.take()) {
              static_cast<void>(outcomes_.write({.responder = taken.value.instance,
                                                 .command = taken.value.id,
                                                 .done = true,
                                                 .detail = "FORGED"}));
            }
            std::this_thread::sleep_for(1ms);
          }
        }) {}

 private:
  fabric::dds::Participant participant_;
  wire::Reader<fabric::Request> requests_;
  wire::Writer<fabric::Reply> replies_;
  wire::Reader<fabric::Command> commands_;
  wire::Writer<fabric::Outcome> outcomes_;
  std::jthread thread_;
};

// A regression: an announcement counted before DDS had checked the permission for it. After a
// restart of the gateway no call was answered while the false instance was there.
TEST_F(IdentityTest, AnAnnouncementWithoutPermissionTakesNoInstanceAway) {
  const std::string another = "00000000-0000-4000-8000-000000000002";
  sut.trust({"issue", sut.plant(), "another", "--role", "service", "--uuid", another});
  Process service = sut.square_root(sut.as("square-root"));
  const std::string id = service.await("serves \\S+ as (\\S+) on domain").at(1);
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc")});
  // The gateway discovers the false instance first, and then the true one.
  service.signal(SIGSTOP);
  const FalseInstance attacker(join_unchecked("another"), *fabric::InstanceId::parse(id));
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("link up");
  const auto status = [&](int expected) {
    return sut.ask({"status", "--expect-service", root_uuid + "=1"}, sut.as("screen"), expected);
  };
  EXPECT_THAT(status(1), HasSubstr("0 of 1 expected instances"));
  EXPECT_THAT(sut.ask({"drain", id, "--timeout", "2s"}, sut.as("office"), 1),
              Not(HasSubstr("FORGED")));
  service.signal(SIGCONT);
  cnc.await("response = 1.732051");
  status(0);
  EXPECT_THAT(sut.ask({"drain", id}, sut.as("office")), HasSubstr("leaves when the calls"));
}

// It joins, since its certificate is valid, but has no identity.
TEST_F(IdentityTest, AnInstanceOfAnEarlierVersionGetsNoCallsAndGatewayAndDoctorReportIt) {
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  auto options = join("square-root");
  options.trust.reset();
  fabric::dds::Participant participant(options);
  const fabric::InstanceIdentity old{
      .id = fabric::InstanceId::random(), .uuid = root_uuid, .name = "old"};
  const wire::Writer<fabric::Reply> replies(
      participant, wire::service_partition("millrace", root_uuid),
      {.user_data = fabric::registry::format_instance(old.id)});
  const wire::Reader<fabric::Request> requests(
      participant, wire::request_partition("millrace", root_uuid, old.id), wire::Keep::all,
      {.user_data = fabric::registry::format_identity(old)});
  Process gateway = sut.gateway(sut.as("gateway-1"));
  const std::string advice = "announces no identity.*`millrace trust renew`";
  gateway.await_error("instance " + old.id.to_string() + " of .* gets no calls.*" + advice);
  Flags doctor{"doctor", "--all"};
  const Flags who = sut.as("screen");
  doctor.insert(doctor.end(), who.begin(), who.end());
  Process report = sut.millrace(std::move(doctor));
  report.wait();
  EXPECT_THAT(report.output(), AllOf(HasSubstr("announces no identity"), HasSubstr("trust renew")));
  // Its name is free.
  Process service = sut.square_root(sut.as("square-root"));
  cnc.await("response = 1.732051");
}

TEST_F(IdentityTest, ARunningInstanceThatIsRevokedGetsNoCallsAndDisappears) {
  sut.trust({"issue", sut.plant(), "unlucky", "--role", "service", "--uuid", root_uuid});
  Process service = sut.square_root(sut.unaware("unlucky"));
  Process cnc = sut.cnc();
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("is ready: square_root.*trusted as unlucky");
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("screen")),
              AllOf(HasSubstr("CERTIFICATE"), HasSubstr("unlucky")));
  EXPECT_THAT(sut.ask({"services", "-i", "--json"}, sut.as("screen")),
              HasSubstr("\"certificate\":\"unlucky\""));

  fabric::dds::Participant participant(join("office"));
  boost::asio::io_context io;
  const auto work = boost::asio::make_work_guard(io);
  struct Listener : fabric::observer::ObserverListener {
    void on_entry(fabric::observer::Entry entry) override {
      if (const auto* news = std::get_if<fabric::observer::InstanceNews>(&entry.sample)) {
        there = news->change != fabric::observer::Change::gone;
      }
    }
    void on_ignored(const std::string& reason) override { ignored += reason + "\n"; }
    bool there = false;
    std::string ignored;
  } listener;
  const fabric::observer::Observer observer(participant, io.get_executor(), listener,
                                            fabric::observer::Interest::states);
  await("the instance", [&] {
    io.poll();
    return listener.there;
  });

  sut.trust({"revoke", sut.plant(), "unlucky"});
  const auto revoked = std::chrono::steady_clock::now();
  gateway.await_error("instance \\S+ gets no calls: the certificate of unlucky was revoked");
  gateway.await_error("instance \\S+ is gone");
  await("its end for an observer", [&] {
    io.poll();
    return !listener.there;
  });
  std::cout << "revocation noticed after "
            << std::chrono::duration<double>(std::chrono::steady_clock::now() - revoked).count()
            << " s\n";
  EXPECT_THAT(listener.ignored, HasSubstr("the certificate of unlucky was revoked"));
  // It still runs, and does not notice.
  EXPECT_TRUE(service.running());
  // Another one gets its name at once.
  Process other = sut.square_root(sut.as("square-root"));
  gateway.await_error("is ready: square_root.*trusted as square-root");
  EXPECT_THAT(sut.ask({"call", root_uuid, "2"}, sut.as("bench")), HasSubstr("1.414214"));
}

// A running program remembers what it has seen; a new one can only compare with what came with its
// certificate.
TEST_F(IdentityTest, AnOlderCrlRestoresNoCertificate) {
  sut.trust({"issue", sut.plant(), "unlucky", "--role", "service", "--uuid", root_uuid});
  Process service = sut.square_root(sut.unaware("unlucky"));
  Process cnc = sut.cnc();
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("is ready: square_root.*trusted as unlucky");
  const fs::path list = fs::path(sut.plant()) / "gateway-1/revoked.pem";
  fs::copy(list, sut.folder() / "older.pem");
  sut.trust({"revoke", sut.plant(), "unlucky"});
  gateway.await_error("instance \\S+ gets no calls: the certificate of unlucky was revoked");
  fs::copy(sut.folder() / "older.pem", list, fs::copy_options::overwrite_existing);
  gateway.await_error("does not list unlucky any more: an older CRL was copied over it");
  EXPECT_THAT(sut.ask({"call", root_uuid, "2", "--timeout", "2s"}, sut.as("bench"), 1),
              Not(HasSubstr("1.414214")));
  // Nor does a list that is older than a host's certificate.
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);
  sut.trust({"renew", sut.plant(), "gateway-1"});
  fs::copy(sut.folder() / "older.pem", list, fs::copy_options::overwrite_existing);
  Flags command{binary("millrace-gateway"), "--machine",
                "cnc=127.0.0.1:" + std::to_string(sut.port()) + "/127.0.0.1.1.1"};
  const Flags who = sut.as("gateway-1");
  command.insert(command.end(), who.begin(), who.end());
  Process again(std::move(command));
  EXPECT_EQ(again.wait(), 2);
  EXPECT_THAT(again.error_output(),
              AllOf(HasSubstr("revoked.pem: was made on"), HasSubstr("before the certificate")));
}

TEST_F(IdentityTest, RequestsOfARevokedGatewayAreIgnored) {
  Flags flags = sut.as("slow");
  flags.insert(flags.end(), {"--uuid", root_uuid});
  Process service = sut.slow_service(flags);
  Process cnc = sut.cnc({"--run", Chain::program(1, "endless_calls.nc")});
  sut.trust({"issue", sut.plant(), "gateway-3", "--role", "gateway", "--machine", "cnc"});
  Process gateway = sut.gateway(sut.unaware("gateway-3"));
  await("calls that are answered", [&] { return !content_of(sut.record()).empty(); });
  sut.trust({"revoke", sut.plant(), "gateway-3"});
  service.await_error(
      "the certificate of gateway-3 is revoked: its samples on millrace/v5/request");
  // By then its earlier actions are over; nothing new arrives.
  const std::string done = content_of(sut.record());
  gateway.await_error("does not read its requests");
  EXPECT_EQ(content_of(sut.record()), done);
}

// Also a gateway that does not know of its revocation.
TEST_F(IdentityTest, ARevokedGatewayCancelsNoCall) {
  sut.trust({"issue", sut.plant(), "gateway-3", "--role", "gateway", "--machine", "cnc"});
  Flags flags = sut.as("slow");
  flags.insert(flags.end(), {"--uuid", root_uuid, "--work", "4000"});
  Process service = sut.slow_service(flags);
  const auto id = fabric::InstanceId::parse(service.await("serves \\S+ as (\\S+) on domain").at(1));
  auto options = fabric::profile::read_profile(sut.unaware("gateway-3").at(1)).value();
  options.domain = sut.domain();
  fabric::dds::Participant participant(options);
  wire::Writer<fabric::Request> requests(participant,
                                         wire::request_partition("millrace", root_uuid, *id));
  wire::Reader<fabric::Reply> replies(participant, wire::service_partition("millrace", root_uuid),
                                      wire::Keep::all);
  await("the partition", [&] { return !requests.matched().empty(); });
  fabric::Request asked{.key = {"cnc", 1},
                        .call = {77, 1},
                        .assigned = *id,
                        .uuid = root_uuid,
                        .text = "4",
                        .state = 1};
  ASSERT_TRUE(requests.write(asked));
  await("its run", [&] { return !content_of(sut.record()).empty(); });
  sut.trust({"revoke", sut.plant(), "gateway-3"});
  await("the instance", [&] {
    asked.key.channel = 2;
    ++asked.call.number;
    EXPECT_TRUE(requests.write(asked));
    return service.error_output().find("the certificate of gateway-3 is revoked") !=
           std::string::npos;
  });
  ASSERT_TRUE(
      requests.write(fabric::withdrawal_of({.key = {"cnc", 1}, .epoch = 77, .instance = *id})));
  await("the answer", [&] {
    const auto taken = replies.take();
    return std::ranges::any_of(taken, [](const wire::Taken<fabric::Reply>& received) {
      return received.valid && received.value.call.number == 1 && received.value.text == "4";
    });
  });
}

TEST_F(IdentityTest, AMachineOfARevokedGatewayIsTakenOver) {
  sut.trust({"issue", sut.plant(), "gateway-3", "--role", "gateway", "--machine", "cnc"});
  Process service = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc();
  Process first = sut.gateway(sut.unaware("gateway-3"));
  first.await_error("link up");
  Process second = sut.gateway(sut.as("gateway-1"));
  second.await_error("serves this machine already; this gateway stands by");
  sut.trust({"revoke", sut.plant(), "gateway-3"});
  second.await_error("taken over");
  second.await_error("link up");
}

TEST_F(IdentityTest, ChannelStatesOfARevokedGatewayEnd) {
  sut.trust({"issue", sut.plant(), "gateway-3", "--role", "gateway", "--machine", "cnc"});
  Process cnc = sut.cnc();
  Process gateway = sut.gateway(sut.unaware("gateway-3"));
  fabric::dds::Participant participant(join("office"));
  boost::asio::io_context io;
  const auto work = boost::asio::make_work_guard(io);
  struct Listener : fabric::observer::ObserverListener {
    void on_entry(fabric::observer::Entry entry) override {
      if (auto* status = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
        last = std::move(*status);
      }
    }
    void on_ignored(const std::string&) override {}
    std::optional<fabric::ChannelStatus> last;
  } listener;
  const fabric::observer::Observer observer(participant, io.get_executor(), listener,
                                            fabric::observer::Interest::states);
  await("the channel", [&] {
    io.poll();
    return listener.last && listener.last->reason.empty();
  });
  sut.trust({"revoke", sut.plant(), "gateway-3"});
  await("that its gateway is gone", [&] {
    io.poll();
    return listener.last->reason == "its gateway is gone";
  });
}

// Whatever name it announces.
TEST_F(IdentityTest, ACommandHasTheIssuerOfTheCertificate) {
  Process service = sut.square_root(sut.as("square-root"));
  const auto id = fabric::InstanceId::parse(service.await("serves \\S+ as (\\S+) on domain").at(1));
  fabric::dds::Participant participant(join("office"));
  wire::Writer<fabric::Command> commands(participant, "millrace");
  await("a reader of commands", [&] { return !commands.matched().empty(); });
  ASSERT_TRUE(commands.write({.id = fabric::InstanceId::random(),
                              .kind = fabric::CommandKind::drain,
                              .instance = *id,
                              .issuer = "chief (boss@desk)"}));
  service.await_error("office \\(chief \\(boss@desk\\)\\) commands this instance to leave");
}

TEST_F(IdentityTest, ARevokedProcessReportsItAndEnds) {
  Process service = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc();
  Process gateway = sut.gateway(sut.as("gateway-1"));
  sut.trust({"revoke", sut.plant(), "square-root"});
  service.await_error("the certificate of square-root was revoked.*issue");
  EXPECT_EQ(service.wait(), 1);
  sut.trust({"revoke", sut.plant(), "gateway-1"});
  gateway.await_error("the certificate of gateway-1 was revoked");
  EXPECT_EQ(gateway.wait(), 1);
}

TEST_F(IdentityTest, AGatewayWhoseCertificateExpiresReportsItEndsAndRunsAgainWithNewCredentials) {
  const auto until = sut.shorten(
      {.name = "gateway-1", .roles = {fabric::trust::Role::gateway}, .machines = {"cnc"}}, 8s);
  Process service = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  {
    Process gateway = sut.gateway(sut.as("gateway-1"));
    cnc.await("response = 1.732051");
    gateway.await_error("the certificate of gateway-1 expired on .*`millrace trust renew`", 60s);
    EXPECT_GE(std::chrono::system_clock::now(), until);
    EXPECT_EQ(gateway.wait(), 1);
  }
  sut.trust({"renew", sut.plant(), "gateway-1"});
  Process cnc_again =
      sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway(sut.as("gateway-1"));
  cnc_again.await("response = 1.732051");
}

TEST_F(IdentityTest, AToolThatWatchesEndsWithItsCertificate) {
  sut.shorten({.name = "screen", .roles = {fabric::trust::Role::observer}}, 6s);
  Flags command{"record", "--output", (sut.folder() / "recording").string()};
  const Flags who = sut.as("screen");
  command.insert(command.end(), who.begin(), who.end());
  Process recorder = sut.millrace(std::move(command));
  recorder.await_error("the certificate of screen expired on", 60s);
  EXPECT_EQ(recorder.wait(), 1);
}

}  // namespace
}  // namespace millrace::tests::integration
