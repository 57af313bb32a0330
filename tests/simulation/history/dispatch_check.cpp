#include "tests/simulation/history/dispatch_check.hpp"

#include <fmt/format.h>

namespace millrace::tests::simulation {

std::vector<std::string> DispatchCheck::on(const Fact& fact, Time) {
  const auto* given = std::get_if<Dispatched>(&fact);
  if (given == nullptr) {
    return {};
  }
  std::vector<std::string> violations;
  const std::string call = given->call.to_string();
  if (!given->ready) {
    violations.push_back(fmt::format(
        "I9: {} is given to an instance that is gone, draining, or of another service", call));
  }
  if (given->load >= given->room) {
    violations.push_back(fmt::format("I9: {} is given to an instance that has {} calls of {}", call,
                                     given->load, given->room));
  }
  return violations;
}

}  // namespace millrace::tests::simulation
