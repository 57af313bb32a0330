#include "base/program/repeats.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::base::program {

std::optional<std::string> Repeats::note(const std::string& kind, const std::string& text,
                                         Time now) {
  auto found = lines_.find(kind);
  if (found != lines_.end() && now - found->second.last > std::max(found->second.pause, quiet)) {
    lines_.erase(found);
    found = lines_.end();
  }
  if (found == lines_.end()) {
    if (lines_.size() >= most_kinds) {
      forget_one();
    }
    lines_.emplace(kind, Line{.times = 1, .logged = now, .last = now});
    return text;
  }
  Line& known = found->second;
  ++known.times;
  ++known.unlogged;
  known.last = now;
  if (now - known.logged < known.pause) {
    return std::nullopt;
  }
  const auto span = std::chrono::duration_cast<std::chrono::seconds>(now - known.logged);
  auto line = fmt::format("{} ({} times in {} s)", text, known.unlogged, span.count());
  known.unlogged = 0;
  known.logged = now;
  known.pause = std::min(2 * known.pause, longest_pause);
  return line;
}

std::uint64_t Repeats::over(const std::string& kind) {
  const auto found = lines_.extract(kind);
  return found.empty() ? 0 : found.mapped().times;
}

void Repeats::forget_one() {
  lines_.erase(std::min_element(lines_.begin(), lines_.end(), [](const auto& a, const auto& b) {
    return a.second.last < b.second.last;
  }));
}

}  // namespace millrace::base::program
