#include "tools/recording/rates.hpp"

#include <algorithm>

namespace millrace::tools::recording {

namespace {

/// A shorter burst gives no rate per second yet.
constexpr std::chrono::nanoseconds shortest = std::chrono::seconds(1);

}  // namespace

void Rate::add(fabric::Time now, std::optional<std::chrono::nanoseconds> duration) {
  if (count_++ == 0) {
    first_ = now;
  }
  recent_.push_back({now, duration});
  while (recent_.front().at < now - window) {
    recent_.pop_front();
  }
}

double Rate::per_second(fabric::Time now) const {
  const auto in_window =
      std::ranges::count_if(recent_, [&](const One& one) { return one.at >= now - window; });
  const auto span = std::clamp<std::chrono::nanoseconds>(now - first_, shortest,
                                                         std::chrono::nanoseconds(window));
  return static_cast<double>(in_window) / std::chrono::duration<double>(span).count();
}

std::optional<std::chrono::nanoseconds> Rate::mean(fabric::Time now) const {
  std::chrono::nanoseconds sum{};
  std::int64_t known = 0;
  for (const One& one : recent_) {
    if (one.at >= now - window && one.duration) {
      sum += *one.duration;
      ++known;
    }
  }
  return known == 0 ? std::nullopt : std::optional(sum / known);
}

}  // namespace millrace::tools::recording
