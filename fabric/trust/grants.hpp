// What a member may write and read: the one place that says it. Pure.
//
//   for (const Grant& grant : grants_of(member, "millrace")) …  // {write, "millrace/v3/reply",
//   "millrace/560aacbf-…"}
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/trust/member.hpp"

namespace millrace::fabric::trust {

enum class Way : std::uint8_t { write, read };

/// One topic in one partition.
struct Grant {
  Way way;
  std::string topic;
  /// A pattern as fnmatch has it; each partition of an endpoint has to fit, as it is written.
  std::string partition;

  auto operator<=>(const Grant&) const = default;
};

/// Sorted, none twice. What is not among them is denied. The member is one without mistake_in().
std::vector<Grant> grants_of(const Member& member, std::string_view fabric);

}  // namespace millrace::fabric::trust
