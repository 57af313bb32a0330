// millrace health: whether the programs of a host do their work, in one exit code.
#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <utility>

#include <boost/json/object.hpp>
#include <fmt/format.h>

#include "base/posix/host.hpp"
#include "base/program/command_line.hpp"
#include "base/text/number.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/alarm_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct HealthOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string host = base::posix::host_name();
  bool all = false;
  /// Machines, or hosts of gateways.
  std::vector<std::string> gateways{};
  /// The required number of instances of each service, by UUID or name.
  std::vector<std::pair<std::string, std::size_t>> services{};
};

// The problems, the worst first; 1 is above all of them.
constexpr int exit_link_down = 3;
constexpr int exit_held = 4;
constexpr int exit_unserved = 5;
constexpr int exit_trouble = 6;
constexpr const char* exit_codes =
    "Exit codes, the first that applies:\n"
    "  0  all is well\n"
    "  1  a program of the host does not answer, or is not there, or the fabric lacks what\n"
    "     --expect-gateway or --expect-service names\n"
    "  2  a wrong flag or value\n"
    "and with --all:\n"
    "  1  an instance has frozen or ended while this command looked\n"
    "  3  no gateway is on the fabric, or the link of a machine is down\n"
    "  4  a call is held for an operator\n"
    "  5  a call has no service, or has waited for a free instance for more than a minute, or a\n"
    "     service has lost its last instance in the last quarter of an hour\n"
    "  6  a program reports a problem\n\n";

/// Processes with a loop that may hang: the gateways of a host, presented as instances, and its
/// services.
struct Programs {
  std::vector<fabric::InstanceIdentity> gateways;
  std::vector<fabric::InstanceIdentity> instances;
  /// Their alarms, and those of other processes of the host without calls, such as a recorder. A
  /// process whose loop hangs publishes none.
  std::vector<fabric::Alarm> alarms;
};

Programs programs_on(const bus::FabricModel& live, const std::string& host) {
  Programs found;
  for (const auto& [id, status] : live.gateways()) {
    if (status.host == host) {
      found.gateways.push_back(
          {.id = id,
           .name = fmt::format("gateway {:012x} (pid {})", status.epoch, status.pid),
           .host = status.host});
    }
  }
  for (const bus::KnownInstance* instance : live.instances_of("")) {
    if (instance->identity.host == host) {
      found.instances.push_back(instance->identity);
    }
  }
  for (const auto& [key, alarm] : live.alarms()) {
    if (alarm.host == host) {
      found.alarms.push_back(alarm);
    }
  }
  return found;
}

/// Prints, or adds to `out`, the machines of the gateways. A link that is down is not a fault of
/// the gateway.
void show_machines(const HealthOptions& options, const bus::FabricModel& live,
                   const Programs& programs, boost::json::array& out) {
  for (const auto& [key, status] : live.machines()) {
    if (std::ranges::find(programs.gateways, key.second, &fabric::InstanceIdentity::id) ==
        programs.gateways.end()) {
      continue;
    }
    if (options.json) {
      boost::json::object object;
      print::put_machine(object, status);
      out.push_back(std::move(object));
    } else {
      fmt::print("gateway of {} on {}: {}\n", base::text::safe(status.machine),
                 base::text::safe(options.host),
                 status.connected ? "link up" : "link down: " + base::text::safe(status.reason));
    }
  }
}

/// Says each thing that is wrong, and remembers the exit code of the worst.
class Wrongs {
 public:
  void note(int code, const std::string& what) {
    worst_ = worst_ == base::program::exit_done ? code : std::min(worst_, code);
    say(what);
  }
  /// It was said already.
  void note(int code) {
    worst_ = worst_ == base::program::exit_done ? code : std::min(worst_, code);
  }
  void say(const std::string& what) const {
    fmt::print(stderr, "millrace: {}\n", base::text::safe(what));
  }
  [[nodiscard]] int exit_code() const { return worst_; }

 private:
  int worst_ = base::program::exit_done;
};

bool is_heard(const fabric::MachineStatus& status) {
  // An observer leaves nothing but the name of one that is gone.
  return !status.host.empty();
}

/// The gateways and services that options require.
void look_for_the_expected(const HealthOptions& options, const bus::FabricModel& live,
                           Wrongs& wrongs) {
  for (const std::string& name : options.gateways) {
    const bool is_there = std::ranges::any_of(live.machines(), [&](const auto& one) {
      return is_heard(one.second) && (one.second.machine == name || one.second.host == name);
    });
    if (!is_there) {
      wrongs.note(base::program::exit_failed,
                  fmt::format("no gateway of machine '{}', or on a host of that name, reports on "
                              "fabric '{}'; start it",
                              name, options.fabric.options().fabric));
    }
  }
  for (const auto& [what, count] : options.services) {
    const auto instances = live.instances_of(what);
    const auto there = static_cast<std::size_t>(std::ranges::count_if(
        instances,
        [](const bus::KnownInstance* instance) { return !instance->identity.draining; }));
    if (there < count) {
      wrongs.note(base::program::exit_failed,
                  fmt::format("service '{}' has {} of {} expected instances; start the others",
                              what, there, count));
    }
  }
}

/// Discovery shows them, and they send no heartbeat.
void look_at_the_silent(const bus::FabricModel& live, Wrongs& wrongs) {
  for (const auto& [id, gone] : live.gone()) {
    const fabric::InstanceIdentity& identity = gone.last.identity;
    wrongs.note(base::program::exit_failed,
                fmt::format("{} {} on {}, pid {}: no heartbeat; its process is frozen or has ended",
                            identity.name, id.to_string(), identity.host, identity.pid));
  }
}

/// The links of these gateways and the channels of their machines.
void look_at_machines(const bus::FabricModel& live, const Programs& programs, Wrongs& wrongs) {
  if (std::ranges::none_of(live.machines(), [](const auto& one) { return is_heard(one.second); })) {
    wrongs.note(exit_link_down,
                "no gateway reports on this fabric: no controller is asked for calls; start "
                "millrace-gateway");
  }
  std::set<std::string> machines;
  for (const auto& [key, status] : live.machines()) {
    if (std::ranges::find(programs.gateways, key.second, &fabric::InstanceIdentity::id) ==
        programs.gateways.end()) {
      continue;
    }
    machines.insert(status.machine);
    // A gateway that stands by has no link, and needs none.
    const bool has_link = std::ranges::any_of(live.machines(), [&](const auto& one) {
      return one.second.machine == status.machine && one.second.connected;
    });
    if (!has_link) {
      wrongs.note(exit_link_down, fmt::format("{}: link down: {}", status.machine, status.reason));
    }
  }
  for (const auto& [key, status] : live.channels()) {
    if (!machines.contains(key.machine)) {
      continue;
    }
    switch (live.obstacle_of(status, std::chrono::system_clock::now())) {
      case bus::Obstacle::none:
      case bus::Obstacle::journal:  // its gateway says it itself
      case bus::Obstacle::busy:
        break;
      case bus::Obstacle::held:
        wrongs.note(exit_held,
                    fmt::format("{}: a call is held: {}", key.to_string(), status.reason));
        break;
      case bus::Obstacle::unserved:
        wrongs.note(exit_unserved, fmt::format("{}: no service has the UUID {}: {}",
                                               key.to_string(), status.uuid, status.reason));
        break;
      case bus::Obstacle::long_busy:
        wrongs.note(exit_unserved,
                    fmt::format("{}: a call of {} has waited since {}: {}", key.to_string(),
                                status.uuid, print::time_text(status.since), status.reason));
        break;
    }
  }
}

/// Gateways publish services whose last instance disappeared.
void look_at_lost_services(const bus::FabricModel& live, Wrongs& wrongs) {
  std::set<std::string> said;
  for (const auto& [key, alarm] : live.alarms()) {
    if (key.kind == "service" && live.instances_of(key.subject).empty() &&
        said.insert(key.subject).second) {
      wrongs.note(exit_unserved, alarm.text);
    }
  }
}

/// The alarms of the host's processes. A warning is printed, and is not a failure.
void look_at_alarms(const std::vector<fabric::Alarm>& alarms, Wrongs& wrongs) {
  for (const fabric::Alarm& alarm : alarms) {
    const std::string what =
        print::what_is_said(alarm) + (alarm.advice.empty() ? "" : " -> " + alarm.advice);
    if (alarm.level == fabric::AlarmLevel::warning && alarm.key.kind != "service") {
      wrongs.say(what);
    } else if (alarm.level != fabric::AlarmLevel::fine && alarm.key.kind != "service") {
      wrongs.note(exit_trouble, what);
    }
  }
}

/// Takes the answers of the gateways, which are the first, out of all.
boost::json::array take_gateways(boost::json::array& answers, std::size_t gateways) {
  boost::json::array taken;
  for (std::size_t i = 0; i < gateways; ++i) {
    boost::json::object& answer = answers.at(i).as_object();
    answer["gateway"] = answer["instance"];
    answer.erase("instance");
    taken.push_back(std::move(answer));
  }
  answers.erase(answers.begin(), answers.begin() + gateways);
  return taken;
}

int check(const HealthOptions& options) {
  const bus::FabricModel live = bus::take_snapshot(options.fabric.options());
  const Programs programs = programs_on(live, options.host);
  boost::json::array machines;
  boost::json::array answers;
  show_machines(options, live, programs, machines);
  std::vector<fabric::InstanceIdentity> asked = programs.gateways;
  asked.insert(asked.end(), programs.instances.begin(), programs.instances.end());
  const bool none = asked.empty() && programs.alarms.empty();
  Wrongs wrongs;
  if (none) {
    wrongs.note(
        base::program::exit_failed,
        fmt::format("no gateway, no service and no recorder of host '{}' is on fabric '{}', domain "
                    "{}; 'millrace services' and 'millrace machines' show what is there",
                    options.host, options.fabric.options().fabric,
                    options.fabric.options().domain));
  } else if (!tell_each(options, fabric::CommandKind::ping, asked, answers)) {
    wrongs.note(base::program::exit_failed);
  }
  look_for_the_expected(options, live, wrongs);
  if (options.all) {
    look_at_the_silent(live, wrongs);
    look_at_machines(live, programs, wrongs);
    look_at_lost_services(live, wrongs);
    look_at_alarms(programs.alarms, wrongs);
  }
  const bool healthy = wrongs.exit_code() == base::program::exit_done;
  if (options.json) {
    boost::json::array gateways = take_gateways(answers, programs.gateways.size());
    boost::json::array alarms;
    for (const fabric::Alarm& alarm : programs.alarms) {
      alarms.push_back(print::json_of(alarm));
    }
    print::print_json(boost::json::object{{"healthy", healthy},
                                          {"machines", std::move(machines)},
                                          {"gateways", std::move(gateways)},
                                          {"instances", std::move(answers)},
                                          {"alarms", std::move(alarms)}});
  }
  return wrongs.exit_code();
}

/// "UUID=COUNT"
std::pair<std::string, std::size_t> expected_service(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  const auto count = equals == std::string::npos || equals == 0
                         ? std::nullopt
                         : base::text::parse_number<std::size_t>(text.substr(equals + 1));
  if (!count) {
    throw CLI::ValidationError(fmt::format(
        "'{}' is not UUID=COUNT; expected a UUID or a name, and a number of instances", text));
  }
  return {text.substr(0, equals), *count};
}

}  // namespace

void add_health(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "health",
      "Check by exit code whether the gateway and the services of a host run and respond",
      "millrace health --all --expect-gateway press --expect-service "
      "560aacbf-6335-44a9-895a-8b27f3ed5e47=2");
  command.footer(exit_codes + command.get_footer());
  auto options = std::make_shared<HealthOptions>(command);
  command.add_option("--host", options->host, "Name of the host; default: this host");
  command.add_flag("--all", options->all,
                   "Also whether the fabric has a gateway, whether instances send heartbeats, "
                   "whether the controllers and channels of the host's gateways are well, and what "
                   "its programs report");
  command
      .add_option("--expect-gateway", options->gateways,
                  "A machine whose gateway must report, or the host of a gateway; may be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command
      .add_option_function<std::vector<std::string>>(
          "--expect-service",
          [options = options.get()](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              options->services.push_back(expected_service(text));
            }
          },
          "A service, by UUID or name, that must have COUNT instances on the fabric or more, not "
          "counting those that drain; may be repeated")
      ->type_name("UUID=COUNT")
      ->allow_extra_args(false);
  command.callback([options, &chosen] { chosen.run = [options] { return check(*options); }; });
}

}  // namespace millrace::tools::commands::operate
