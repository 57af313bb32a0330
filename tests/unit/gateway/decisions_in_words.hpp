#pragma once

#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "gateway/dispatch/dispatcher.hpp"

namespace millrace::gateway {

/// "1→2#1": call 1 goes to instance 2 as attempt 1, "1→2#1 waits" if it waits there; "1 lost", "1
/// held"; "1: reason".
inline std::vector<std::string> in_words(const dispatch::Decisions& decisions) {
  std::vector<std::string> out;
  for (const dispatch::Decision& decision : decisions) {
    if (const auto* assign = std::get_if<dispatch::Assign>(&decision)) {
      out.push_back(fmt::format(
          "{}→{}#{}{}", assign->call.number, assign->assignment.attempt.instance.bytes[0],
          assign->assignment.attempt.number, assign->assignment.waits ? " waits" : ""));
    } else if (const auto* back = std::get_if<dispatch::Unassign>(&decision)) {
      out.push_back(fmt::format("{} {}", back->call.number, back->held ? "held" : "lost"));
    } else if (const auto* explain = std::get_if<dispatch::Explain>(&decision)) {
      out.push_back(fmt::format("{}: {}", explain->call.number, explain->reason.text));
    }
  }
  return out;
}

}  // namespace millrace::gateway
