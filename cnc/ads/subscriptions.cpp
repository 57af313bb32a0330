#include "cnc/ads/subscriptions.hpp"

#include <algorithm>
#include <utility>

#include "cnc/ads/symbols.hpp"

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
  if (limits_.habits.by_handle != ErrorCode::none &&
      request.index.group == symbol::value_by_handle) {
    return tl::make_unexpected(limits_.habits.by_handle);
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
  // Whole cycles of the task: its cycle is the smallest step (documented).
  const auto cycles =
      (of_100_ns(request.cycle) + limits_.task_cycle - std::chrono::nanoseconds(1)) /
      limits_.task_cycle;
  subscription.cycle = limits_.task_cycle * std::max<std::int64_t>(cycles, 1);
  subscription.next_sample = now.steady;
  consider(now.steady);
  subscriptions_.emplace(next_handle_, std::move(subscription));
  return next_handle_++;
}

Result<void> Subscriptions::remove(std::uint32_t handle) {
  if (subscriptions_.erase(handle) == 0) {
    return tl::make_unexpected(ErrorCode::invalid_handle);
  }
  for (auto& [route, collected] : collected_) {
    drop(collected, handle);
  }
  std::erase_if(collected_, [](const auto& entry) { return entry.second.samples.empty(); });
  return {};
}

std::size_t Subscriptions::room_of(const CollectedSample& sample) {
  // A small value needs most of its memory for its place in the lists.
  constexpr std::size_t overhead = sizeof(CollectedSample) + 32;
  return overhead + sample.data.size();
}

void Subscriptions::drop(Collected& collected, std::uint32_t handle) {
  std::erase_if(collected.samples, [&](const CollectedSample& sample) {
    const bool its = sample.handle == handle;
    collected_bytes_ -= its ? room_of(sample) : 0;
    return its;
  });
}

Subscriptions::Time Subscriptions::next_moment(const Subscription& subscription, Time now) const {
  const auto cycle = subscription.cycle;
  const auto since = now.time_since_epoch() - limits_.offset;
  return Time((since / cycle + 1) * cycle + limits_.offset);
}

Subscriptions::Kept Subscriptions::give_up() && {
  return {std::move(subscriptions_), next_handle_};
}

void Subscriptions::adopt(Kept kept, Moment now) {
  for (auto& entry : kept.subscriptions) {
    if (subscriptions_.size() < limits_.handles) {
      entry.second.next_sample = now.steady;
      consider(now.steady);
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
  const bool too_much = collected_bytes_ > limits_.collected_bytes;
  for (auto at = collected_.begin(); at != collected_.end();) {
    const auto& [route, collected] = *at;
    if (collected.due > now.steady && !too_much) {
      ++at;
      continue;
    }
    out.bytes(frame(route, collected));
    for (const CollectedSample& sample : collected.samples) {
      collected_bytes_ -= room_of(sample);
    }
    at = collected_.erase(at);
  }
  due_.reset();
  for (const auto& [handle, subscription] : subscriptions_) {
    if (!subscription.invalid) {
      consider(subscription.next_sample);
    }
  }
  for (const auto& [route, collected] : collected_) {
    consider(collected.due);
  }
  return out.take();
}

void Subscriptions::sample(std::uint32_t handle, Subscription& subscription, Moment now) {
  const auto& request = subscription.request;
  auto value = device_.read(subscription.route.from.port, request.index, request.length);
  // After a delay, the missed samples are skipped.
  subscription.next_sample = next_moment(subscription, now.steady);
  const bool first = !std::exchange(subscription.sampled, true);
  if (!value) {
    // A sample without data, sent once, means that the handle is no longer valid (documented).
    subscription.invalid = true;
    collect(subscription, {now.filetime, handle, {}}, now);
    return;
  }
  if (request.mode == Transmission::on_change && subscription.last == *value) {
    return;
  }
  subscription.last = *value;
  const SubscriptionBehaviour& habits = limits_.habits;
  using Notifies = SubscriptionBehaviour::Notifies;
  const bool tells =
      habits.tells == Notifies::changes || (habits.tells == Notifies::first_value && first);
  const bool lost = habits.lose_every != 0 && ++samples_ % habits.lose_every == 0;
  if (tells && !lost) {
    collect(subscription, {now.filetime, handle, std::move(*value)}, now);
  }
}

void Subscriptions::collect(const Subscription& subscription, CollectedSample sample, Moment now) {
  const auto due = now.steady + of_100_ns(subscription.request.max_delay) + limits_.habits.delay;
  auto& collected = collected_.try_emplace(subscription.route, Collected{{}, due}).first->second;
  collected.due = std::min(collected.due, due);
  collected_bytes_ += room_of(sample);
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

namespace {

constexpr std::size_t add_size = 40;
constexpr std::size_t handle_bytes = 4;

class NotificationAnswer {
 public:
  NotificationAnswer(Subscriptions& subscriptions, const Header& header, Moment now)
      : subscriptions_(subscriptions), header_(header), now_(now) {}

  std::optional<Bytes> operator()(const AddNotificationRequest& request) const {
    return encode_handle(subscriptions_.add(header_, request, now_));
  }
  std::optional<Bytes> operator()(const DeleteNotificationRequest& request) const {
    return encode_result(subscriptions_.remove(request.handle));
  }
  std::optional<Bytes> operator()(const ReadWriteRequest& request) const {
    const std::size_t count = request.index.offset;
    if (request.index.group == sum::add_notifications) {
      const auto fits = request.data.size() == count * add_size &&
                        request.read_length >= count * 2 * sizeof(std::uint32_t);
      return encode_data(fits ? add_all(request.data)
                              : tl::make_unexpected(ErrorCode::invalid_size));
    }
    if (request.index.group == sum::delete_notifications) {
      const auto fits = request.data.size() == count * handle_bytes &&
                        request.read_length >= count * sizeof(std::uint32_t);
      return encode_data(fits ? delete_all(request.data)
                              : tl::make_unexpected(ErrorCode::invalid_size));
    }
    return std::nullopt;
  }
  template <typename Other>
  std::optional<Bytes> operator()(const Other&) const {
    return std::nullopt;
  }

 private:
  [[nodiscard]] Result<Bytes> add_all(BytesView items) const {
    ByteReader in(items);
    ByteWriter out;
    while (!in.rest().empty()) {
      const auto handle = subscriptions_.add(header_, parse_add_notification(in), now_);
      const auto code = handle ? ErrorCode::none : handle.error();
      out.u32(static_cast<std::uint32_t>(code)).u32(handle.value_or(0));
    }
    return out.take();
  }
  [[nodiscard]] Result<Bytes> delete_all(BytesView handles) const {
    ByteReader in(handles);
    ByteWriter out;
    while (!in.rest().empty()) {
      out.bytes(encode_result(subscriptions_.remove(in.u32())));
    }
    return out.take();
  }

  Subscriptions& subscriptions_;
  const Header& header_;
  Moment now_;
};

}  // namespace

std::optional<Bytes> answer_notification(Subscriptions& subscriptions, const Packet& packet,
                                         Moment now) {
  const auto request = decode_request(packet.header.command, packet.data);
  return request ? std::visit(NotificationAnswer(subscriptions, packet.header, now), *request)
                 : std::nullopt;
}

}  // namespace millrace::cnc::ads
