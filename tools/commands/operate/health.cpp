// millrace health: whether the programs of a host do their work, in one exit code.
#include <algorithm>
#include <set>

#include <boost/json/object.hpp>
#include <fmt/format.h>

#include "base/posix/host.hpp"
#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct HealthOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string host = base::posix::host_name();
  bool all = false;
};

// What is wrong with --all, the worst first.
constexpr int exit_link_down = 3;
constexpr int exit_held = 4;
constexpr int exit_unserved = 5;

/// Whoever has a loop that may hang: the gateways of a host, in the words of an instance, and its
/// services.
struct Programs {
  std::vector<fabric::InstanceIdentity> gateways;
  std::vector<fabric::InstanceIdentity> instances;
};

Programs programs_on(const bus::Live& live, const std::string& host) {
  Programs found;
  for (const auto& [id, status] : live.gateways()) {
    if (status.host == host) {
      found.gateways.push_back(
          {.id = id,
           .name = fmt::format("gateway {:012x} (pid {})", status.epoch, status.pid),
           .host = status.host});
    }
  }
  for (const bus::LiveInstance* instance : live.instances_of("")) {
    if (instance->identity.host == host) {
      found.instances.push_back(instance->identity);
    }
  }
  return found;
}

/// Prints, or adds to `out`, what the gateways tell of their machines. A link that is down is no
/// fault of the gateway.
void show_machines(const HealthOptions& options, const bus::Live& live, const Programs& programs,
                   boost::json::array& out) {
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

/// --all: an exit code for the first thing that is wrong with the links of these gateways and the
/// channels of their machines; says each of them.
int look_at_machines(const bus::Live& live, const Programs& programs) {
  int worst = base::program::exit_done;
  const auto note = [&](int code, const std::string& what) {
    worst = worst == base::program::exit_done ? code : std::min(worst, code);
    fmt::print(stderr, "millrace: {}\n", base::text::safe(what));
  };
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
      note(exit_link_down, fmt::format("{}: link down: {}", status.machine, status.reason));
    }
  }
  for (const auto& [key, status] : live.channels()) {
    if (!machines.contains(key.machine)) {
      continue;
    }
    if (status.state == fabric::ChannelState::held) {
      note(exit_held, fmt::format("{}: a call is held: {}", key.to_string(), status.reason));
    } else if (status.state == fabric::ChannelState::unserved) {
      note(exit_unserved,
           fmt::format("{}: nobody serves {}: {}", key.to_string(), status.uuid, status.reason));
    }
  }
  return worst;
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
  const bus::Live live = bus::take_snapshot(options.fabric.options());
  const Programs programs = programs_on(live, options.host);
  boost::json::array machines;
  boost::json::array answers;
  show_machines(options, live, programs, machines);
  std::vector<fabric::InstanceIdentity> asked = programs.gateways;
  asked.insert(asked.end(), programs.instances.begin(), programs.instances.end());
  const bool healthy =
      !asked.empty() && tell_each(options, fabric::CommandKind::ping, asked, answers);
  if (options.json) {
    boost::json::array gateways = take_gateways(answers, programs.gateways.size());
    print::print_json(boost::json::object{{"healthy", healthy},
                                          {"machines", std::move(machines)},
                                          {"gateways", std::move(gateways)},
                                          {"instances", std::move(answers)}});
  }
  if (asked.empty()) {
    fmt::print(stderr,
               "millrace: no gateway and no service of host '{}' is on fabric '{}', domain {}; "
               "'millrace services' and 'millrace machines' show who is\n",
               options.host, options.fabric.options().fabric, options.fabric.options().domain);
  }
  if (!healthy) {
    return base::program::exit_failed;
  }
  return options.all ? look_at_machines(live, programs) : base::program::exit_done;
}

}  // namespace

void add_health(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "health",
      "Whether the gateway and the services of a host are there and answer, as exit code 0 or 1",
      "millrace health --host press-pc");
  auto options = std::make_shared<HealthOptions>(command);
  command.add_option("--host", options->host,
                     "The host, as it calls itself; this one unless given");
  command.add_flag(
      "--all", options->all,
      "Also whether their controllers and channels are well: exit code 3 for a link that "
      "is down, 4 for a held call, 5 for one that nobody serves");
  command.callback([options, &chosen] { chosen.run = [options] { return check(*options); }; });
}

}  // namespace millrace::tools::commands::operate
