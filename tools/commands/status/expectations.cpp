#include "tools/commands/status/expectations.hpp"

#include <algorithm>

#include "base/messages/catalogue.hpp"
#include "base/program/command_line.hpp"

namespace millrace::tools::commands::status {

namespace messages = base::messages;
using fabric::plant::Concern;
using fabric::plant::Kind;

int exit_code_of(const Concern& concern) {
  if (concern.level != fabric::plant::Level::act) {
    return base::program::exit_done;
  }
  switch (concern.kind) {
    case Kind::missing:
      return base::program::exit_failed;
    case Kind::no_gateway:
    case Kind::gateway_gone:
    case Kind::link_down:
      return exit_link_down;
    case Kind::held:
      return exit_held;
    case Kind::unserved:
    case Kind::waiting:
      return exit_unserved;
    case Kind::program_aborted:
      return exit_program_aborted;
    default:
      return exit_alarm;
  }
}

int exit_code_of(const Concerns& concerns) {
  int code = base::program::exit_done;
  for (const Concern& concern : concerns) {
    const int each = exit_code_of(concern);
    code = code == base::program::exit_done   ? each
           : each == base::program::exit_done ? code
                                              : std::min(code, each);
  }
  return code;
}

Concerns missing_gateways(const fabric::plant::Plant& plant,
                          const std::vector<std::string>& names) {
  Concerns missing;
  for (const std::string& name : names) {
    const bool is_there = std::ranges::any_of(plant.machines(), [&](const auto& each) {
      return !each.second.gone && (each.second.machine == name || each.second.host == name);
    });
    if (!is_there) {
      missing.push_back({.kind = Kind::missing,
                         .machines = {name},
                         .what = messages::what_missing_gateway(),
                         .why = messages::no_gateway_of(name),
                         .todo = {messages::start_it()},
                         .cause = "missing gateway " + name});
    }
  }
  return missing;
}

Concerns missing_instances(const fabric::plant::Plant& plant, const Expected& services) {
  Concerns missing;
  for (const auto& [what, count] : services) {
    const auto instances = plant.instances_of(what);
    const auto there = static_cast<std::size_t>(std::ranges::count_if(
        instances,
        [](const fabric::plant::KnownInstance* instance) { return !instance->identity.draining; }));
    if (there < count) {
      missing.push_back({.kind = Kind::missing,
                         .uuid = what,
                         .what = messages::what_missing_instances(),
                         .why = messages::instances_there(there, count),
                         .todo = {messages::start_the_others()},
                         .cause = "missing instances " + what});
    }
  }
  return missing;
}

}  // namespace millrace::tools::commands::status
