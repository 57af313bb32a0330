// The gateway's name for fabric/moment.hpp, and times that may not come.
#pragma once

#include <initializer_list>
#include <optional>

#include "fabric/moment.hpp"

namespace millrace::gateway {

using fabric::Moment;
using fabric::SteadyTime;

/// The first of those that come; nothing if none does.
[[nodiscard]] inline std::optional<SteadyTime> earliest(
    std::initializer_list<std::optional<SteadyTime>> times) {
  std::optional<SteadyTime> first;
  for (const auto& time : times) {
    if (time && (!first || *time < *first)) {
      first = time;
    }
  }
  return first;
}

}  // namespace millrace::gateway
