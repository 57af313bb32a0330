#include <array>
#include <map>
#include <set>

#include "fabric/channel_scope.hpp"
#include "fabric/data.hpp"
#include "fabric/words.hpp"
#include "tools/web/metrics/metrics.hpp"

namespace millrace::tools::web::metrics {

void put_channels(Families& families, const fabric::plant::Plant& live) {
  using fabric::ChannelState;
  constexpr std::array<ChannelState, 7> states{ChannelState::link_down, ChannelState::idle,
                                               ChannelState::unserved,  ChannelState::waiting,
                                               ChannelState::running,   ChannelState::answering,
                                               ChannelState::held};
  Family state =
      families.gauge("millrace_channel_state", "1 for the present state of the channel.");
  Family since = families.gauge("millrace_channel_state_since_timestamp_seconds",
                                "When the present state of the channel began.");
  Family events = families.counter(
      "millrace_channel_calls_total",
      "Calls of the channel since its gateway started, as the gateway counts them.");
  Family in_flight =
      families.gauge("millrace_calls_in_flight", "Calls that an instance has, by machine.");
  Family queued = families.gauge("millrace_calls_waiting",
                                 "Calls that wait for a service or a person, by machine.");
  struct OfMachine {
    double in_flight = 0;
    double waiting = 0;
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
  }
  for (const auto& [name, machine] : machines) {
    in_flight.add({{"machine", name}}, machine.in_flight);
    queued.add({{"machine", name}}, machine.waiting);
  }
}

void put_links(Families& families, const fabric::plant::Plant& live) {
  Family up = families.gauge("millrace_link_up",
                             "1 if a gateway has a connection to the machine's controller.");
  Family rate = families.gauge("millrace_link_requests_per_second",
                               "ADS requests of the last second to the machine's controller.");
  Family round_trip =
      families.gauge("millrace_link_round_trip_seconds", "Mean round trip of an ADS request.");
  Family poll = families.gauge("millrace_link_poll_interval_seconds",
                               "Interval between two polls of an idle channel.");
  Family pushed = families.gauge("millrace_link_pushed",
                                 "1 if the machine's controller sends notifications, 0 if it is "
                                 "polled.");
  Family gateways =
      families.gauge("millrace_gateways", "Gateways that are configured for the machine.");
  Family info = families.gauge("millrace_gateway_info", "1; the gateway of the machine.");
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
    machine.gateways += status.gone ? 0 : 1;
    if (!status.gone) {
      infos.insert(
          {{"machine", status.machine}, {"host", status.host}, {"version", status.version}});
    }
    if (status.connected) {
      machine.connected = true;
      machine.pushed = machine.pushed && status.watch == fabric::WatchMode::pushed;
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

void put_concerns(Families& families, const std::vector<fabric::plant::Concern>& concerns) {
  Family family = families.gauge("millrace_concern",
                                 "1 for what needs attention, as `millrace status` and the page "
                                 "name it: level \"act\" needs a person, \"look\" is to be "
                                 "known.");
  std::size_t shown = 0;
  std::set<Labels> known;
  for (const fabric::plant::Concern& concern : concerns) {
    const Labels labels{{"kind", std::string(name_of(concern.kind))},
                        {"level", std::string(name_of(concern.level))},
                        {"who", std::string(name_of(concern.who))},
                        {"subject", subject_of(concern).text},
                        {"what", concern.what.text}};
    if (shown < most_concerns && known.insert(labels).second) {
      ++shown;
      family.add(labels, 1);
    }
  }
}

void put_alarms(Families& families, const fabric::plant::Plant& live) {
  Family alarms = families.gauge("millrace_alarm",
                                 "1 for each alarm of a process: a problem, a warning, or the "
                                 "statement that it runs well.");
  std::size_t shown = 0;
  std::set<Labels> published;
  for (const auto& [key, alarm] : live.alarms()) {
    Labels labels{{"program", alarm.program},
                  {"host", alarm.host},
                  {"kind", key.kind},
                  {"subject", key.subject},
                  {"level", std::string(name_of(alarm.level))}};
    // Two processes of one name on one host may report the same.
    if (shown < most_alarms && published.insert(labels).second) {
      ++shown;
      alarms.add(labels, 1);
    }
  }
}

void put_data(Families& families, const plant::DataStore& data) {
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
    // Always all three, so that an alert rule sees the number rise.
    for (const auto quality :
         {fabric::Quality::good, fabric::Quality::stale, fabric::Quality::refused}) {
      const auto count = counts.find({machine, quality});
      values.add({{"machine", machine}, {"quality", std::string(name_of(quality))}},
                 count == counts.end() ? 0 : static_cast<double>(count->second));
    }
  }
}

void put_queues(Families& families, const plant::DataStore& data) {
  Family filled =
      families.gauge("millrace_queue_filled_messages", "Messages in the controller's queue.");
  Family room =
      families.gauge("millrace_queue_capacity_messages", "Capacity of the controller's queue.");
  Family waiting =
      families.gauge("millrace_queue_waiting_messages",
                     "Messages that the gateway has read and that wait for a response.");
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
    // While the controller does not answer, the last value does not count.
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

}  // namespace millrace::tools::web::metrics
