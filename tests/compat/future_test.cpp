// A service, a gateway and a tool of a later 1.x beside the programs of today: each sample has an
// extra, each code takes a value that today has no name for.
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/compat/peer.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/http_client.hpp"

namespace millrace::tests::compat {
namespace {

using integration::Chain;
using integration::Flags;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const std::string extras_in_json = R"("extras":[{"name":"later_name","bytes":"later bytes"}])";

class ALaterVersion : public testing::Test {
 protected:
  /// The output of a command that ends.
  std::string run(const Flags& command) {
    Process process = chain.millrace(command);
    exit_code = process.wait();
    EXPECT_LT(exit_code, 128) << command.front() << process.error_output();
    return process.output() + process.error_output();
  }
  void record() {
    recorder.emplace(chain.millrace({"record", "-o", recording}));
    recorder->await("^ready: ");
  }
  void end_recording() {
    recorder->terminate();
    ASSERT_EQ(recorder->wait(), 0) << recorder->error_output();
  }

  Chain chain;
  Peer sut{chain.domain()};
  const std::string recording = (chain.folder() / "run.mcap").string();
  std::optional<Process> recorder;
  int exit_code = -1;
};

/// Calls the later service from an NC program, until it has a response.
class AServiceOfALaterVersion : public ALaterVersion {
 protected:
  /// What the NC program prints.
  std::string called(const Service::Answer& answer) {
    record();
    const Service service(sut, square_root, "later_key=later value\n", answer);
    gateway_output(
        chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"}));
    services = run({"services", "-i", "--json"});
    end_recording();
    entries = run({"recording", "cat", "--json", recording});
    calls = run({"recording", "calls", recording});
    return printed;
  }

  std::string printed;
  std::string services;
  std::string entries;
  std::string calls;

 private:
  void gateway_output(Process cnc) {
    Process gateway = chain.gateway();
    cnc.await("state = \\d+, request state");
    printed = cnc.output();
    EXPECT_EQ(cnc.wait(), 0);
    EXPECT_TRUE(gateway.running());
  }
};

void fill(millrace_Reply& reply) {
  put(reply.text, "1.732051");
  reply.state = 1;
  reply.reason = later_message();
}

TEST_F(AServiceOfALaterVersion, AnswersACall) {
  EXPECT_THAT(called([](const millrace_Request&, auto& replies) { fill(replies[0]); }),
              HasSubstr("response = 1.732051"));
  EXPECT_THAT(services, HasSubstr(R"("name":"later")"));
  EXPECT_THAT(entries, HasSubstr(extras_in_json));
  EXPECT_THAT(entries, HasSubstr(R"("reason_code":"later_sentence","reason_arguments":["T7"])"));
  EXPECT_THAT(calls, HasSubstr("1.732051"));
}

TEST_F(AServiceOfALaterVersion, EndsNoCallWithAReplyOfAnUnknownKind) {
  EXPECT_THAT(called([](const millrace_Request&, auto& replies) {
                fill(replies[0]);
                replies[0].kind = later_code;
              }),
              HasSubstr("state = 500"));
  EXPECT_THAT(entries, HasSubstr(R"_("reply":"unknown (200)")_"));
  EXPECT_THAT(calls, Not(HasSubstr("1.732051")));
}

TEST_F(AServiceOfALaterVersion, EndsNoCallWithAnUnknownServiceCode) {
  EXPECT_THAT(called([](const millrace_Request&, auto& replies) {
                fill(replies[0]);
                replies[0].code = later_code;
              }),
              HasSubstr("state = 500"));
  EXPECT_THAT(entries, HasSubstr(R"_("code":"unknown (200)")_"));
  EXPECT_THAT(calls, Not(HasSubstr("1.732051")));
}

/// A gateway of a later version, and what the programs of today make of its samples.
class AGatewayOfALaterVersion : public ALaterVersion {
 protected:
  void SetUp() override {
    web.emplace(chain.millrace({"web", "--listen", "127.0.0.1:0"}));
    port = static_cast<std::uint16_t>(
        std::stoi(web->await("^ready: .* at http://127\\.0\\.0\\.1:(\\d+)/").at(1)));
    record();
    // The page and the recorder.
    await("readers of everything", [&] {
      return machines.is_matched(2) && channels.is_matched(2) && events.is_matched(2) &&
             data.is_matched(2) && programs.is_matched(2) && alarms.is_matched(2);
    });
    // A reader may match later than its writer, and gets no event of the time before.
    millrace_Event first = event(millrace_event_kind_seen);
    first.call.number = 99;
    events.write(first);
    events.await_acknowledgements();
  }

  static millrace_MachineStatus machine(const char* name) {
    millrace_MachineStatus status{};
    put(status.machine, name);
    put(status.gateway, id_of(3));
    status.claimed = status.since = now();
    status.connected = true;
    status.watch = millrace_watch_mode_polled;
    status.journal = millrace_journal_state_kept;
    put(status.address, "10.0.0.5, AMS 10.0.0.5.1.1");
    status.reason = later_message();
    status.channels = 1;
    put(status.host, "later-pc");
    status.pid = 1;
    put(status.version, "1.9.0");
    status.epoch = epoch;
    status.extras = later_extras();
    return status;
  }
  static millrace_ChannelStatus channel(const char* of) {
    millrace_ChannelStatus status{};
    put(status.machine, of);
    status.channel = 1;
    status.state = millrace_channel_state_running;
    status.since = now();
    status.call = {epoch, 1};
    status.attempt = 1;
    put(status.instance, id_of(1));
    put(status.uuid, square_root);
    status.reason = later_message();
    status.extras = later_extras();
    return status;
  }
  static millrace_Event event(std::uint8_t kind) {
    millrace_Event event{};
    put(event.machine, "later");
    event.channel = 1;
    event.call = {epoch, 1};
    event.attempt = 1;
    event.kind = kind;
    event.at = now();
    put(event.uuid, square_root);
    event.detail = later_message();
    event.extras = later_extras();
    return event;
  }
  [[nodiscard]] std::string get(const std::string& target) const {
    const HttpAnswer answer = HttpClient(port).get(target);
    EXPECT_EQ(answer.status, 200) << target << ": " << answer.body;
    return answer.body;
  }
  void await_on_the_page(const std::string& target, const std::string& text) const {
    std::string shown;
    try {
      await(text, [&] {
        shown = get(target);
        return shown.find(text) != std::string::npos;
      });
    } catch (const std::runtime_error& late) {
      FAIL() << late.what() << " in " << target << ": " << shown;
    }
  }

  static constexpr std::uint64_t epoch = 0xabc;
  Writer<millrace_MachineStatus> machines{sut, "millrace"};
  Writer<millrace_ChannelStatus> channels{sut, "millrace"};
  Writer<millrace_Event> events{sut, "millrace"};
  Writer<millrace_DataSample> data{sut, "millrace"};
  Writer<millrace_ProgramEvent> programs{sut, "millrace"};
  Writer<millrace_Alarm> alarms{sut, "millrace"};
  std::optional<Process> web;
  std::uint16_t port = 0;
};

TEST_F(AGatewayOfALaterVersion, HasUnknownStatesThatAreShownAsUnknown) {
  millrace_MachineStatus unknown_watch = machine("later");
  unknown_watch.watch = later_code;
  machines.write(unknown_watch);
  millrace_MachineStatus unknown_journal = machine("later-2");
  unknown_journal.journal = later_code;
  machines.write(unknown_journal);
  millrace_ChannelStatus unknown_state = channel("later");
  unknown_state.state = later_code;
  channels.write(unknown_state);
  channels.write(channel("later-2"));

  await_on_the_page("/api/machines", R"_("watch":"unknown (200)")_");
  await_on_the_page("/api/machines", R"_("journal":"unknown (200)")_");
  await_on_the_page("/api/channels", R"_("channel_state":"unknown (200)")_");
  await_on_the_page("/api/channels", extras_in_json);
  await_on_the_page("/api/channels", R"("reason_code":"later_sentence")");

  EXPECT_THAT(run({"machines", "--json"}), HasSubstr(R"_("watch":"unknown (200)")_"));
  EXPECT_THAT(run({"channels", "--json"}),
              AllOf(HasSubstr(R"_("channel_state":"unknown (200)")_"), HasSubstr(extras_in_json)));
  const std::string listed = run({"channels"});
  EXPECT_THAT(listed, testing::ContainsRegex("later/1 +unknown "));
  EXPECT_THAT(listed, HasSubstr(later_sentence));
  const std::string status = run({"status"});
  EXPECT_THAT(status, HasSubstr("unknown")) << status;
  EXPECT_THAT(run({"doctor"}), HasSubstr("later"));
  EXPECT_TRUE(web->running());
  end_recording();
  const std::string lines = run({"recording", "cat", recording});
  EXPECT_THAT(lines, HasSubstr("unknown (200)")) << lines;
  EXPECT_THAT(run({"recording", "cat", "--json", recording}), HasSubstr(extras_in_json));
  EXPECT_THAT(run({"recording", "info", recording}), HasSubstr("channel"));
}

TEST_F(AGatewayOfALaterVersion, HasUnknownEventsThatAreNoStepsOfTheCall) {
  machines.write(machine("later"));
  events.write(event(later_code));
  millrace_Event alone = event(later_code);
  alone.call.number = 2;
  events.write(alone);
  millrace_Event written = event(millrace_event_kind_written);
  put(written.text, "1.732051");
  written.state = 1;
  events.write(written);
  await_on_the_page("/api/calls?limit=5", "abc-1");
  EXPECT_THAT(get("/api/calls/abc-1"), HasSubstr("written back"));
  end_recording();
  const std::string steps = run({"recording", "calls", recording, "abc-1"});
  EXPECT_THAT(steps, AllOf(HasSubstr("written back"), Not(HasSubstr("seen by the gateway"))));
  EXPECT_THAT(run({"recording", "calls", recording, "abc-2"}),
              AllOf(HasSubstr("abc-2"), Not(HasSubstr("seen by the gateway"))));
  EXPECT_THAT(run({"recording", "cat", "--json", recording}),
              HasSubstr(R"_("event":"unknown (200)")_"));
}

TEST_F(AGatewayOfALaterVersion, HasUnknownDataProgramEventsAndAlarms) {
  machines.write(machine("later"));
  double real = 1.5;
  std::array<millrace_Value, 2> values{};
  put(values[0].name, "V.A.LATER");
  values[0].type = later_code;
  put(values[1].name, "V.A.KNOWN");
  values[1].type = millrace_value_type_real64;
  values[1].quality = later_code;
  for (millrace_Value& value : values) {
    value.at = now();
    value.reals = {1, 1, &real, false};
    value.reason = later_message();
  }
  millrace_DataSample sample{};
  put(sample.machine, "later");
  sample.channel = 1;
  put(sample.group, "axes");
  sample.at = now();
  sample.period_ns = sample.wanted_ns = DDS_SECS(1);
  sample.values = {2, 2, values.data(), false};
  sample.extras = later_extras();
  data.write(sample);

  millrace_ProgramEvent event{};
  put(event.machine, "later");
  event.channel = 1;
  event.kind = later_code;
  event.at = now();
  event.detail = later_message();
  event.extras = later_extras();
  programs.write(event);

  millrace_Alarm alarm{};
  put(alarm.responder, id_of(4));
  put(alarm.kind, "later");
  alarm.level = later_code;
  alarm.text = later_message();
  alarm.since = now();
  put(alarm.program, "millrace-later");
  put(alarm.host, "later-pc");
  alarm.pid = 1;
  alarm.extras = later_extras();
  alarms.write(alarm);

  await_on_the_page("/api/data?machine=later", R"_("type":"unknown (200)")_");
  await_on_the_page("/api/data?machine=later", R"_("quality":"unknown (200)")_");
  await_on_the_page("/api/programs?machine=later", R"_("event":"unknown (200)")_");
  await_on_the_page("/api/alarms", "unknown (200)");
  EXPECT_THAT(run({"data", "later", "--json"}), HasSubstr("unknown (200)"));
  const std::string shown = run({"data", "later"});
  EXPECT_THAT(shown, HasSubstr("unknown (200)"));
  EXPECT_EQ(run({"data", "later", "--json"}).find("[]"), std::string::npos)
      << "the value of the unknown type is lost";
  EXPECT_THAT(run({"programs", "later"}), HasSubstr("unknown (200)"));
  EXPECT_THAT(run({"status"}), HasSubstr(later_sentence));
  end_recording();
  const std::string entries = run({"recording", "cat", "--json", recording});
  EXPECT_THAT(entries, HasSubstr(R"_("level":"unknown (200)")_"));
  EXPECT_THAT(entries, HasSubstr(R"_("type":"unknown (200)")_"));
}

/// A process of another wire beside programs of today: its topics have the number of that wire.
class AProcessOfAnotherWire : public testing::Test {
 protected:
  std::string doctor(const std::string& announced, const char* topic = "millrace/v6/machine") {
    const Peer sut(chain.domain(), announced);
    const TopicOf10 of_that_wire{topic, &millrace_MachineStatus_desc};
    static_cast<void>(sut.open_writer(of_that_wire, "millrace", {}));
    Process process = chain.millrace({"doctor", "--wait", "1s"});
    process.wait();
    return process.output();
  }

  Chain chain;
  Process service = chain.square_root({"--name", "sq1"});
};

TEST_F(AProcessOfAnotherWire, IsNamedByTheDoctorWithTheProcessesToUpgrade) {
  const std::string text =
      doctor("millrace-process 1\nversion=2.0.0\nlowest_wire=6\nhighest_wire=7\n");
  EXPECT_THAT(text, testing::ContainsRegex("sq1 on [^\n]* understands wire version 5 \\(millrace "
                                           "[^\n]*\\), not 6-7 \\(millrace 2\\.0\\.0\\)"));
  EXPECT_THAT(text, testing::ContainsRegex("upgrade sq1 on "));
}

TEST_F(AProcessOfAnotherWire, IsKnownByTheNamesOfItsTopics) {
  EXPECT_THAT(doctor(""),
              testing::ContainsRegex("sq1 on [^\n]* understands wire version 5 .*not 6 of"));
}

TEST_F(AProcessOfAnotherWire, IsTheOneToUpgradeIfItsWireIsEarlier) {
  const std::string text = doctor("", "millrace/request");
  EXPECT_THAT(text, testing::ContainsRegex("future_test on [^\n]* understands wire version 1, not "
                                           "5 \\(millrace [^\n]*\\) of "));
  EXPECT_THAT(text, testing::ContainsRegex("upgrade future_test on "));
}

TEST_F(AProcessOfAnotherWire, ThatUnderstandsThatOfTodayIsNoProblem) {
  EXPECT_THAT(doctor("millrace-process 1\nversion=1.9.0\nlowest_wire=5\nhighest_wire=6\n"),
              AllOf(HasSubstr("sq1"), Not(HasSubstr("wire version"))));
}

/// Waits for a sample that `is_it`.
template <typename Sample, typename IsIt, typename Repeat>
void await_sample(Reader<Sample>& from, const std::string& what, IsIt is_it, Repeat repeat) {
  bool found = false;
  await(what, [&] {
    repeat();
    from.take([&](const Sample& sample) { found = found || is_it(sample); });
    return found;
  });
}

TEST_F(ALaterVersion, OfAGatewayCallsAService) {
  Process service = chain.square_root();
  const std::string instance = sut.find_instance(square_root);
  Writer<millrace_Request> requests(sut, "millrace/" + square_root + "/" + instance);
  Reader<millrace_Reply> replies(sut, "millrace/" + square_root);
  await("the service", [&] { return requests.is_matched(); });
  millrace_Request request{};
  put(request.machine, "later");
  request.channel = 1;
  put(request.assigned, id_in(instance));
  request.epoch = 7;
  request.number = 1;
  request.attempt = 1;
  put(request.uuid, square_root);
  put(request.text, "9");
  request.state = 1;
  request.seen = request.dispatched = now();
  request.extras = later_extras();
  requests.write(request);
  std::string text;
  await_sample(
      replies, "the response",
      [&](const millrace_Reply& reply) {
        text = text_in(reply.text);
        return reply.epoch == 7 && reply.kind == millrace_reply_kind_final &&
               reply.code == millrace_service_code_ok;
      },
      [] {});
  EXPECT_THAT(text, HasSubstr("3"));
}

/// Writes five times a second: an answer may come before its reader is matched.
template <typename Write>
auto repeated(Write write) {
  return [write, due = std::int64_t{0}]() mutable {
    if (now() >= due) {
      write();
      due = now() + DDS_MSECS(200);
    }
  };
}

/// A tool of a later version with a gateway of today.
class AToolOfALaterVersion : public ALaterVersion {
 protected:
  void SetUp() override { gateway.await_error("link up"); }

  /// The outcome of a command about channel 1.
  std::pair<bool, std::string> commanded(std::uint8_t kind) {
    Writer<millrace_Command> commands(sut, "millrace");
    Reader<millrace_Outcome> outcomes(sut, "millrace");
    await("the gateway", [&] { return commands.is_matched(); });
    millrace_Command command{};
    put(command.token, id_of(kind));
    command.kind = kind;
    put(command.machine, "cnc");
    command.channel = 1;
    put(command.issuer, "later@later-pc");
    command.at = now();
    command.extras = later_extras();
    std::pair<bool, std::string> outcome;
    await_sample(
        outcomes, "the outcome",
        [&](const millrace_Outcome& sample) {
          outcome = {sample.done,
                     sample.detail._length > 0 ? sample.detail._buffer[0].text : std::string()};
          return std::ranges::equal(sample.token, id_of(kind));
        },
        repeated([&] { commands.write(command); }));
    return outcome;
  }

  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
};

TEST_F(AToolOfALaterVersion, GetsNothingDoneWithAnUnknownCommand) {
  EXPECT_EQ(commanded(millrace_command_kind_ping).first, true);
  const auto [done, detail] = commanded(later_code);
  EXPECT_FALSE(done) << detail;
  EXPECT_THAT(detail, HasSubstr("unknown (200)"));
  EXPECT_TRUE(gateway.running());
}

TEST_F(AToolOfALaterVersion, GetsTheReasonForAnUnknownVariableRequest) {
  Writer<millrace_VariableRequest> requests(sut, "millrace");
  Reader<millrace_VariableReply> replies(sut, "millrace/" + text_of(id_of(5)));
  await("the gateway", [&] { return requests.is_matched(); });
  const auto asked = [&](std::uint8_t action) {
    millrace_VariableRequest request{};
    put(request.requester, id_of(5));
    put(request.token, id_of(action));
    put(request.machine, "cnc");
    request.channel = 1;
    request.action = action;
    millrace_ValueText name{};
    put(name, "V.G.BLOCK_NR");
    request.names = {1, 1, &name, false};
    put(request.issuer, "later@later-pc");
    request.at = now();
    request.extras = later_extras();
    std::string reason;
    await_sample(
        replies, "the reply",
        [&](const millrace_VariableReply& reply) {
          reason = reply.reason._length > 0 ? reply.reason._buffer[0].text : std::string();
          return std::ranges::equal(reply.token, id_of(action));
        },
        repeated([&] { requests.write(request); }));
    return reason;
  };
  EXPECT_EQ(asked(millrace_variable_action_read), "");
  EXPECT_EQ(asked(later_code), "the request is of a kind that this gateway does not know");
}

}  // namespace
}  // namespace millrace::tests::compat
