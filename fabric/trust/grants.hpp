// Show what a participant may write and read: the one place that says it. Pure.
//
//   for (const Grant& grant : grants_of(participant, "millrace")) …  // {write, "millrace/v4/reply",
//   "millrace/560aacbf-…"}
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/trust/participant.hpp"

namespace millrace::fabric::trust {

enum class Access : std::uint8_t { write, read };

/// One topic in one partition.
struct Grant {
  Access access;
  std::string topic;
  /// A pattern for fnmatch; each partition of an endpoint must match it literally.
  std::string partition;

  auto operator<=>(const Grant&) const = default;
};

/// Sorted, without repeats. Everything else is denied. The participant has passed mistake_in().
std::vector<Grant> grants_of(const Participant& participant, std::string_view fabric);

}  // namespace millrace::fabric::trust
