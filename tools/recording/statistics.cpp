#include "tools/recording/statistics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace millrace::tools::recording {

namespace {

constexpr unsigned fine_bits = 6;
constexpr std::uint64_t fine = 1U << fine_bits;

}  // namespace

std::size_t Histogram::bucket_of(std::uint64_t value) {
  if (value < fine) {
    return static_cast<std::size_t>(value);
  }
  const auto shift = static_cast<unsigned>(std::bit_width(value)) - fine_bits - 1;
  // The top bit is the same for the whole power of two; the next six choose the bucket.
  return (shift + 1) * fine + ((value >> shift) - fine);
}

std::uint64_t Histogram::top_of(std::size_t bucket) {
  if (bucket < fine) {
    return bucket;
  }
  const std::uint64_t shift = bucket / fine - 1;
  const std::uint64_t base = fine + bucket % fine;
  return ((base + 1) << shift) - 1;
}

void Histogram::add(Duration value) {
  value = std::max(value, Duration::zero());
  const std::size_t bucket = bucket_of(static_cast<std::uint64_t>(value.count()));
  if (bucket >= buckets_.size()) {
    buckets_.resize(bucket + 1);
  }
  ++buckets_[bucket];
  ++count_;
  max_ = std::max(max_, value);
}

Histogram::Duration Histogram::percentile(double share) const {
  const auto wanted = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_))));
  std::uint64_t passed = 0;
  for (std::size_t bucket = 0; bucket < buckets_.size(); ++bucket) {
    passed += buckets_[bucket];
    if (passed >= wanted) {
      return std::min(Duration(static_cast<std::int64_t>(top_of(bucket))), max_);
    }
  }
  return {};
}

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
      std::ranges::count_if(recent_, [&](const One& call) { return call.at >= now - window; });
  const auto span = std::clamp<std::chrono::nanoseconds>(now - first_, shortest,
                                                         std::chrono::nanoseconds(window));
  return static_cast<double>(in_window) / std::chrono::duration<double>(span).count();
}

std::optional<std::chrono::nanoseconds> Rate::mean(fabric::Time now) const {
  std::chrono::nanoseconds sum{};
  std::int64_t known = 0;
  for (const One& call : recent_) {
    if (call.at >= now - window && call.duration) {
      sum += *call.duration;
      ++known;
    }
  }
  return known == 0 ? std::nullopt : std::optional(sum / known);
}

}  // namespace millrace::tools::recording
