#include "services/dial_gauge/receiver.hpp"

#include <fmt/format.h>

namespace millrace::services::dial_gauge {

void Receiver::opened() {
  down_.reset();
  frames_.reset();
}

void Receiver::closed(std::string reason) {
  down_ = std::move(reason);
  frames_.reset();
}

std::vector<std::string> Receiver::hear(std::string_view bytes, Time now) {
  std::vector<std::string> broken;
  frames_.feed(bytes, [&](const Frame& frame) {
    if (const auto* value = std::get_if<ValueFrame>(&frame)) {
      Channel& channel = channels_[value->channel];
      channel.newest = Reading{.value = value->value, .taken = now};
      channel.error.reset();
      ++channel.values;
    } else if (const auto* error = std::get_if<ErrorFrame>(&frame)) {
      Channel& channel = channels_[error->channel];
      channel.error = error->code;
      ++channel.errors;
    } else if (const auto* unknown = std::get_if<BrokenFrame>(&frame)) {
      broken.push_back(unknown->text);
    }
  });
  return broken;
}

tl::expected<Reading, Failure> Receiver::newest(unsigned channel) const {
  if (down_) {
    return tl::unexpected(Failure{Fault::line_down, *down_});
  }
  const auto found = channels_.find(channel);
  if (found == channels_.end()) {
    return tl::unexpected(
        Failure{Fault::no_contact, fmt::format("nothing received on radio channel {}", channel)});
  }
  if (found->second.error) {
    return tl::unexpected(
        Failure{Fault::no_contact, fmt::format("the receiver reports error {} on radio channel {}",
                                               *found->second.error, channel)});
  }
  return *found->second.newest;
}

Condition Receiver::condition(unsigned channel) const {
  const auto found = channels_.find(channel);
  if (found == channels_.end()) {
    return {};
  }
  return {.battery_percent = std::nullopt,
          .readings = found->second.values,
          .failures = found->second.errors};
}

}  // namespace millrace::services::dial_gauge
