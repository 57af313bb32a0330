// A participant publishes samples that it has no right to, on an open fabric and, with a
// certificate of another role, on one with trust. Every call gets its own answer, none waits for
// ever, memory does not fill up, and the log names the participant.
#include <iostream>
#include <map>
#include <set>
#include <sstream>

#include <boost/asio/io_context.hpp>

#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/profile/profile.hpp"
#include "fabric/request_key.hpp"
#include "fabric/variables.hpp"
#include "fabric/wire/codec.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/cluster/history/execution_log.hpp"
#include "tests/failures/hostile.hpp"

namespace millrace::tests::failures {
namespace {

using testing::Each;
using testing::Field;

const testing::Environment* const network = testing::AddGlobalTestEnvironment(new Network);

/// Sends any request to instances.
class Requester {
 public:
  explicit Requester(const dds::ParticipantOptions& join)
      : participant_(join),
        requests_(participant_, wire::all_services("millrace"), wire::Keep::all) {}

  /// The last request of a gateway, if there is one.
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

  /// Its name in logs: the beginning of its GUID.
  [[nodiscard]] std::string name() const {
    dds_guid_t guid{};
    EXPECT_EQ(dds_get_guid(participant_.handle(), &guid), DDS_RETCODE_OK);
    return "participant " + dds::guid_prefix(guid);
  }

  void ask(const Request& request) { ask(request, request.uuid); }
  /// Withdraws with a sample, as a gateway does, and without one.
  void take_back(const Request& request) {
    ask(withdrawal_of(key_of(request)), request.uuid);
    requests_to(request.uuid, request.assigned).withdraw(request);
  }

 private:
  void ask(const Request& request, const std::string& uuid) {
    static_cast<void>(requests_to(uuid, request.assigned).write(request));
  }
  wire::Writer<Request>& requests_to(const std::string& uuid, const InstanceId& instance) {
    return request_writers_
        .try_emplace(instance, participant_, wire::request_partition("millrace", uuid, instance))
        .first->second;
  }

  dds::Participant participant_;
  wire::Reader<Request> requests_;
  std::map<InstanceId, wire::Writer<Request>> request_writers_;
  std::set<InstanceId> instances_;
  std::optional<Request> last_;
};

/// The number of calls in a printed recording that were withdrawn before their answer was written.
/// Afterwards the gateway itself withdraws each call that no other call follows.
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

/// The memory of these processes, and its growth.
class Memory {
 public:
  explicit Memory(std::vector<const Process*> of) : of_(std::move(of)) {
    for (const Process* const process : of_) {
      before_.push_back(bench::resident_mib(process->pid()));
    }
  }
  void expect_less_than(double most) const {
    for (std::size_t i = 0; i < of_.size(); ++i) {
      const double grown = bench::resident_mib(of_[i]->pid()) - before_[i];
      std::cout << fmt::format("memory: {:.1f} MiB, {:.1f} more\n", before_[i], grown);
      EXPECT_TRUE(bench::keeps_what_is_freed || grown < most);
    }
  }

 private:
  std::vector<const Process*> of_;
  std::vector<double> before_;
};

class AnInsider : public AHostileParticipant, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    AHostileParticipant::SetUp();
    if (IsSkipped() || !with_trust()) {
      return;
    }
    chain.with_trust({slow_uuid}, GetParam());
    chain.trust().run({"issue", "PKI", "bench", "--role", "tester"});
    chain.trust().run({"issue", "PKI", "gateway-2", "--role", "gateway", "--machine", "other"});
    chain.trust().run({"issue", "PKI", "screen", "--role", "observer"});
    chain.trust().run({"issue", "PKI", "panel", "--role", "observer"});
    chain.trust().run({"issue", "PKI", "desk", "--role", "operator"});
  }

  [[nodiscard]] static bool with_trust() { return GetParam() != "Open"; }

  /// This participant, where there is trust.
  [[nodiscard]] dds::ParticipantOptions join(const std::string& holder) const {
    dds::ParticipantOptions options;
    if (with_trust()) {
      options = profile::read_profile(chain.trust().profile(holder)).value();
    }
    options.domain = chain.domain();
    return options;
  }
  /// With its certificate, but without publishing the identity that goes with it.
  [[nodiscard]] dds::ParticipantOptions join_without_identity(const std::string& holder) const {
    dds::ParticipantOptions options = join(holder);
    options.trust.reset();
    return options;
  }

  /// As a separate participant: the other participants of this process are one.
  [[nodiscard]] dds::ParticipantOptions join_elsewhere(const std::string& holder) const {
    dds::ParticipantOptions options = join(holder);
    options.domain = elsewhere.number();
    options.configuration +=
        fmt::format("{}<Discovery><ExternalDomainId>{}</ExternalDomainId></Discovery>",
                    options.configuration.empty() ? "" : ",", chain.domain());
    return options;
  }

  /// Attacks `rate` times a second while calls run; instances with this delivery start once it has
  /// begun. `as`: all participants of a process are one participant. `beside`: further processes
  /// that receive the samples, in addition to the gateway and the instances.
  void attack(const dds::ParticipantOptions& as, const std::function<void(std::size_t)>& act,
              const std::string& delivery = "at-least-once",
              std::vector<const Process*> beside = {}, unsigned rate = 2000) {
    Stopwatch watch(as);
    Flood flood(rate, [&](std::size_t i) {
      act(i);
      if (i % 64 == 0) {
        watch.take();
      }
    });
    await(
        "the attack", [&] { return flood.done() > 0; }, allowed);
    start_services(delivery);
    beside.push_back(&*gateway);
    for (const Process& service : services) {
      beside.push_back(&service);
    }
    const Memory memory(beside);
    expect_calls_unharmed();
    flood.end();
    std::cout << "beside " << flood.done() << " hostile samples: " << watch.result() << '\n';
    EXPECT_GT(flood.done(), rate / 20);
    memory.expect_less_than(16.0);
  }

  [[nodiscard]] std::string service_logs() const {
    std::string logs;
    for (const Process& service : services) {
      logs += service.error_output();
    }
    return logs;
  }

  void expect_each_ran_once() const {
    EXPECT_THAT(cluster::read_executions(chain.record()),
                Each(Field(&cluster::Execution::attempt, 1)));
  }

  Domain elsewhere;
};

// Regressions: 54 of 224, 1,716 of 5,096 and 2,346 of 4,838 calls got the answer to another call.
TEST_P(AnInsider, RequestsUnderIdsOfFutureCallsAndEveryAnswerIsRight) {
  prepare();
  const auto as = join("bench");
  Requester sut(as);
  attack(as, [&](std::size_t i) {
    if (const auto& last_request = sut.overhear()) {
      for (const InstanceId& instance : sut.instances()) {
        Request request = *last_request;
        request.assigned = instance;
        request.call.number += i % 8;
        request.text = "wrong";
        sut.ask(request);
      }
    }
  });
  EXPECT_THAT(service_logs(),
              HasSubstr(with_trust() ? "bench speaks for cnc, which its certificate does not name"
                                     : sut.name() + " asks in"));
}

// A regression: at most one call in 2.5 s instead of 1,100 a second.
TEST_P(AnInsider, RequestsForItsOwnMachineUnderOurCallIdsAndNoCallIsBlocked) {
  prepare();
  const auto as = join("gateway-2");
  Requester sut(as);
  attack(as, [&](std::size_t i) {
    if (const auto& last_request = sut.overhear()) {
      Request request = *last_request;
      request.key.machine = "other";
      request.call.number += i % 8;
      // It has the same text as ours, so that only the machine distinguishes them.
      request.text = std::to_string(std::stoul(last_request->text) + i % 8);
      sut.ask(request);
    }
  });
}

TEST_P(AnInsider, CancelsRequestsOfAGatewayAndEveryCallContinues) {
  prepare();
  const auto as = join("gateway-2");
  Requester sut(as);
  attack(
      as,
      [&](std::size_t) {
        if (const auto& last_request = sut.overhear()) {
          sut.take_back(*last_request);
        }
      },
      "at-most-once");
  expect_each_ran_once();
  EXPECT_THAT(
      service_logs(),
      HasSubstr(with_trust() ? "gateway-2 speaks for cnc, which its certificate does not name"
                             : sut.name() + " cancels a call of"));
}

/// On an open fabric there are no identities.
class AnInsiderWithACertificate : public AnInsider {};

// A regression: gateway and instance trusted it more than a participant that shows its identity.
TEST_P(AnInsiderWithACertificate, WithoutAnIdentityCancelsNothing) {
  prepare();
  const auto as = join_without_identity("gateway-2");
  Requester sut(as);
  attack(
      as,
      [&](std::size_t) {
        if (const auto& last_request = sut.overhear()) {
          sut.take_back(*last_request);
        }
      },
      "at-most-once");
  expect_each_ran_once();
  const std::string unauthenticated =
      "a process that announces no identity \\(participant "
      "[0-9a-f:]+\\): its samples on millrace/v5/request are ignored";
  services.front().await_error(unauthenticated);
}

// A regression: a standby gateway took the machine over from a gateway that was running.
TEST_P(AnInsider, PublishesThatAGatewayIsGoneAndItsMachineIsNotTakenOver) {
  prepare();
  Process second = chain.gateway();
  second.await_error("serves this machine already; this gateway stands by", allowed);
  const auto as = join_without_identity("gateway-2");
  dds::Participant participant(as);
  wire::Reader<MachineStatus> machine_reader(participant, "millrace", wire::Keep::last);
  wire::Writer<MachineStatus> sut(participant, "millrace");
  std::map<InstanceId, MachineStatus> known;
  attack(
      as,
      [&](std::size_t) {
        for (const wire::Taken<MachineStatus>& taken : machine_reader.take()) {
          if (taken.valid) {
            known.insert_or_assign(taken.value.gateway, taken.value);
          }
        }
        for (auto& [id, status] : known) {
          sut.withdraw(status);
          status.claimed = {};
          static_cast<void>(sut.write(status));
        }
      },
      // Seldom, because on a busy host a gateway that is silent for its lease counts as gone.
      "at-least-once", {&second}, 200);
  second.await_error(
      with_trust() ? "announces no identity \\(participant [0-9a-f:]+\\): its "
                     "samples on millrace/v5/machine are ignored"
                   : "participant [0-9a-f:]+ publishes the state of gateway \\S+ of cnc, which "
                     "belongs to another participant",
      allowed);
  EXPECT_THAT(second.error_output(), Not(HasSubstr("taken over")));
}

// A regression: `millrace retry` printed "FORGED".
TEST_P(AnInsider, ForgesTheOutcomeOfACommandAndIsIgnored) {
  start(2);
  dds::Participant participant(join("service"));
  wire::Reader<Command> command_reader(participant, "millrace", wire::Keep::all);
  wire::Writer<Outcome> sut(participant, "millrace");
  const Flood flood(1000, [&](std::size_t) {
    for (const wire::Taken<Command>& taken : command_reader.take()) {
      static_cast<void>(sut.write({.responder = InstanceId::random(),
                                   .command = taken.value.id,
                                   .done = true,
                                   .detail = "FORGED"}));
    }
  });
  std::string errors;
  for (int i = 0; i < 5; ++i) {
    Process retry = chain.millrace({"retry", "cnc/1"});
    retry.wait(allowed);
    EXPECT_THAT(retry.output() + retry.error_output(), Not(HasSubstr("FORGED")));
    errors += retry.error_output();
    Process health = chain.millrace({"status", "--host"});
    EXPECT_EQ(health.wait(allowed), 0) << health.error_output();
    EXPECT_THAT(health.output() + health.error_output(), Not(HasSubstr("FORGED")));
    errors += health.error_output();
  }
  EXPECT_THAT(errors,
              testing::ContainsRegex("participant [0-9a-f:]+ publishes the outcome of a command"));
}

TEST_P(AnInsider, PublishesCallsAndMachinesOfAGatewayAndNoRecordingHasThem) {
  prepare();
  const std::string file = (chain.folder() / "run.mcap").string();
  Process recorder = chain.millrace({"record", "-o", file});
  recorder.await("^ready: ");
  const auto as = join("gateway-2");
  Requester requester(as);
  dds::Participant participant(as);
  wire::Reader<MachineStatus> machine_reader(participant, "millrace", wire::Keep::last);
  wire::Writer<MachineStatus> machines(participant, "millrace");
  wire::Writer<ChannelStatus> states(participant, "millrace");
  wire::Writer<Event> events(participant, "millrace");
  wire::Writer<Outcome> outcomes(participant, "millrace");
  attack(as,
         [&](std::size_t i) {
           for (wire::Taken<MachineStatus>& taken : machine_reader.take()) {
             if (taken.valid && taken.value.reason != "FORGED") {
               taken.value.reason = "FORGED";
               static_cast<void>(machines.write(taken.value));
             }
           }
           if (const auto& asked = requester.overhear(); asked && i % 8 == 0) {
             static_cast<void>(states.write({.key = asked->key, .reason = "FORGED"}));
             static_cast<void>(events.write({.key = asked->key,
                                             .call = asked->call,
                                             .kind = EventKind::withdrawn,
                                             .uuid = asked->uuid,
                                             .detail = "FORGED"}));
             static_cast<void>(
                 outcomes.write({.responder = asked->assigned, .done = true, .detail = "FORGED"}));
             requester.take_back(*asked);
           }
         },
         "at-least-once", {&recorder});
  recorder.terminate();
  EXPECT_EQ(recorder.wait(allowed), 0);
  Process print = chain.millrace({"recording", "cat", file});
  EXPECT_EQ(print.wait(allowed), 0) << print.error_output();
  EXPECT_THAT(print.output(), HasSubstr("written"));
  EXPECT_THAT(print.output(), Not(HasSubstr("FORGED")));
  EXPECT_THAT(print.output(), Not(HasSubstr("withdrawn")));
  // Of 400 calls. A recorder on a busy host may receive the events of a finished call late.
  EXPECT_LT(withdrawn_before_written(print.output()), 8);
  EXPECT_THAT(
      recorder.error_output(),
      testing::ContainsRegex(
          with_trust() ? "gateway-2 speaks for cnc, which its certificate does not name"
                       : "participant [0-9a-f:]+ [^\n]*, which belongs to another participant"));
}

TEST_P(AnInsider, ChangesNoAlarmOfAnotherAndPublishesInItsOwnName) {
  start(2);
  boost::asio::io_context io;
  dds::Participant honest(join("screen"));
  endpoints::AlarmEndpoint end(honest, io.get_executor(),
                               {.program = "recorder", .host = "hall", .pid = 7});
  ASSERT_TRUE(end.raise({.key = {.kind = "archive"}, .text = "the disk is full"}));
  dds::Participant participant(join_elsewhere("panel"));
  wire::Reader<Alarm> alarm_reader(participant, "millrace", wire::Keep::last);
  wire::Writer<Alarm> sut(participant, "millrace");
  Alarm alarm;
  await("the alarm", [&] {
    for (const wire::Taken<Alarm>& taken : alarm_reader.take()) {
      if (taken.valid && taken.value.key.kind == "archive") {
        alarm = taken.value;
      }
    }
    return !alarm.text.empty();
  });
  const Flood flood(200, [&](std::size_t) {
    alarm.text = "all is lost";
    static_cast<void>(sut.write(alarm));
    Alarm of_its_own{.key = {.responder = alarm.key.responder, .kind = "made_up"},
                     .text = "no such trouble",
                     .program = "recorder",
                     .host = "hall"};
    static_cast<void>(sut.write(of_its_own));
    io.poll();
  });
  await("the flood", [&] { return flood.done() > 50; });
  Process doctor = chain.millrace({"doctor"});
  doctor.wait(allowed);
  const std::string findings = doctor.output();
  // Each alarm is attributed to the participant that published it.
  const auto has_alarm_of = [&](const std::string& program, const std::string& text) {
    return testing::ContainsRegex((with_trust() ? program + " \\(" : "recorder") +
                                  "[^\n]*: " + text);
  };
  EXPECT_THAT(findings, has_alarm_of("screen", "the disk is full"));
  EXPECT_THAT(findings, has_alarm_of("panel", "all is lost"));
  EXPECT_THAT(findings, has_alarm_of("panel", "no such trouble"));
}

// A regression: each id cost a DDS writer in the gateway's loop. No call was answered during the
// flood, and SIGTERM was not obeyed.
TEST_P(AnInsider, MakesVariableRequestsUnderEverNewIdsAndCallsGoOn) {
  prepare();
  const auto as = join("desk");
  dds::Participant participant(as);
  wire::Writer<VariableRequest> sut(participant, "millrace");
  const auto act = [&](std::size_t) {
    static_cast<void>(sut.write({.requester = InstanceId::random(),
                                 .token = InstanceId::random(),
                                 .key = {"cnc", 1},
                                 .names = {"block_number"},
                                 .patience = 1s}));
  };
  attack(as, act);
  gateway->await_error("participant [0-9a-f:]+ makes variable requests under ever new ids",
                       allowed);
  const Flood again(2000, act);
  await("the flood", [&] { return again.done() > 1000; });
  gateway->terminate();
  EXPECT_EQ(gateway->wait(8s), 0);
}

// A regression: 1.9 kB were kept for each process that a heartbeat named.
TEST_P(AnInsider, FillsNoMemoryWithHeartbeatsOfNewProcesses) {
  start(2);
  dds::Participant participant(join("service"));
  wire::Writer<Heartbeat> sut(participant, "millrace");
  await("who hears it", [&] { return !sut.matched().empty(); });
  const Memory memory({&*gateway});
  for (int i = 0; i < 12'000; ++i) {
    static_cast<void>(sut.write({.process = InstanceId::random()}));
    if (i % 64 == 0) {
      std::this_thread::yield();
    }
  }
  gateway->await_error(
      "participant [0-9a-f:]+ writes more than 4 DDS instances on millrace/v5/heartbeat", allowed);
  Process ping = chain.millrace({"status", "--host"});
  EXPECT_EQ(ping.wait(allowed), 0) << ping.error_output();
  memory.expect_less_than(8.0);
}

// A regression: 0.6 kB were kept for each alarm and outcome.
TEST_P(AnInsider, FillsNoMemoryWithNewOutcomesAndAlarms) {
  start(2);
  Process recorder = chain.millrace({"record", "-o", (chain.folder() / "run.mcap").string()});
  recorder.await("^ready: ");
  dds::Participant participant(join("service"));
  wire::Writer<Outcome> outcomes(participant, "millrace");
  wire::Writer<Alarm> alarms(participant, "millrace");
  await("who hears it", [&] { return !outcomes.matched().empty() && !alarms.matched().empty(); });
  const Memory memory({&recorder});
  for (int i = 0; i < 15'000; ++i) {
    static_cast<void>(outcomes.write({.responder = InstanceId::random(), .done = true}));
    static_cast<void>(
        alarms.write({.key = {.responder = InstanceId::random(), .kind = "archive"}}));
    if (i % 64 == 0) {
      std::this_thread::yield();
    }
  }
  recorder.await_error(
      "participant [0-9a-f:]+ writes more than 1024 DDS instances on millrace/v5/outcome", allowed);
  recorder.await_error(
      "participant [0-9a-f:]+ writes more than 1024 DDS instances on millrace/v5/alarm", allowed);
  memory.expect_less_than(8.0);
  recorder.terminate();
  EXPECT_EQ(recorder.wait(allowed), 0);
}

INSTANTIATE_TEST_SUITE_P(, AnInsider, testing::Values("Open", "SIGN", "ENCRYPT"),
                         [](const auto& fabric) { return fabric.param; });
INSTANTIATE_TEST_SUITE_P(, AnInsiderWithACertificate, testing::Values("SIGN", "ENCRYPT"),
                         [](const auto& fabric) { return fabric.param; });

}  // namespace
}  // namespace millrace::tests::failures
