#include "fabric/plant/concern.hpp"

#include <array>

#include "base/messages/catalogue.hpp"

namespace millrace::fabric::plant {

std::string_view name_of(Level level) {
  constexpr std::array<std::string_view, 3> names{"fine", "look", "act"};
  return names.at(static_cast<std::size_t>(level));
}

std::string_view name_of(Kind kind) {
  constexpr std::array<std::string_view, 16> names{
      "missing",    "held",         "no gateway",      "gateway gone",
      "link down",  "journal",      "unserved",        "program aborted",
      "alarm",      "overdue",      "waiting",         "errors",
      "redundancy", "process gone", "program on hold", "unknown"};
  return names.at(static_cast<std::size_t>(kind));
}

std::string_view name_of(Role role) {
  constexpr std::array<std::string_view, 3> names{"operator", "engineer", "programmer"};
  return names.at(static_cast<std::size_t>(role));
}

base::messages::Message subject_of(const Concern& concern) {
  std::string text;
  const auto add = [&](const std::string& name) { text += (text.empty() ? "" : ", ") + name; };
  const bool is_of_machines = concern.kind == Kind::gateway_gone ||
                              concern.kind == Kind::link_down || concern.kind == Kind::journal;
  if (!is_of_machines) {
    for (const ChannelKey& key : concern.channels) {
      add(key.to_string());
    }
  }
  if (text.empty()) {
    for (const std::string& machine : concern.machines) {
      add(machine);
    }
  }
  if (text.empty() && !concern.process.empty()) {
    return concern.process;
  }
  return text.empty() ? concern.uuid : text;
}

std::string advice_of(const std::vector<base::messages::Message>& todo) {
  std::string text;
  bool after_command = false;
  for (const base::messages::Message& step : todo) {
    const bool is_command = base::messages::run_command.is(step);
    text += text.empty() ? "" : is_command && !after_command ? ": " : is_command ? ", " : "; ";
    text += step.text;
    after_command = is_command;
  }
  return text;
}

}  // namespace millrace::fabric::plant
