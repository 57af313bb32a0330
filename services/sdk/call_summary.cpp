#include "services/sdk/call_summary.hpp"

#include <fmt/format.h>

namespace millrace::services::sdk {

std::optional<std::string> call_summary(const fabric::InstanceStatus& before,
                                        const fabric::InstanceStatus& now,
                                        std::chrono::seconds span) {
  const std::uint64_t answered = now.answered - before.answered;
  const std::uint64_t failed = now.failed - before.failed;
  const std::uint64_t repeated = now.repeated - before.repeated;
  const std::uint64_t cancelled = now.cancelled - before.cancelled;
  const std::uint64_t declined = now.declined - before.declined;
  if (answered + repeated + cancelled + declined == 0) {
    return std::nullopt;
  }
  std::string text = fmt::format("{} {} answered in {} s", answered,
                                 answered == 1 ? "call" : "calls", span.count());
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) {
      text += fmt::format(", {} {}", count, what);
    }
  };
  add(failed, "with an error");
  add(repeated, "again from memory");
  add(cancelled, "withdrawn");
  add(declined, "declined");
  add(now.running, "still running");
  return text;
}

}  // namespace millrace::services::sdk
