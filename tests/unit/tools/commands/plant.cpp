#include "tests/unit/tools/commands/plant.hpp"

#include "base/messages/catalogue.hpp"
#include "tests/unit/tools/commands/small_fabric.hpp"

namespace millrace::tools::commands::tests {

namespace {

using namespace std::chrono_literals;
using fabric::ChannelState;
using fabric::EventKind;
using recording::Entry;

using Integers = std::vector<std::int64_t>;
using Reals = std::vector<double>;
using Texts = std::vector<std::string>;

const std::string laser_marker = "8d0f6f0a-3c55-4d0e-9a0b-6e1d5c8b2f31";
const std::string tool_length = "c2b7f0de-91a4-4c38-8f6b-0d5a7e3b9c44";
const std::string alarm_log = "c0ffee00-0000-4000-8000-000000000001";
const std::string probe = "7d5a4be2-2f0d-4c1e-b4c5-1f6a0d9e8c77";
const std::string unserved = "11111111-6335-44a9-895a-8b27f3ed5e47";

constexpr std::uint64_t epoch = 0x5f3a9c0112d4;

fabric::Time seconds(double after) {
  return at(after * 1000);
}

void add_machines(std::vector<Entry>& entries) {
  entries.push_back({.sample = fabric::MachineStatus{.machine = "press",
                                                     .gateway = instance(0xa1),
                                                     .claimed = seconds(1),
                                                     .connected = true,
                                                     .watch = fabric::WatchMode::polled,
                                                     .since = seconds(2),
                                                     .address = "10.0.0.5:48898 10.0.0.5.1.1",
                                                     .channels = 4,
                                                     .poll = 10ms,
                                                     .requests_per_second = 412,
                                                     .round_trip = 1'240us,
                                                     .host = "cell-3",
                                                     .pid = 31766,
                                                     .version = "0.1.0",
                                                     .epoch = epoch}});
  entries.push_back({.sample = fabric::MachineStatus{.machine = "mill",
                                                     .gateway = instance(0xa2),
                                                     .connected = true,
                                                     .since = seconds(3),
                                                     .host = "cell-4",
                                                     .pid = 2201,
                                                     .version = "0.1.0",
                                                     .journal = fabric::JournalState::kept}});
  entries.push_back({.sample = fabric::MachineStatus{.machine = "mill",
                                                     .gateway = instance(0xa2),
                                                     .since = seconds(480),
                                                     .reason = "its gateway is gone",
                                                     .gone = true}});
}

Entry service(std::uint8_t byte, const std::string& name, const std::string& uuid,
              std::uint32_t pid, std::uint32_t concurrency) {
  return {.at = seconds(3),
          .sample = recording::InstanceNews{.identity = {.id = instance(byte),
                                                         .uuid = uuid,
                                                         .name = name,
                                                         .version = "1.4.2",
                                                         .host = "cell-3",
                                                         .pid = pid,
                                                         .concurrency = concurrency,
                                                         .certificate = name}}};
}

void add_services(std::vector<Entry>& entries) {
  entries.push_back(service(1, "square_root", square_root, 31768, 2));
  entries.push_back(service(2, "square_root", square_root, 31770, 2));
  entries.push_back(service(3, "tool_length", tool_length, 31775, 1));
  entries.push_back(service(5, "probe, \"left\"\n", probe, 31811, 1));
  entries.push_back(service(4, "laser_marker", laser_marker, 31802, 1));
  std::get<recording::InstanceNews>(entries.back().sample).identity.delivery =
      fabric::Delivery::at_most_once;
  for (const fabric::InstanceStatus& status :
       {fabric::InstanceStatus{.instance = instance(1),
       .running = 1,
       .answered = 10'412,
       .failed = 3,
       .mean = 1'480us,
       .started = seconds(-3600),
       .last_call = seconds(599.4)},
        fabric::InstanceStatus{
            .instance = instance(2), .answered = 88, .mean = 3'000us, .started = seconds(-3600)},
        fabric::InstanceStatus{.instance = instance(3),
        .running = 1,
        .waiting = 1,
        .answered = 37,
        .mean = 3'020ms,
        .started = seconds(-86'400),
        .last_call = seconds(300)}}) {
    entries.push_back({.at = seconds(599), .sample = status});
  }
  Entry lost = service(4, "laser_marker", laser_marker, 31802, 1);
  lost.at = seconds(168);
  std::get<recording::InstanceNews>(lost.sample).change = recording::Change::gone;
  entries.push_back(lost);
}

void add_channels(std::vector<Entry>& entries) {
  for (const fabric::ChannelStatus& status :
       {fabric::ChannelStatus{.key = {"press", 1},
       .state = ChannelState::running,
       .since = seconds(599.4),
       .call = {epoch, 10'466},
       .attempt = 2,
       .instance = instance(1),
       .uuid = square_root,
       .calls = 10'416,
       .answered = 10'412,
       .failed = 3},
        fabric::ChannelStatus{.key = {"press", 2},
        .state = ChannelState::held,
        .since = seconds(168),
        .call = {epoch, 10'400},
        .attempt = 1,
        .instance = instance(4),
        .uuid = laser_marker,
        .reason = base::messages::instance_lost_held("laser_marker"),
        .calls = 12,
        .answered = 11},
        fabric::ChannelStatus{.key = {"press", 3},
        .state = ChannelState::waiting,
        .since = seconds(480),
        .call = {epoch, 10'441},
        .uuid = tool_length,
        .reason = base::messages::only_instance_busy(),
        .calls = 38,
        .answered = 37},
        fabric::ChannelStatus{
            .key = {"press", 4}, .state = ChannelState::idle, .since = seconds(2)},
        fabric::ChannelStatus{.key = {"press", 5},
        .state = ChannelState::unserved,
        .since = seconds(540),
        .call = {epoch, 10'450},
        .uuid = unserved,
        .reason = base::messages::unknown_uuid("11111111-6335-44a9-895a-8b27f3ed5e47"),
        .calls = 1},
        fabric::ChannelStatus{.key = {"press.ALARMS", 1},
        .state = ChannelState::idle,
        .since = seconds(420),
        .calls = 97,
        .answered = 97},
        fabric::ChannelStatus{.key = {"mill", 1},
        .since = seconds(480),
        .reason = "its gateway is gone",
        .gone = true}}) {
    entries.push_back({.at = seconds(599), .sample = status});
  }
}

void add_alarms(std::vector<Entry>& entries) {
  for (const fabric::Alarm& alarm :
       {fabric::Alarm{.key = {instance(0xb1), "archive", ""},
       .level = fabric::AlarmLevel::problem,
       .text = "/var/lib/millrace/archive cannot be written: disk full",
       .advice = "make room on the disk",
       .since = seconds(60),
       .program = "archiver",
       .host = "cell-3",
       .pid = 812},
        fabric::Alarm{.key = {instance(5), "certificate", ""},
        .level = fabric::AlarmLevel::warning,
        .text = "the certificate of \"probe\",\nserial 17, ends on 2026-03-20",
        .advice = "renew it: 'millrace trust renew'",
        .since = seconds(30),
        .program = "probe",
        .host = "cell-3",
        .pid = 31811},
        fabric::Alarm{.key = {instance(0xb2), "recording", ""},
        .level = fabric::AlarmLevel::fine,
        .text = "records to /var/lib/millrace/recordings/2026-03-01T06-00-00.mcap",
        .since = seconds(-3600),
        .program = "recorder",
        .host = "cell-3",
        .pid = 815}}) {
    entries.push_back({.at = seconds(599), .sample = recording::AlarmNews{.alarm = alarm}});
  }
}

Entry event(fabric::Event event) {
  return {.at = event.at, .sample = std::move(event)};
}

/// One that its NC program withdrew, two that are open, and an answered one.
void add_calls(std::vector<Entry>& entries) {
  const auto add = [&](std::uint16_t channel, const std::string& uuid, fabric::CallId call,
                       std::uint32_t attempt, EventKind kind, double at, const std::string& text,
                       const std::string& detail, fabric::InstanceId instance) {
    entries.push_back(event({.key = {"press", channel},
                             .call = call,
                             .attempt = attempt,
                             .kind = kind,
                             .at = seconds(at),
                             .instance = instance,
                             .uuid = uuid,
                             .text = text,
                             .detail = detail}));
  };
  const fabric::CallId withdrawn{epoch, 10'398};
  add(3, tool_length, withdrawn, 0, EventKind::seen, 420, "T12 check", "", {});
  add(3, tool_length, withdrawn, 0, EventKind::withdrawn, 450, "", "the NC program was reset", {});
  const fabric::CallId held{epoch, 10'400};
  add(2, laser_marker, held, 0, EventKind::seen, 160, "part 4711, top, \"A/B 2026\", depth 0.15",
      "", {});
  add(2, laser_marker, held, 1, EventKind::dispatched, 160.01, "", "", instance(4));
  add(2, laser_marker, held, 1, EventKind::held, 168, "",
      "laser_marker is lost during this call, which must not run twice; an operator must answer "
      "or retry it",
      instance(4));
  const fabric::CallId answered{epoch, 10'465};
  add(1, square_root, answered, 0, EventKind::seen, 598, "2", "", {});
  add(1, square_root, answered, 1, EventKind::dispatched, 598.001, "", "", instance(1));
  add(1, square_root, answered, 1, EventKind::written, 598.0071, "1.414214", "", instance(1));
  const fabric::CallId running{epoch, 10'466};
  add(1, square_root, running, 0, EventKind::seen, 599.3, "1764", "", {});
  add(1, square_root, running, 2, EventKind::dispatched, 599.4, "", "", instance(1));
}

fabric::Value value(const std::string& name, fabric::ValueType type, fabric::Elements elements) {
  return {.name = name, .type = type, .at = seconds(599.9), .elements = std::move(elements)};
}

void add_data(std::vector<Entry>& entries) {
  using enum fabric::ValueType;
  fabric::DataSample axes{
      .key = {"press", 1}, .group = "axes", .at = seconds(599.9), .period = 100ms, .wanted = 100ms};
  axes.values = {value("V.A.ACT_POS.X", real64, Reals{-12.375}),
                 value("V.A.ACT_POS.Y", real64, Reals{480}),
                 value("V.G.TOOL_NAMES", string,
                       Texts{"drill 6.8", "tap M8", "reamer 12H7", "face mill 63", "chamfer 90"}),
                 value("V.E.SPINDLE_LOAD_OF_THE_LAST_CUT", real64, {}),
                 value("V.E.NOTE", string, Texts{"Ma\xDF 7,5 \"oben\"\r\n\x1b[2J"})};
  axes.values[2].is_array = true;
  axes.values[3].quality = fabric::Quality::refused;
  axes.values[3].at = {};
  axes.values[3].reason = "0x710 symbol not found; it is tried again every 10 s";
  entries.push_back({.at = seconds(599.9), .sample = axes});
  fabric::DataSample state{
      .key = {"mill", 1}, .group = "state", .at = seconds(480), .period = 240ms, .wanted = 20ms};
  state.values = {value("state", uns32, Integers{2}), value("door", boolean, Integers{1})};
  for (fabric::Value& stale : state.values) {
    stale.quality = fabric::Quality::stale;
    stale.at = seconds(479.8);
    stale.reason = "the link is down";
  }
  entries.push_back({.at = seconds(480), .sample = state});
}

Entry queue(const std::string& name, Integers numbers, const std::string& drain,
            const std::string& trouble) {
  using enum fabric::ValueType;
  fabric::DataSample queue{.key = {"press." + name, 1},
                           .group = "queue",
                           .at = seconds(599),
                           .period = 1s,
                           .wanted = 1s};
  for (std::size_t i = 0;
       const char* const number : {"last_filled", "last_get", "elements", "messages", "answered",
                                   "waiting", "response_state"}) {
    queue.values.push_back(value(number, uns32, Integers{numbers[i++]}));
  }
  for (const auto& [text, content] :
       {std::pair("response", std::string("ok")), std::pair("array", "SD." + name),
        std::pair("uuid", alarm_log), std::pair("drain", drain)}) {
    queue.values.push_back(value(text, string, Texts{content}));
  }
  for (fabric::Value& number : queue.values) {
    if (!trouble.empty() && number.name.starts_with("last_")) {
      number.quality = fabric::Quality::stale;
      number.reason = trouble;
    }
  }
  return {.at = seconds(599), .sample = queue};
}

Entry program(fabric::ProgramEvent event) {
  return {.at = event.at, .sample = std::move(event)};
}

void add_programs(std::vector<Entry>& entries) {
  using enum fabric::ProgramEventKind;
  entries.push_back(program({.key = {"press", 1},
                             .kind = started,
                             .at = seconds(120),
                             .started = seconds(120),
                             .program = "/var/opt/nc/press/measure_contour.nc",
                             .parts = 1'764,
                             .mode = 2}));
  entries.push_back(program({.key = {"press", 2},
                             .kind = on_hold,
                             .at = seconds(168),
                             .started = seconds(150),
                             .program = "laser_mark.nc",
                             .parts = 12,
                             .mode = 2}));
  entries.push_back(program({.key = {"mill", 1},
                             .kind = aborted,
                             .at = seconds(410),
                             .started = seconds(395.5),
                             .program = "fixture_wrong.nc",
                             .error = 21'462,
                             .mode = 3,
                             .detail = "the CNC stopped at block N100: division by zero"}));
  entries.push_back(program({.key = {"press", 4},
                             .kind = ended,
                             .at = seconds(400),
                             .started = seconds(100),
                             .program = "Wei\xDF, \"A\"\n2.nc",
                             .mode = 2,
                             .replayed = true}));
}

}  // namespace

std::vector<Entry> plant_entries() {
  std::vector<Entry> entries;
  add_machines(entries);
  add_services(entries);
  add_channels(entries);
  add_alarms(entries);
  add_calls(entries);
  add_data(entries);
  entries.push_back(queue("ALARMS", {3, 1, 100, 97, 95, 2, 1}, "JOURNALLED", ""));
  entries.push_back(queue("TOOL_EVENTS", {0, 0, 50, 0, 0, 0, 0}, "WHEN_ANSWERED",
                          "LastFilled is 0, outside of the array of 50 elements"));
  add_programs(entries);
  return entries;
}

fabric::plant::Plant plant() {
  fabric::plant::Plant live;
  for (const Entry& entry : plant_entries()) {
    live.add(entry);
  }
  return live;
}

}  // namespace millrace::tools::commands::tests
