#include "fabric/plant/expectations.hpp"

#include <algorithm>

#include "base/messages/catalogue.hpp"

namespace millrace::fabric::plant {

namespace messages = base::messages;

std::vector<Concern> missing_gateways(const Plant& plant, const std::vector<std::string>& names) {
  std::vector<Concern> missing;
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

std::vector<Concern> missing_instances(const Plant& plant, const Expected& services) {
  std::vector<Concern> missing;
  for (const auto& [what, count] : services) {
    const auto instances = plant.instances_of(what);
    const auto there = static_cast<std::size_t>(std::ranges::count_if(
        instances, [](const KnownInstance* instance) { return !instance->identity.draining; }));
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

}  // namespace millrace::fabric::plant
