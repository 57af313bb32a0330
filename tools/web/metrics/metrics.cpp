#include "tools/web/metrics/metrics.hpp"

#include "fabric/words.hpp"

namespace millrace::tools::web::metrics {

namespace {

/// A gateway repeats its last event for a new observer: older events are not counted.
constexpr auto late = std::chrono::seconds(10);

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
    if (!fabric::observer::is_absent(news->change) &&
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
    if (calls_.size() + 4 > most_call_series) {
      service = machine = other;
    }
    // A rate needs a counter that rises from 0; otherwise the first failure would be missed.
    for (const char* result : {"answered", "other_state", "failed", "withdrawn"}) {
      calls_.try_emplace({service, machine, result});
    }
  }
  ++calls_[{service, machine, std::string(ended->result())}];
}

void Metrics::add(const fabric::ProgramEvent& event, fabric::Time received) {
  using fabric::ProgramEventKind;
  if (event.replayed) {
    return;  // Each replay has machine names of its own.
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
  // A cleared error, or one that the next gateway found, does not end another run.
  const auto before = last_events_.find(event.key);
  const bool is_of_the_same_run = before != last_events_.end() &&
                                  before->second == ProgramEventKind::aborted &&
                                  event.kind != ProgramEventKind::ended;
  if (channel != 0) {
    last_events_.insert_or_assign(event.key, event.kind);
  }
  if (is_end && !is_of_the_same_run && event.at > received - late) {
    ++runs_[{machine, channel, std::string(name_of(event.kind))}];
  }
}

std::string Metrics::text(const plant::PlantModel& plant, const ProgramFigures& program,
                          const fabric::Moment& now) const {
  Families families;
  put_program(families, program);
  put_calls(families);
  put_channels(families, plant.live());
  put_links(families, plant.live());
  put_services(families, plant.live());
  put_concerns(families, plant.concerns(now));
  put_alarms(families, plant.live());
  put_data(families, plant.data());
  put_queues(families, plant.data());
  put_runs(families);
  return families.text();
}

void Metrics::put_calls(Families& families) const {
  Family calls = families.counter("millrace_calls_total",
                                  "Ended calls of NC programs: answered with a normal state or "
                                  "with another one, failed, or withdrawn by the NC program.");
  for (const auto& [labels, count] : calls_) {
    const auto& [service, machine, result] = labels;
    calls.add({{"service", service}, {"machine", machine}, {"result", result}},
              static_cast<double>(count));
  }
  Family hops = families.histogram("millrace_call_hop_duration_seconds",
                                   "Duration of each step of a call; total: from seen by the "
                                   "gateway to written back.");
  for (const auto& [labels, buckets] : durations_) {
    hops.add({{"service", labels.first}, {"hop", one_word(name_of(labels.second))}}, buckets);
  }
  const recording::Missing& missing = completeness_.missing();
  Family observed =
      families.counter("millrace_observed_calls_total",
                       "Ended calls by how much of each was observed: all, a part, or "
                       "nothing.");
  observed.add({{"seen", "complete"}}, static_cast<double>(missing.complete));
  observed.add({{"seen", "incomplete"}}, static_cast<double>(missing.incomplete));
  observed.add({{"seen", "nothing"}}, static_cast<double>(missing.unseen));
}

void Metrics::put_services(Families& families, const fabric::plant::Plant& live) const {
  Family instances =
      families.gauge("millrace_service_instances", "Running instances of the service.");
  Family draining =
      families.gauge("millrace_service_draining_instances", "Draining instances of the service.");
  Family running =
      families.gauge("millrace_service_running_calls", "Calls that its instances are running.");
  Family capacity = families.gauge("millrace_service_capacity_calls",
                                   "Calls that its instances can run at the same time.");
  Family info = families.gauge("millrace_service_info", "1; the name of the service.");
  struct OfService {
    double instances = 0;
    double draining = 0;
    double running = 0;
    double capacity = 0;
  };
  std::map<std::string, OfService> services;
  for (const auto& [uuid, name] : names_) {
    // A service without instances has the value 0, so that alert rules can match it.
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

void Metrics::put_runs(Families& families) const {
  Family runs = families.counter("millrace_programs_total",
                                 "Runs of NC programs: ended, aborted with an error, or reset.");
  for (const auto& [labels, count] : runs_) {
    const auto& [machine, channel, result] = labels;
    runs.add({{"machine", machine},
              {"channel", channel == 0 ? other : std::to_string(channel)},
              {"result", result}},
             static_cast<double>(count));
  }
}

void Metrics::put_program(Families& families, const ProgramFigures& program) const {
  const auto gauge = [&](const char* name, const char* help, std::optional<double> value) {
    if (value) {
      families.gauge(name, help).add({}, *value);
    }
  };
  const auto counter = [&](const char* name, const char* help, std::optional<double> value) {
    if (value) {
      families.counter(name, help).add({}, *value);
    }
  };
  families.gauge("millrace_build_info", "1; the version of millrace web.")
      .add({{"version", program.version}}, 1);
  counter("millrace_observer_samples_total", "Samples that this observer received.",
          static_cast<double>(program.bus.delivered));
  counter("millrace_observer_lost_samples_total",
          "Samples that were lost before this observer received them.",
          static_cast<double>(program.bus.lost));
  counter("millrace_observer_shortened_samples_total",
          "Samples that were longer than any of millrace; the rest was cut off.",
          static_cast<double>(program.bus.shortened));
  gauge("millrace_web_connections", "Open HTTP connections.",
        static_cast<double>(program.connections));
  gauge("millrace_web_browsers", "Browsers with an open event stream.",
        static_cast<double>(program.browsers));
  counter("millrace_web_requests_total", "HTTP requests.", static_cast<double>(program.requests));
  counter("millrace_web_displaced_connections_total",
          "Connections that were closed because there were too many.",
          static_cast<double>(program.displaced));
  counter("millrace_web_dropped_browsers_total",
          "Browsers that were dropped because they did not read.",
          static_cast<double>(program.dropped));
  gauge("millrace_certificate_expiry_timestamp_seconds",
        "When the certificate of millrace web expires.",
        program.certificate_ends ? std::optional(seconds_of(*program.certificate_ends))
                                 : std::nullopt);
  gauge("process_start_time_seconds", "When millrace web started.", seconds_of(program.started));
  counter("process_cpu_seconds_total", "Processor time of millrace web.", program.cpu_seconds);
  gauge("process_resident_memory_bytes", "Memory of millrace web.", program.resident_bytes);
  gauge("process_open_fds", "Open descriptors of millrace web.", program.open_files);
}

}  // namespace millrace::tools::web::metrics
