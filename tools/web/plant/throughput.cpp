#include "tools/web/plant/throughput.hpp"

#include <algorithm>
#include <vector>

namespace millrace::tools::web::plant {

namespace {

/// Shorter bursts do not allow a rate per second.
constexpr std::chrono::nanoseconds shortest = std::chrono::seconds(1);
constexpr std::chrono::nanoseconds minute = std::chrono::minutes(1);

}  // namespace

std::chrono::nanoseconds percentile(std::vector<std::chrono::nanoseconds>& values, double share) {
  const auto rank = static_cast<std::size_t>(static_cast<double>(values.size()) * share);
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(std::min(rank, values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

void Throughput::add(fabric::SteadyTime now, std::optional<std::chrono::nanoseconds> duration,
                     bool failed) {
  recent_.push_back({now, duration, failed});
  while (recent_.front().at < now - window_) {
    recent_.pop_front();
  }
  if (failed) {
    errors_.push_back(now);
  }
  while (!errors_.empty() && (errors_.front() < now - minute || errors_.size() > most)) {
    errors_.pop_front();
  }
  if (recent_.size() > most) {
    recent_.pop_front();
    complete_since_ = recent_.front().at;
  }
}

Figures Throughput::figures(fabric::SteadyTime now, fabric::SteadyTime begun) const {
  Figures figures;
  std::size_t calls = 0;
  figures.errors_last_minute = static_cast<std::size_t>(
      std::ranges::count_if(errors_, [&](fabric::SteadyTime at) { return at >= now - minute; }));
  std::chrono::nanoseconds sum{};
  std::vector<std::chrono::nanoseconds> durations;
  for (const One& call : recent_) {
    if (call.at < now - window_) {
      continue;
    }
    ++calls;
    if (call.duration) {
      durations.push_back(*call.duration);
      sum += *call.duration;
    }
  }
  if (calls == 0) {
    return figures;
  }
  const auto since = std::max(begun, complete_since_.value_or(begun));
  const double span = std::chrono::duration<double>(
                          std::clamp<std::chrono::nanoseconds>(now - since, shortest, window_))
                          .count();
  figures.per_second = static_cast<double>(calls) / span;
  if (!durations.empty()) {
    figures.mean = sum / static_cast<std::int64_t>(durations.size());
    figures.p50 = percentile(durations, 0.5);
    figures.p99 = percentile(durations, 0.99);
  }
  return figures;
}

bool Throughput::is_moving(fabric::SteadyTime now) const {
  return (!recent_.empty() && recent_.back().at >= now - window_) ||
         (!errors_.empty() && errors_.back() >= now - minute);
}

}  // namespace millrace::tools::web::plant
