#include "base/program/repeats.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::base::program {

std::optional<std::string> Repeats::note(const std::string& kind, const std::string& text,
                                         Time now) {
  auto found = heard_.find(kind);
  if (found != heard_.end() && now - found->second.last > std::max(found->second.pause, quiet)) {
    heard_.erase(found);
    found = heard_.end();
  }
  if (found == heard_.end()) {
    if (heard_.size() >= most_kinds) {
      forget_one();
    }
    heard_.emplace(kind, Heard{.times = 1, .said = now, .last = now});
    return text;
  }
  Heard& heard = found->second;
  ++heard.times;
  ++heard.unsaid;
  heard.last = now;
  if (now - heard.said < heard.pause) {
    return std::nullopt;
  }
  const auto span = std::chrono::duration_cast<std::chrono::seconds>(now - heard.said);
  auto line = fmt::format("{} ({} times in {} s)", text, heard.unsaid, span.count());
  heard.unsaid = 0;
  heard.said = now;
  heard.pause = std::min(2 * heard.pause, longest_pause);
  return line;
}

std::uint64_t Repeats::over(const std::string& kind) {
  const auto found = heard_.extract(kind);
  return found.empty() ? 0 : found.mapped().times;
}

void Repeats::forget_one() {
  heard_.erase(std::min_element(heard_.begin(), heard_.end(), [](const auto& a, const auto& b) {
    return a.second.last < b.second.last;
  }));
}

}  // namespace millrace::base::program
