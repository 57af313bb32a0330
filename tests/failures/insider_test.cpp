// A participant that says what is not its to say, on an open fabric and, with a certificate of
// another role, on one with trust: every call gets its own answer, none waits for ever, no memory
// is filled, and the log names who it was.
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include <arpa/inet.h>
#include <boost/asio/io_context.hpp>
#include <netinet/in.h>
#include <sys/socket.h>

#include "base/posix/fd.hpp"
#include "fabric/ends/notice_end.hpp"
#include "fabric/profile/profile.hpp"
#include "fabric/request_key.hpp"
#include "fabric/wire/notice_codec.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/cluster/history/execution_log.hpp"
#include "tests/failures/hostile_line.hpp"

namespace millrace::tests::failures {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::Each;
using testing::Field;

const testing::Environment* const network = testing::AddGlobalTestEnvironment(new Network);

/// Asks instances whatever it likes.
class Asker {
 public:
  explicit Asker(const dds::ParticipantOptions& join)
      : participant_(join),
        requests_(participant_, wire::all_services("millrace"), wire::Keep::all) {}

  /// What a gateway asked last; nothing yet.
  const std::optional<Request>& overhear() {
    for (const wire::Taken<Request>& taken : requests_.take()) {
      if (taken.valid && taken.value.key.machine == "cnc" && taken.value.text != "wrong" &&
          !is_withdrawal(taken.value)) {
        last_ = taken.value;
        instances_.insert(taken.value.assigned);
      }
    }
    return last_;
  }
  [[nodiscard]] const std::set<InstanceId>& instances() const { return instances_; }

  void ask(const Request& request) { ask(request, request.uuid); }
  /// With a sample, as a gateway does, and without.
  void take_back(const Request& request) {
    ask(withdrawal_of(key_of(request)), request.uuid);
    mailbox(request.uuid, request.assigned).withdraw(request);
  }

 private:
  void ask(const Request& request, const std::string& uuid) {
    static_cast<void>(mailbox(uuid, request.assigned).write(request));
  }
  wire::Writer<Request>& mailbox(const std::string& uuid, const InstanceId& instance) {
    return mailboxes_
        .try_emplace(instance, participant_, wire::mailbox_partition("millrace", uuid, instance))
        .first->second;
  }

  dds::Participant participant_;
  wire::Reader<Request> requests_;
  std::map<InstanceId, wire::Writer<Request>> mailboxes_;
  std::set<InstanceId> instances_;
  std::optional<Request> last_;
};

/// How many calls of a printed recording were taken back before their answer was written. After it
/// a gateway takes back itself what is not followed by another call.
int withdrawn_before_written(const std::string& log) {
  std::set<std::string> written;
  int count = 0;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string time;
    std::string kind;
    std::string channel;
    std::string call;
    std::string what;
    words >> time >> kind >> channel >> call >> what;
    if (kind == "event" && what == "written") {
      written.insert(call);
    } else if (kind == "withdrawal" && !written.contains(call)) {
      ++count;
    }
  }
  return count;
}

class AnInsider : public AHostileParticipant, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    AHostileParticipant::SetUp();
    if (IsSkipped() || !with_trust()) {
      return;
    }
    chain.with_trust({slow_uuid}, GetParam());
    chain.trust().run({"issue", "PLANT", "bench", "--role", "tester"});
    chain.trust().run({"issue", "PLANT", "gateway-2", "--role", "gateway", "--machine", "other"});
    chain.trust().run({"issue", "PLANT", "screen", "--role", "observer"});
  }

  [[nodiscard]] static bool with_trust() { return GetParam() != "Open"; }

  /// As this member, where there is trust.
  [[nodiscard]] dds::ParticipantOptions join(const std::string& member) const {
    dds::ParticipantOptions options;
    if (with_trust()) {
      options = profile::read_profile(chain.trust().profile(member)).value();
    }
    options.domain = chain.domain();
    return options;
  }
  /// With its certificate, but without showing what that lets it be.
  [[nodiscard]] dds::ParticipantOptions join_without_badge(const std::string& member) const {
    dds::ParticipantOptions options = join(member);
    options.trust.reset();
    return options;
  }

  /// Calls go on beside what it does, 2,000 times a second: instances of this delivery start once
  /// it has begun. `as`: all participants of a process are the same member.
  void attack(const dds::ParticipantOptions& as, const std::function<void(std::size_t)>& act,
              const std::string& delivery = "at-least-once") {
    Stopwatch watch(as);
    Flood flood(2000, [&](std::size_t i) {
      act(i);
      if (i % 64 == 0) {
        watch.take();
      }
    });
    await(
        "the attack", [&] { return flood.done() > 0; }, allowed);
    start_services(delivery);
    std::vector<double> before;
    for (Process& service : services) {
      before.push_back(bench::resident_mib(service.pid()));
    }
    expect_calls_unharmed();
    flood.end();
    std::cout << "beside " << flood.done() << " hostile samples: " << watch.result() << '\n';
    EXPECT_GT(flood.done(), 100U);
    for (std::size_t i = 0; i < services.size(); ++i) {
      const double grown = bench::resident_mib(services[i].pid()) - before[i];
      EXPECT_TRUE(bench::keeps_what_is_freed || grown < 16.0) << grown << " MiB";
    }
  }

  [[nodiscard]] std::string said_by_services() const {
    std::string said;
    for (const Process& service : services) {
      said += service.error_output();
    }
    return said;
  }

  void expect_each_ran_once() const {
    EXPECT_THAT(cluster::read_executions(chain.record()),
                Each(Field(&cluster::Execution::attempt, 1)));
  }
};

// 54 of 224, 1,716 of 5,096, 2,346 of 4,838 calls got the answer to something else.
TEST_P(AnInsider, AsksUnderTheIdsOfCallsToComeAndEveryAnswerIsRight) {
  prepare();
  const auto as = join("bench");
  Asker sut(as);
  attack(as, [&](std::size_t i) {
    if (const auto& heard = sut.overhear()) {
      for (const InstanceId& instance : sut.instances()) {
        Request request = *heard;
        request.assigned = instance;
        request.call.number += i % 8;
        request.text = "wrong";
        sut.ask(request);
      }
    }
  });
  EXPECT_THAT(said_by_services(),
              HasSubstr(with_trust() ? "bench speaks for cnc, which its certificate does not name"
                                     : ", in which another one has asked"));
}

// One call in 2.5 s, or none, instead of 1,100 a second.
TEST_P(AnInsider, AsksForAMachineOfItsOwnUnderTheIdsOfOursAndNoneIsBlocked) {
  prepare();
  const auto as = join("gateway-2");
  Asker sut(as);
  attack(as, [&](std::size_t i) {
    if (const auto& heard = sut.overhear()) {
      Request request = *heard;
      request.key.machine = "other";
      request.call.number += i % 8;
      // It has the same text as ours, so that only the machine tells them apart.
      request.text = std::to_string(std::stoul(heard->text) + i % 8);
      sut.ask(request);
    }
  });
}

TEST_P(AnInsider, TakesBackWhatAGatewayHasAskedAndEveryCallGoesOn) {
  prepare();
  const auto as = join("gateway-2");
  Asker sut(as);
  attack(
      as,
      [&](std::size_t) {
        if (const auto& heard = sut.overhear()) {
          sut.take_back(*heard);
        }
      },
      "at-most-once");
  expect_each_ran_once();
  EXPECT_THAT(
      said_by_services(),
      HasSubstr(with_trust() ? "gateway-2 speaks for cnc, which its certificate does not name"
                             : "takes back a call of"));
}

/// On an open fabric nobody shows a badge.
class AnInsiderWithACertificate : public AnInsider {};

// Gateway and instance believed it more than one that shows who it is.
TEST_P(AnInsiderWithACertificate, WithoutABadgeTakesNothingBack) {
  prepare();
  const auto as = join_without_badge("gateway-2");
  Asker sut(as);
  attack(
      as,
      [&](std::size_t) {
        if (const auto& heard = sut.overhear()) {
          sut.take_back(*heard);
        }
      },
      "at-most-once");
  expect_each_ran_once();
  const std::string unproven =
      "a program that shows no badge of its certificate \\(participant "
      "[0-9a-f:]+\\): what it says on millrace/v3/request is not listened";
  services.front().await_error(unproven);
}

// A standby gateway took the machine over from one that was there.
TEST_P(AnInsider, SaysThatAGatewayIsGoneAndNobodyTakesItsMachine) {
  prepare();
  Process second = chain.gateway();
  second.await_error("serves it already; this gateway stands by", allowed);
  const auto as = join_without_badge("gateway-2");
  dds::Participant participant(as);
  wire::Reader<MachineStatus> heard(participant, "millrace", wire::Keep::last);
  wire::Writer<MachineStatus> sut(participant, "millrace");
  std::map<InstanceId, MachineStatus> known;
  attack(as, [&](std::size_t) {
    for (const wire::Taken<MachineStatus>& taken : heard.take()) {
      if (taken.valid) {
        known.insert_or_assign(taken.value.gateway, taken.value);
      }
    }
    for (const auto& [id, status] : known) {
      sut.withdraw(status);
    }
  });
  EXPECT_THAT(second.error_output(), Not(HasSubstr("taken over")));
}

// "FORGED" was what `millrace retry` printed.
TEST_P(AnInsider, SaysWhatCameOfACommandThatWasForAnotherAndIsNotBelieved) {
  start(2);
  dds::Participant participant(join("service"));
  wire::Reader<Command> heard(participant, "millrace", wire::Keep::all);
  wire::Writer<Outcome> sut(participant, "millrace");
  const Flood flood(1000, [&](std::size_t) {
    for (const wire::Taken<Command>& taken : heard.take()) {
      static_cast<void>(sut.write({.responder = InstanceId::random(),
                                   .command = taken.value.id,
                                   .done = true,
                                   .detail = "FORGED"}));
    }
  });
  std::string said;
  for (int i = 0; i < 5; ++i) {
    Process retry = chain.millrace({"retry", "cnc/1"});
    retry.wait(allowed);
    EXPECT_THAT(retry.output() + retry.error_output(), Not(HasSubstr("FORGED")));
    said += retry.error_output();
    Process health = chain.millrace({"health"});
    EXPECT_EQ(health.wait(allowed), 0) << health.error_output();
    EXPECT_THAT(health.output() + health.error_output(), Not(HasSubstr("FORGED")));
    said += health.error_output();
  }
  EXPECT_THAT(said, testing::ContainsRegex("participant [0-9a-f:]+ says what came of a command"));
}

TEST_P(AnInsider, TellsOfCallsAndMachinesOfAGatewayAndNoRecordingHasIt) {
  prepare();
  const std::string file = (chain.folder() / "run.mcap").string();
  Process recorder = chain.millrace({"record", "-o", file});
  recorder.await("^ready: ");
  const auto as = join("gateway-2");
  Asker asker(as);
  dds::Participant participant(as);
  wire::Reader<MachineStatus> heard(participant, "millrace", wire::Keep::last);
  wire::Writer<MachineStatus> machines(participant, "millrace");
  wire::Writer<ChannelStatus> states(participant, "millrace");
  wire::Writer<Event> events(participant, "millrace");
  wire::Writer<Outcome> outcomes(participant, "millrace");
  attack(as, [&](std::size_t i) {
    for (wire::Taken<MachineStatus>& taken : heard.take()) {
      if (taken.valid && taken.value.reason != "FORGED") {
        taken.value.reason = "FORGED";
        static_cast<void>(machines.write(taken.value));
      }
    }
    if (const auto& asked = asker.overhear(); asked && i % 8 == 0) {
      static_cast<void>(states.write({.key = asked->key, .reason = "FORGED"}));
      static_cast<void>(events.write({.key = asked->key,
                                      .call = asked->call,
                                      .kind = EventKind::withdrawn,
                                      .uuid = asked->uuid,
                                      .detail = "FORGED"}));
      static_cast<void>(
          outcomes.write({.responder = asked->assigned, .done = true, .detail = "FORGED"}));
      asker.take_back(*asked);
    }
  });
  recorder.terminate();
  EXPECT_EQ(recorder.wait(allowed), 0);
  Process print = chain.millrace({"log", "cat", file});
  EXPECT_EQ(print.wait(allowed), 0) << print.error_output();
  EXPECT_THAT(print.output(), HasSubstr("written"));
  EXPECT_THAT(print.output(), Not(HasSubstr("FORGED")));
  EXPECT_THAT(print.output(), Not(HasSubstr("withdrawn")));
  // Of 400 calls. A recorder on a busy host may come late to the events of one that was over.
  EXPECT_LT(withdrawn_before_written(print.output()), 8);
  if (!with_trust()) {
    EXPECT_THAT(recorder.error_output(), HasSubstr(", which is another's to say: that is ignored"));
  }
}

TEST_P(AnInsider, ChangesNoNoticeOfAnotherAndSpeaksInItsOwnName) {
  start(2);
  boost::asio::io_context io;
  dds::Participant honest(join("screen"));
  ends::NoticeEnd end(honest, io.get_executor(), {.program = "recorder", .host = "hall", .pid = 7});
  ASSERT_TRUE(end.raise({.key = {.kind = "archive"}, .text = "the disk is full"}));
  dds::Participant participant(join("screen"));
  wire::Reader<Notice> heard(participant, "millrace", wire::Keep::last);
  wire::Writer<Notice> sut(participant, "millrace");
  Notice notice;
  await("the notice", [&] {
    for (const wire::Taken<Notice>& taken : heard.take()) {
      if (taken.valid && taken.value.key.kind == "archive") {
        notice = taken.value;
      }
    }
    return !notice.text.empty();
  });
  const Flood flood(200, [&](std::size_t) {
    notice.text = "all is lost";
    static_cast<void>(sut.write(notice));
    Notice of_its_own{.key = {.responder = notice.key.responder, .kind = "made_up"},
                      .text = "no such trouble",
                      .program = "recorder",
                      .host = "hall"};
    static_cast<void>(sut.write(of_its_own));
    io.poll();
  });
  await("the flood", [&] { return flood.done() > 50; });
  Process doctor = chain.millrace({"doctor"});
  doctor.wait(allowed);
  const std::string said = doctor.output();
  EXPECT_THAT(said, HasSubstr("the disk is full"));
  EXPECT_THAT(said, HasSubstr("no such trouble"));
  if (with_trust()) {
    EXPECT_THAT(said, HasSubstr("screen (recorder)"));
  }
}

// 16 → 130 MB in 10 s.
TEST_P(AnInsider, BeatsForEverNewProcessesAndFillsNoMemory) {
  start(2);
  dds::Participant participant(join("service"));
  wire::Writer<Beat> sut(participant, "millrace");
  await("who hears it", [&] { return !sut.matched().empty(); });
  const double before = bench::resident_mib(gateway->pid());
  for (int i = 0; i < 60'000; ++i) {
    static_cast<void>(sut.write({.member = InstanceId::random()}));
    if (i % 64 == 0) {
      std::this_thread::yield();
    }
  }
  gateway->await_error("participant [0-9a-f:]+ beats for more than 4 processes", allowed);
  Process ping = chain.millrace({"health"});
  EXPECT_EQ(ping.wait(allowed), 0) << ping.error_output();
  const double after = bench::resident_mib(gateway->pid());
  std::cout << fmt::format("the gateway's memory before and after: {:.1f}, {:.1f} MiB\n", before,
                           after);
  EXPECT_TRUE(bench::keeps_what_is_freed || after - before < 8.0);
}

TEST_P(AnInsider, TellsOfEverNewOutcomesAndNoticesAndFillsNoMemory) {
  start(2);
  Process recorder = chain.millrace({"record", "-o", (chain.folder() / "run.mcap").string()});
  recorder.await("^ready: ");
  dds::Participant participant(join("service"));
  wire::Writer<Outcome> outcomes(participant, "millrace");
  wire::Writer<Notice> notices(participant, "millrace");
  await("who hears it", [&] { return !outcomes.matched().empty() && !notices.matched().empty(); });
  const double before = bench::resident_mib(recorder.pid());
  for (int i = 0; i < 60'000; ++i) {
    static_cast<void>(outcomes.write({.responder = InstanceId::random(), .done = true}));
    static_cast<void>(
        notices.write({.key = {.responder = InstanceId::random(), .kind = "archive"}}));
    if (i % 64 == 0) {
      std::this_thread::yield();
    }
  }
  recorder.await_error("tells of more than 1024 things on millrace/outcome", allowed);
  recorder.await_error("tells of more than 1024 things on millrace/notice", allowed);
  const double after = bench::resident_mib(recorder.pid());
  std::cout << fmt::format("the recorder's memory before and after: {:.1f}, {:.1f} MiB\n", before,
                           after);
  EXPECT_TRUE(bench::keeps_what_is_freed || after - before < 16.0);
  recorder.terminate();
  EXPECT_EQ(recorder.wait(allowed), 0);
}

/// Sends announcements of participants that it has recorded, with GUIDs of its own, from an address
/// that is no host's.
class AReplayer : public AHostileParticipant {
 protected:
  /// The rule that docs/trust.md prints, for hosts of one address on loopback.
  static std::string documented_rule() {
    std::ifstream page(MILLRACE_SOURCE "/docs/trust.md");
    std::string rule;
    for (std::string line; std::getline(page, line);) {
      const bool begins = line == "    table inet millrace {";
      if (begins || !rule.empty()) {
        rule += line.substr(4) + '\n';
      }
      if (!rule.empty() && line == "    }") {
        break;
      }
    }
    rule = std::regex_replace(rule, std::regex("\"eth0\""), "\"lo\"");
    return std::regex_replace(rule, std::regex("elements = \\{[^}]*\\}"),
                              "elements = { 127.0.0.1 }");
  }

  void filter_packets() const {
    const std::filesystem::path file = chain.folder() / "millrace.nft";
    std::ofstream(file) << documented_rule();
    Process nft({"/usr/sbin/nft", "-f", file});
    ASSERT_EQ(nft.wait(allowed), 0) << nft.error_output();
  }

  [[nodiscard]] std::uint16_t port() const {
    return static_cast<std::uint16_t>(7400 + 250 * chain.domain());
  }

  static sockaddr_in address(const char* host, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    ::inet_pton(AF_INET, host, &address.sin_addr);
    return address;
  }

  /// An announcement as it comes.
  [[nodiscard]] std::string record() const {
    const base::posix::Fd in(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const int yes = 1;
    ::setsockopt(in.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    ::setsockopt(in.get(), SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes);
    const sockaddr_in group = address("239.255.0.1", port());
    EXPECT_EQ(::bind(in.get(), reinterpret_cast<const sockaddr*>(&group), sizeof group), 0);
    ip_mreq join{};
    join.imr_multiaddr = group.sin_addr;
    ::inet_pton(AF_INET, "127.0.0.1", &join.imr_interface);
    EXPECT_EQ(::setsockopt(in.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &join, sizeof join), 0);
    std::string packet(65'536, 0);
    const auto size = ::recv(in.get(), packet.data(), packet.size(), 0);
    packet.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return packet;
  }

  /// How much memory the gateway has gained beside them.
  double replay(std::size_t packets) {
    const std::string packet = record();
    constexpr std::size_t header = 8;
    constexpr std::size_t prefix_size = 12;
    const std::string prefix = packet.substr(header, prefix_size);
    const base::posix::Fd out(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const sockaddr_in own = address("127.0.0.66", 0);
    EXPECT_EQ(::bind(out.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
    ::setsockopt(out.get(), IPPROTO_IP, IP_MULTICAST_IF, &own.sin_addr, sizeof own.sin_addr);
    const sockaddr_in group = address("239.255.0.1", port());
    const double before = bench::resident_mib(gateway->pid());
    Flood flood(600, [&](std::size_t i) {
      std::string another = packet;
      std::string guid = prefix;
      std::memcpy(guid.data() + 4, &i, sizeof i);
      for (auto at = another.find(prefix); at != std::string::npos; at = another.find(prefix, at)) {
        another.replace(at, prefix_size, guid);
        at += prefix_size;
      }
      ::sendto(out.get(), another.data(), another.size(), 0,
               reinterpret_cast<const sockaddr*>(&group), sizeof group);
    });
    await(
        "the packets", [&] { return flood.done() >= packets; }, allowed);
    flood.end();
    return bench::resident_mib(gateway->pid()) - before;
  }
};

// Without the rule the gateway grows by 24 MiB.
TEST_F(AReplayer, IsKeptAwayByThePacketFilterOfTheManual) {
  start();
  filter_packets();
  const double grown = replay(1500);
  expect_calls_unharmed();
  std::cout << fmt::format("the gateway's memory has grown by {:.1f} MiB\n", grown);
  EXPECT_LT(grown, 8.0);
}

INSTANTIATE_TEST_SUITE_P(, AnInsider, testing::Values("Open", "SIGN", "ENCRYPT"),
                         [](const auto& fabric) { return fabric.param; });
INSTANTIATE_TEST_SUITE_P(, AnInsiderWithACertificate, testing::Values("SIGN", "ENCRYPT"),
                         [](const auto& fabric) { return fabric.param; });

}  // namespace
}  // namespace millrace::tests::failures
