// millrace health: whether the programs of a host do their work, in one exit code.
#include <boost/json/object.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "base/program/command_line.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/json.hpp"
#include "tools/print/quoted.hpp"

namespace millrace::tools::commands::operate {

namespace {

std::string own_host() {
  char name[256] = "";
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "";
}

struct Options : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string host = own_host();
};

std::vector<const bus::LiveInstance*> instances_on(const bus::Live& live, const std::string& host) {
  std::vector<const bus::LiveInstance*> found;
  for (const bus::LiveInstance* instance : live.instances_of("")) {
    if (instance->identity.host == host) {
      found.push_back(instance);
    }
  }
  return found;
}

/// Prints, or adds to `out`, what the gateway of the host tells of its machines. A link that is
/// down is no fault of the gateway. Returns how many machines it has.
std::size_t show_machines(const Options& options, const bus::Live& live, boost::json::array& out) {
  std::size_t found = 0;
  for (const auto& [key, status] : live.machines()) {
    if (status.host != options.host) {
      continue;
    }
    ++found;
    if (options.json) {
      boost::json::object object;
      print::put_machine(object, status);
      out.push_back(std::move(object));
    } else {
      fmt::print("gateway of {} on {}: {}\n", print::safe(status.machine), print::safe(status.host),
                 status.connected ? "link up" : "link down: " + print::safe(status.reason));
    }
  }
  return found;
}

int check(const Options& options) {
  const bus::Live live = bus::take_snapshot(options.fabric.options());
  const auto instances = instances_on(live, options.host);
  boost::json::array machines;
  boost::json::array answers;
  const std::size_t gateways = show_machines(options, live, machines);
  bool healthy = gateways > 0 || !instances.empty();
  if (!instances.empty()) {
    healthy = tell_each(options, fabric::CommandKind::ping, instances, answers) && healthy;
  }
  if (options.json) {
    print::print_json(boost::json::object{{"healthy", healthy},
                                          {"machines", std::move(machines)},
                                          {"instances", std::move(answers)}});
  }
  if (gateways == 0 && instances.empty()) {
    fmt::print(stderr,
               "millrace: no gateway and no service of host '{}' is on fabric '{}', domain {}; "
               "'millrace services' and 'millrace machines' show who is\n",
               options.host, options.fabric.options().fabric, options.fabric.options().domain);
  }
  return healthy ? base::program::exit_done : base::program::exit_failed;
}

}  // namespace

void add_health(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "health",
      "Whether the gateway and the services of a host are there and answer, as exit code 0 or 1",
      "millrace health --host press-pc");
  auto options = std::make_shared<Options>(command);
  command.add_option("--host", options->host,
                     "The host, as it calls itself; this one unless given");
  command.callback([options, &chosen] { chosen.run = [options] { return check(*options); }; });
}

}  // namespace millrace::tools::commands::operate
