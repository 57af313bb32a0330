#include "cnc/ads/subscriptions.hpp"

#include <algorithm>
#include <utility>

namespace millrace::cnc::ads {
namespace {

// A duration on the wire.
std::chrono::nanoseconds of_100_ns(std::uint32_t count) {
  return std::chrono::nanoseconds(100) * count;
}

bool is_supported(Transmission mode) {
  return mode == Transmission::cyclic || mode == Transmission::on_change;
}

}  // namespace

Result<std::uint32_t> Subscriptions::add(const Header& header,
                                         const AddNotificationRequest& request, Moment now) {
  if (!is_supported(request.mode)) {
    return tl::make_unexpected(ErrorCode::transmission_not_supported);
  }
  if (subscriptions_.size() >= limits_.handles) {
    return tl::make_unexpected(ErrorCode::no_more_handles);
  }
  const auto value = device_.read(header.target.port, request.index, request.length);
  if (!value) {
    return tl::make_unexpected(value.error());
  }
  Subscription subscription;
  subscription.route = {header.target, header.source};
  subscription.request = request;
  subscription.cycle = std::max(of_100_ns(request.cycle), limits_.task_cycle);
  subscription.next_sample = now.steady;
  subscriptions_.emplace(next_handle_, std::move(subscription));
  return next_handle_++;
}

Result<void> Subscriptions::remove(std::uint32_t handle) {
  if (subscriptions_.erase(handle) == 0) {
    return tl::make_unexpected(ErrorCode::invalid_handle);
  }
  for (auto& [route, collected] : collected_) {
    std::erase_if(collected.samples,
                  [handle](const CollectedSample& sample) { return sample.handle == handle; });
  }
  std::erase_if(collected_, [](const auto& entry) { return entry.second.samples.empty(); });
  return {};
}

Subscriptions::Kept Subscriptions::give_up() {
  collected_.clear();
  return {std::exchange(subscriptions_, {}), next_handle_};
}

void Subscriptions::adopt(Kept kept, Moment now) {
  for (auto& entry : kept.subscriptions) {
    if (subscriptions_.size() < limits_.handles) {
      entry.second.next_sample = now.steady;
      subscriptions_.insert(std::move(entry));
    }
  }
  next_handle_ = std::max(next_handle_, kept.next_handle);
}

Bytes Subscriptions::poll(Moment now) {
  for (auto& [handle, subscription] : subscriptions_) {
    if (!subscription.invalid && subscription.next_sample <= now.steady) {
      sample(handle, subscription, now);
    }
  }
  ByteWriter out;
  for (auto at = collected_.begin(); at != collected_.end();) {
    const auto& [route, collected] = *at;
    if (collected.due > now.steady && collected.bytes <= limits_.collected_bytes) {
      ++at;
      continue;
    }
    out.bytes(frame(route, collected));
    at = collected_.erase(at);
  }
  return out.take();
}

std::optional<Subscriptions::Time> Subscriptions::next_due() const {
  std::optional<Time> next;
  const auto consider = [&next](Time time) { next = next ? std::min(*next, time) : time; };
  for (const auto& [handle, subscription] : subscriptions_) {
    if (!subscription.invalid) {
      consider(subscription.next_sample);
    }
  }
  for (const auto& [route, collected] : collected_) {
    consider(collected.due);
  }
  return next;
}

void Subscriptions::sample(std::uint32_t handle, Subscription& subscription, Moment now) {
  const auto& request = subscription.request;
  auto value = device_.read(subscription.route.from.port, request.index, request.length);
  subscription.next_sample += subscription.cycle;
  if (subscription.next_sample <= now.steady) {
    subscription.next_sample = now.steady + subscription.cycle;  // late: what was missed is gone
  }
  if (!value) {
    // A sample without data says that the handle is no longer valid, once (documented).
    subscription.invalid = true;
    collect(subscription, {now.filetime, handle, {}}, now);
    return;
  }
  if (request.mode == Transmission::on_change && subscription.last == *value) {
    return;
  }
  subscription.last = *value;
  collect(subscription, {now.filetime, handle, std::move(*value)}, now);
}

void Subscriptions::collect(const Subscription& subscription, CollectedSample sample, Moment now) {
  const auto due = now.steady + of_100_ns(subscription.request.max_delay);
  auto& collected = collected_.try_emplace(subscription.route, Collected{{}, 0, due}).first->second;
  collected.due = std::min(collected.due, due);
  collected.bytes += sample.data.size();
  collected.samples.push_back(std::move(sample));
}

Bytes Subscriptions::frame(const Route& route, const Collected& collected) {
  std::vector<Stamp> stamps;
  for (const auto& sample : collected.samples) {
    if (stamps.empty() || stamps.back().time != sample.filetime) {
      stamps.push_back({sample.filetime, {}});
    }
    stamps.back().samples.push_back({sample.handle, sample.data});
  }
  const Header header{route.to,           route.from,      Command::notification,
                      flags::ads_command, ErrorCode::none, 0};
  return encode_packet(header, encode_notification(stamps));
}

}  // namespace millrace::cnc::ads
