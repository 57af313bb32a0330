#include "fabric/log_limiter.hpp"

#include <fmt/format.h>

namespace millrace::fabric {

std::optional<std::string> LogLimiter::admit(const std::string& kind, const std::string& about,
                                             const std::string& text, SteadyTime now) {
  const auto place = kinds_.find({kind, about});
  if (place != kinds_.end()) {
    return admit(place->second, text, now);
  }
  if (kinds_.size() >= most_kinds) {
    // A subject that was silent for this long does not use up the limit.
    std::erase_if(kinds_, [&](const auto& entry) { return now - entry.second.since >= 2 * pause; });
  }
  if (kinds_.size() < most_kinds) {
    kinds_.emplace(std::pair(kind, about), Kind{.since = now, .text = text});
    return text;
  }
  const std::string line = fmt::format("{}; problems of more kinds are only counted", text);
  if (others_) {
    return admit(*others_, line, now);
  }
  others_ = Kind{.since = now};
  return line;
}

std::optional<std::string> LogLimiter::admit(Kind& line, const std::string& text, SteadyTime now) {
  if (now - line.since < pause) {
    ++line.more;
    line.text = text;
    return std::nullopt;
  }
  const std::uint64_t more = line.more;
  line = {.since = now, .text = text};
  return more > 0 ? fmt::format("{} (and {} more like this before)", text, more) : text;
}

std::vector<std::string> LogLimiter::due(SteadyTime now) {
  std::vector<std::string> lines;
  for (auto place = kinds_.begin(); place != kinds_.end();) {
    Kind& line = place->second;
    if (now - line.since < pause) {
      ++place;
    } else if (line.more == 0) {
      place = kinds_.erase(place);
    } else {
      lines.push_back(fmt::format("{} (and {} more like this in {} s)", line.text, line.more - 1,
                                  pause.count()));
      line = {.since = now, .text = line.text};
      ++place;
    }
  }
  if (others_ && now - others_->since >= pause) {
    if (others_->more > 0) {
      lines.push_back(
          fmt::format("{} problems of other kinds in {} s", others_->more, pause.count()));
    }
    others_.reset();
  }
  return lines;
}

bool Throttle::admit(SteadyTime now) {
  if (!since_) {
    since_ = now;
    asked_ = 0;
  }
  return ++asked_ <= most_;
}

std::optional<std::uint64_t> Throttle::due(SteadyTime now) {
  if (!since_ || now - *since_ < window_) {
    return std::nullopt;
  }
  since_.reset();
  return asked_ > most_ ? std::optional(asked_ - most_) : std::nullopt;
}

}  // namespace millrace::fabric
