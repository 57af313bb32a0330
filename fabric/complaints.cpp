#include "fabric/complaints.hpp"

#include <fmt/format.h>

namespace millrace::fabric {

std::optional<std::string> Complaints::note(const std::string& kind, const std::string& about,
                                            const std::string& text, SteadyTime now) {
  const auto place = heard_.find({kind, about});
  if (place != heard_.end()) {
    ++place->second.more;
    place->second.text = text;
    return std::nullopt;
  }
  if (heard_.size() < most_kinds) {
    heard_.emplace(std::pair(kind, about), Heard{.since = now, .text = text});
    return text;
  }
  if (others_) {
    ++others_->more;
    return std::nullopt;
  }
  others_ = Heard{.since = now};
  return fmt::format("{}; more is wrong than is told one by one", text);
}

std::vector<std::string> Complaints::due(SteadyTime now) {
  std::vector<std::string> lines;
  for (auto place = heard_.begin(); place != heard_.end();) {
    Heard& heard = place->second;
    if (now - heard.since < pause) {
      ++place;
    } else if (heard.more == 0) {
      place = heard_.erase(place);
    } else {
      lines.push_back(fmt::format("{} (and {} more like this in {} s)", heard.text, heard.more - 1,
                                  pause.count()));
      heard = {.since = now, .text = heard.text};
      ++place;
    }
  }
  if (others_ && now - others_->since >= pause) {
    if (others_->more > 0) {
      lines.push_back(fmt::format("{} messages were wrong in other ways in {} s", others_->more,
                                  pause.count()));
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
