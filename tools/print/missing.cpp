#include "tools/print/missing.hpp"

#include <fmt/format.h>

namespace millrace::tools::print {

namespace {

std::string counted(std::uint64_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace

std::array<std::pair<std::string_view, std::uint64_t>, 6> missing_counts(
    const recording::Missing& missing) {
  return {{{"calls_complete", missing.complete},
           {"calls_incomplete", missing.incomplete},
           {"calls_unseen", missing.unseen},
           {"missing_requests", missing.requests},
           {"missing_replies", missing.replies},
           {"missing_events", missing.events}}};
}

std::string missing_text(const recording::Missing& missing) {
  std::string text = fmt::format("{} complete", counted(missing.complete, "call is", "calls are"));
  if (missing.incomplete > 0) {
    text += fmt::format("; {} incomplete: at least {}, {} and {} are missing",
                        counted(missing.incomplete, "call is", "calls are"),
                        counted(missing.requests, "request", "requests"),
                        counted(missing.replies, "reply", "replies"),
                        counted(missing.events, "event", "events"));
  }
  if (missing.unseen > 0) {
    text += fmt::format("; {} not received", counted(missing.unseen, "call was", "calls were"));
  }
  return text;
}

}  // namespace millrace::tools::print
