#include "tools/web/metrics/metrics.hpp"

#include <algorithm>
#include <array>

#include "fabric/channel_scope.hpp"
#include "fabric/queue_group.hpp"
#include "fabric/words.hpp"

namespace millrace::tools::web::metrics {

namespace {

/// What a gateway says of a link that is up (docs/gateway.md, "Told, or looked at"): the type on
/// the wire has a reason in words only.
bool is_pushed(const fabric::MachineStatus& status) {
  return status.connected && status.reason.find("pushed") != std::string::npos;
}

constexpr const char* other = "other";

/// As one word: "link_down", "to_service".
std::string one_word(std::string_view words) {
  std::string word(words);
  std::ranges::replace(word, ' ', '_');
  return word;
}

double seconds_of(fabric::Time time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

double seconds_of(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

/// A gateway tells its last event again to who finds it: what happened before that is not counted.
constexpr auto late = std::chrono::seconds(10);

std::string result_of(const plant::EndedCall& ended) {
  if (ended.call.last == fabric::EventKind::withdrawn) {
    return "withdrawn";
  }
  return ended.failed ? "failed" : "answered";
}

}  // namespace

Metrics::Metrics()
    : hops_([this](const std::string& uuid, recording::Hop hop, std::chrono::nanoseconds time) {
        durations_[{known(services_, uuid, most_services), hop}].add(time);
      }) {}

std::string Metrics::known(std::set<std::string>& names, const std::string& name,
                           std::size_t most) {
  if (!names.contains(name)) {
    if (names.size() >= most) {
      return other;
    }
    names.insert(name);
  }
  return name;
}

void Metrics::add(const recording::Entry& entry, const plant::EndedCall* ended) {
  hops_.add(entry);
  completeness_.add(entry);
  if (const auto* event = std::get_if<fabric::ProgramEvent>(&entry.sample)) {
    add(*event, entry.at);
    return;
  }
  if (const auto* news = std::get_if<recording::InstanceNews>(&entry.sample)) {
    if (news->change != recording::Change::gone &&
        known(services_, news->identity.uuid, most_services) != other) {
      names_.insert_or_assign(news->identity.uuid, news->identity.name);
    }
  }
  if (ended == nullptr) {
    return;
  }
  std::string service = known(services_, ended->call.uuid, most_services);
  std::string machine = known(machines_, ended->call.key.machine, most_machines);
  if (!calls_.contains({service, machine, "failed"})) {
    if (calls_.size() + 3 > most_call_series) {
      service = machine = other;
    }
    // A rate sees a counter rise, not begin: the first failure must not be missed.
    for (const char* result : {"answered", "failed", "withdrawn"}) {
      calls_.try_emplace({service, machine, result});
    }
  }
  ++calls_[{service, machine, result_of(*ended)}];
}

void Metrics::add(const fabric::ProgramEvent& event, fabric::Time received) {
  using fabric::ProgramEventKind;
  if (event.replayed) {
    return;  // Each replay has machines of its own.
  }
  std::string machine = known(machines_, event.key.machine, most_machines);
  std::uint16_t channel = event.key.channel;
  if (!runs_.contains({machine, channel, "ended"})) {
    if (runs_.size() + 3 > most_program_series) {
      machine = other;
      channel = 0;
    }
    for (const char* result : {"ended", "aborted", "reset"}) {
      runs_.try_emplace({machine, channel, result});
    }
  }
  const bool is_end = event.kind == ProgramEventKind::ended ||
                      event.kind == ProgramEventKind::aborted ||
                      event.kind == ProgramEventKind::reset;
  if (is_end && event.at > received - late) {
    ++runs_[{machine, channel, std::string(name_of(event.kind))}];
  }
}

std::string Metrics::text(const plant::Plant& plant, const ProgramFigures& program) const {
  Families families;
  put_program(families, program);
  put_calls(families);
  put_channels(families, plant.live());
  put_links(families, plant.live());
  put_services(families, plant.live());
  put_notices(families, plant.live());
  put_data(families, plant.data());
  put_queues(families, plant.data());
  put_runs(families);
  return families.text();
}

void Metrics::put_calls(Families& families) const {
  Family calls = families.counter("millrace_calls_total",
                                  "Calls of NC programs that ended: answered by a service, failed, "
                                  "or withdrawn by the program.");
  for (const auto& [labels, count] : calls_) {
    const auto& [service, machine, result] = labels;
    calls.add({{"service", service}, {"machine", machine}, {"result", result}},
              static_cast<double>(count));
  }
  Family hops = families.histogram("millrace_call_hop_duration_seconds",
                                   "What each part of the way of a call took; total: from seen by "
                                   "the gateway to written back.");
  for (const auto& [labels, buckets] : durations_) {
    hops.add({{"service", labels.first}, {"hop", one_word(name_of(labels.second))}}, buckets);
  }
  const recording::Missing& missing = completeness_.missing();
  Family observed = families.counter("millrace_observed_calls_total",
                                     "Calls that are over, by what arrived of them here: "
                                     "everything, not everything, or nothing at all.");
  observed.add({{"seen", "complete"}}, static_cast<double>(missing.complete));
  observed.add({{"seen", "incomplete"}}, static_cast<double>(missing.incomplete));
  observed.add({{"seen", "nothing"}}, static_cast<double>(missing.unseen));
}

void Metrics::put_channels(Families& families, const bus::Live& live) const {
  using fabric::ChannelState;
  constexpr std::array<ChannelState, 7> states{ChannelState::link_down, ChannelState::idle,
                                               ChannelState::unserved,  ChannelState::waiting,
                                               ChannelState::running,   ChannelState::answering,
                                               ChannelState::held};
  Family state =
      families.gauge("millrace_channel_state", "1 for the state that the channel is in.");
  Family since = families.gauge("millrace_channel_state_since_timestamp_seconds",
                                "Since when the channel is in its state.");
  Family events = families.counter(
      "millrace_channel_calls_total",
      "What its gateway counted of the channel's calls since the gateway started.");
  Family in_flight =
      families.gauge("millrace_calls_in_flight", "Calls that an instance has, by machine.");
  Family queued = families.gauge("millrace_calls_waiting",
                                 "Calls that wait for a service or a person, by machine.");
  Family journal = families.gauge("millrace_gateway_journal_writable",
                                  "0 while the machine's gateway takes no call because its journal "
                                  "cannot be written, as when the disk is full.");
  struct OfMachine {
    double in_flight = 0;
    double waiting = 0;
    bool journal_is_well = true;
  };
  std::map<std::string, OfMachine> machines;
  std::size_t shown = 0;
  for (const auto& [key, status] : live.channels()) {
    if (++shown > most_channels) {
      break;
    }
    const Labels labels{{"machine", key.machine}, {"channel", std::to_string(key.channel)}};
    const auto with = [&](const char* name, std::string value) {
      Labels more = labels;
      more.emplace_back(name, std::move(value));
      return more;
    };
    for (const ChannelState each : states) {
      state.add(with("state", one_word(name_of(each))), each == status.state ? 1 : 0);
    }
    since.add(labels, seconds_of(status.since));
    events.add(with("event", "seen"), static_cast<double>(status.calls));
    events.add(with("event", "answered"), static_cast<double>(status.answered));
    events.add(with("event", "withdrawn"), static_cast<double>(status.withdrawn));
    events.add(with("event", "repeated"), static_cast<double>(status.repeated));
    events.add(with("event", "late"), static_cast<double>(status.late));
    events.add(with("event", "failed"), static_cast<double>(status.failed));
    OfMachine& machine = machines[key.machine];
    const bool works =
        status.state == ChannelState::running || status.state == ChannelState::answering;
    const bool waits = status.state == ChannelState::waiting ||
                       status.state == ChannelState::unserved || status.state == ChannelState::held;
    machine.in_flight += works ? 1 : 0;
    machine.waiting += waits ? 1 : 0;
    // What it says of a call that waits (gateway/journal/keeper.cpp).
    machine.journal_is_well = machine.journal_is_well && !status.reason.starts_with("the journal");
  }
  // And of itself, also where no call waits.
  for (const auto& [key, status] : live.machines()) {
    const auto machine = machines.find(status.machine);
    if (machine != machines.end() && live.notices().contains({status.gateway, "journal", {}})) {
      machine->second.journal_is_well = false;
    }
  }
  for (const auto& [name, machine] : machines) {
    in_flight.add({{"machine", name}}, machine.in_flight);
    queued.add({{"machine", name}}, machine.waiting);
    journal.add({{"machine", name}}, machine.journal_is_well ? 1 : 0);
  }
}

void Metrics::put_links(Families& families, const bus::Live& live) const {
  Family up = families.gauge("millrace_link_up",
                             "1 if a gateway has a connection to the machine's controller.");
  Family rate = families.gauge("millrace_link_requests_per_second",
                               "ADS requests of the last second to the machine's controller.");
  Family round_trip = families.gauge("millrace_link_round_trip_seconds",
                                     "Mean time of an ADS request until its answer.");
  Family poll = families.gauge("millrace_link_poll_interval_seconds",
                               "Between two looks at an idle channel.");
  Family pushed = families.gauge("millrace_link_pushed",
                                 "1 if the machine's controller tells of changes, 0 if it is "
                                 "looked at all the time.");
  Family gateways =
      families.gauge("millrace_gateways", "Gateways that are set up for the machine.");
  Family info = families.gauge("millrace_gateway_info", "1; which gateway a machine has.");
  struct OfMachine {
    bool connected = false;
    bool pushed = true;
    double gateways = 0;
    double requests = 0;
    std::chrono::nanoseconds round_trip{};
    std::chrono::nanoseconds poll{};
  };
  std::map<std::string, OfMachine> machines;
  std::set<Labels> infos;
  for (const auto& [key, status] : live.machines()) {
    if (!machines.contains(status.machine) && machines.size() >= most_machines) {
      continue;
    }
    OfMachine& machine = machines[status.machine];
    // Of one that is gone an observer tells the name only.
    machine.gateways += status.host.empty() ? 0 : 1;
    if (!status.host.empty()) {
      infos.insert(
          {{"machine", status.machine}, {"host", status.host}, {"version", status.version}});
    }
    if (status.connected) {
      machine.connected = true;
      machine.pushed = machine.pushed && is_pushed(status);
      machine.requests += status.requests_per_second;
      machine.round_trip = std::max(machine.round_trip, status.round_trip);
      machine.poll = std::max(machine.poll, status.poll);
    }
  }
  for (const auto& [name, machine] : machines) {
    const Labels labels{{"machine", name}};
    up.add(labels, machine.connected ? 1 : 0);
    gateways.add(labels, machine.gateways);
    if (machine.connected) {
      rate.add(labels, machine.requests);
      round_trip.add(labels, seconds_of(machine.round_trip));
      poll.add(labels, seconds_of(machine.poll));
      pushed.add(labels, machine.pushed ? 1 : 0);
    }
  }
  for (const Labels& labels : infos) {
    info.add(labels, 1);
  }
}

void Metrics::put_services(Families& families, const bus::Live& live) const {
  Family instances =
      families.gauge("millrace_service_instances", "Instances of the service that are there.");
  Family draining = families.gauge("millrace_service_draining_instances",
                                   "Instances that take no new call and leave.");
  Family running =
      families.gauge("millrace_service_running_calls", "Calls that its instances run.");
  Family capacity = families.gauge("millrace_service_capacity_calls",
                                   "Calls that its instances can run at the same time.");
  Family info = families.gauge("millrace_service_info", "1; what the service is called.");
  struct OfService {
    double instances = 0;
    double draining = 0;
    double running = 0;
    double capacity = 0;
  };
  std::map<std::string, OfService> services;
  for (const auto& [uuid, name] : names_) {
    // One that has no instance left is 0, not nothing: an alarm can see that.
    services[uuid];
    info.add({{"service", uuid}, {"name", name}}, 1);
  }
  for (const auto& [id, instance] : live.instances()) {
    OfService& service =
        services[services_.contains(instance.identity.uuid) ? instance.identity.uuid : other];
    service.instances += 1;
    service.draining += instance.identity.draining ? 1 : 0;
    service.running += instance.status ? instance.status->running : 0;
    service.capacity += instance.identity.concurrency;
  }
  for (const auto& [uuid, service] : services) {
    const Labels labels{{"service", uuid}};
    instances.add(labels, service.instances);
    draining.add(labels, service.draining);
    running.add(labels, service.running);
    capacity.add(labels, service.capacity);
  }
}

void Metrics::put_notices(Families& families, const bus::Live& live) const {
  Family notices = families.gauge("millrace_notice",
                                  "1 for what a program says of itself: a problem, a warning, or "
                                  "that it is there and well.");
  std::size_t shown = 0;
  std::set<Labels> told;
  for (const auto& [key, notice] : live.notices()) {
    Labels labels{{"program", notice.program},
                  {"host", notice.host},
                  {"kind", key.kind},
                  {"subject", key.subject},
                  {"level", std::string(name_of(notice.level))}};
    // Two of one name on one host may say the same.
    if (shown < most_notices && told.insert(labels).second) {
      ++shown;
      notices.add(labels, 1);
    }
  }
}

void Metrics::put_data(Families& families, const plant::DataBook& data) const {
  Family values = families.gauge("millrace_data_values",
                                 "Sampled values of the machine by quality: good, stale because "
                                 "the controller has not answered since, refused by it.");
  std::map<std::pair<std::string, fabric::Quality>, std::size_t> counts;
  std::set<std::string> machines;
  for (const auto& [labels, count] : data.qualities()) {
    const bool has_room = machines.contains(labels.first) || machines.size() < most_machines;
    const std::string machine = has_room ? labels.first : other;
    machines.insert(machine);
    counts[{machine, labels.second}] += count;
  }
  for (const std::string& machine : machines) {
    // All three: an alarm sees a number rise.
    for (const auto quality :
         {fabric::Quality::good, fabric::Quality::stale, fabric::Quality::refused}) {
      const auto count = counts.find({machine, quality});
      values.add({{"machine", machine}, {"quality", std::string(name_of(quality))}},
                 count == counts.end() ? 0 : static_cast<double>(count->second));
    }
  }
}

void Metrics::put_queues(Families& families, const plant::DataBook& data) const {
  Family filled = families.gauge("millrace_queue_filled_messages",
                                 "Messages that stand in the controller's queue.");
  Family room = families.gauge("millrace_queue_capacity_messages",
                               "Messages that the controller's queue has room for.");
  Family waiting = families.gauge("millrace_queue_waiting_messages",
                                  "Messages that the gateway has read and nobody has answered.");
  Family read = families.counter("millrace_queue_messages_total",
                                 "Messages that the gateway has read, by its journal.");
  Family answered = families.counter("millrace_queue_answered_messages_total",
                                     "Messages that were answered, by the gateway's journal.");
  std::size_t shown = 0;
  for (const fabric::DataSample* sample : data.queues()) {
    if (++shown > most_queues) {
      break;
    }
    const Labels labels{{"machine", std::string(fabric::machine_of(sample->key.machine))},
                        {"queue", std::string(fabric::queue_of(sample->key.machine))},
                        {"channel", std::to_string(sample->key.channel)}};
    const fabric::Value* const control = fabric::value_of(*sample, "last_filled");
    // What was is not what is, while the controller does not answer.
    if (const auto of = fabric::filled_of(*sample);
        of && control->quality == fabric::Quality::good) {
      filled.add(labels, static_cast<double>(of->messages));
      room.add(labels, static_cast<double>(of->room));
    }
    const auto add = [&](Family& family, std::string_view name) {
      if (const auto number = fabric::number_of(*sample, name)) {
        family.add(labels, static_cast<double>(*number));
      }
    };
    add(waiting, "waiting");
    add(read, "messages");
    add(answered, "answered");
  }
}

void Metrics::put_runs(Families& families) const {
  Family runs = families.counter("millrace_programs_total",
                                 "Runs of NC programs that are over: ended, aborted with an error, "
                                 "or reset.");
  for (const auto& [labels, count] : runs_) {
    const auto& [machine, channel, result] = labels;
    runs.add({{"machine", machine},
              {"channel", channel == 0 ? other : std::to_string(channel)},
              {"result", result}},
             static_cast<double>(count));
  }
}

void Metrics::put_program(Families& families, const ProgramFigures& program) const {
  families.gauge("millrace_build_info", "1; the version of millrace web.")
      .add({{"version", program.version}}, 1);
  families.counter("millrace_observer_samples_total", "Samples that the fabric delivered here.")
      .add({}, static_cast<double>(program.bus.delivered));
  families
      .counter("millrace_observer_lost_samples_total",
               "Samples that were gone before they arrived here.")
      .add({}, static_cast<double>(program.bus.lost));
  families.gauge("millrace_web_connections", "Open HTTP connections.")
      .add({}, static_cast<double>(program.connections));
  families.gauge("millrace_web_browsers", "Browsers that are told what changes.")
      .add({}, static_cast<double>(program.browsers));
  families.counter("millrace_web_requests_total", "HTTP requests.")
      .add({}, static_cast<double>(program.requests));
  families
      .counter("millrace_web_displaced_connections_total",
               "Connections that were closed because there were too many.")
      .add({}, static_cast<double>(program.displaced));
  families
      .counter("millrace_web_dropped_browsers_total",
               "Browsers that were dropped because they did not read.")
      .add({}, static_cast<double>(program.dropped));
  if (program.certificate_ends) {
    families
        .gauge("millrace_certificate_expiry_timestamp_seconds",
               "When the certificate that millrace web shows ends.")
        .add({}, seconds_of(*program.certificate_ends));
  }
  families.gauge("process_start_time_seconds", "When millrace web started.")
      .add({}, seconds_of(program.started));
  if (program.cpu_seconds) {
    families.counter("process_cpu_seconds_total", "Processor time of millrace web.")
        .add({}, *program.cpu_seconds);
  }
  if (program.resident_bytes) {
    families.gauge("process_resident_memory_bytes", "Memory of millrace web.")
        .add({}, *program.resident_bytes);
  }
  if (program.open_files) {
    families.gauge("process_open_fds", "Open descriptors of millrace web.")
        .add({}, *program.open_files);
  }
}

}  // namespace millrace::tools::web::metrics
