#include <chrono>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

/// A smaller difference is acceptable: recordings stay readable.
constexpr std::chrono::nanoseconds small_difference = std::chrono::milliseconds(100);
/// From here on, times of two hosts cannot be compared.
constexpr std::chrono::nanoseconds large_difference = std::chrono::seconds(10);

}  // namespace

void at_clocks(const Findings& found, Report& report) {
  for (const HostClock& clock : found.clocks) {
    const auto ahead = clock.difference.ahead;
    const auto sure = std::chrono::abs(ahead) - clock.difference.error;
    const std::string text =
        fmt::format("the clock of {} is {} {} this host's (± {}, asked {})", safe(clock.host),
                    print::duration_text(std::chrono::abs(ahead)),
                    ahead < std::chrono::nanoseconds::zero() ? "behind" : "ahead of",
                    print::duration_text(clock.difference.error), safe(clock.program));
    if (sure > large_difference) {
      report.problem(text, "synchronise the hosts (chrony, NTP): deadlines and times are wrong");
    } else if (sure > small_difference) {
      report.warning(text, "synchronise the hosts (chrony, NTP): times in recordings do not agree");
    } else {
      report.fine(text);
    }
  }
}

}  // namespace millrace::tools::doctor::checks
