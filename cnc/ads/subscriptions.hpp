// The device notifications of one connection: when a value is sampled, and when samples are sent.
// Pure: the caller passes the time and sends the frames.
//
//   auto handle = subscriptions.add(header, request, now);   // answer this first …
//   send(subscriptions.poll(now));                           // … then the first sample
//   wait_until(subscriptions.next_due());
//
// Timing (IB/tc3_ads_intro, documented): a value is sampled once per cycle, at most once in a cycle
// of the task; on change, a sample is sent only if it differs from the last one. Samples may be
// collected for the max delay. All values are sampled at the same times of the task's clock, so
// that those of one cycle share a frame, as they do with a TwinCAT (Beckhoff/ADS#276). All
// durations are in 100 ns on the wire, as in Beckhoff's own libraries (the protocol page says 1
// ms).
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "cnc/ads/frame.hpp"
#include "cnc/ads/request.hpp"
#include "cnc/ads/response.hpp"

namespace millrace::cnc::ads {

/// The time of both clocks.
struct Moment {
  std::chrono::steady_clock::time_point steady;
  /// 100 ns since 1601-01-01 UTC.
  std::uint64_t filetime = 0;
};

/// How a server may treat subscriptions, to test clients: no documentation guarantees better
/// behaviour.
struct SubscriptionBehaviour {
  /// The response to a subscription by handle (0xF005); none = it is granted.
  ErrorCode by_handle = ErrorCode::none;
  enum class Notifies : std::uint8_t { changes, first_value, nothing };
  Notifies tells = Notifies::changes;
  /// Extra delay before samples are sent.
  std::chrono::milliseconds delay{0};
  /// Every n-th sample is not sent; 0 = none.
  std::uint32_t lose_every = 0;
};

struct SubscriptionLimits {
  /// The cycle of the task behind the AMS ports: the shortest sample period.
  std::chrono::nanoseconds task_cycle = std::chrono::milliseconds(1);
  /// The time between the beginning of a cycle and the sampling, so that the task runs first.
  std::chrono::nanoseconds offset{0};
  /// The most notifications of one connection; Beckhoff recommends at most 550 for a device
  /// (documented).
  std::size_t handles = 550;
  /// For one connection: when the samples that wait for their max delay need more memory than this,
  /// all are sent.
  std::size_t collected_bytes = 65536;
  SubscriptionBehaviour habits{};
};

class Subscriptions {
 public:
  using Time = std::chrono::steady_clock::time_point;

 private:
  // From one of our AMS ports to a subscriber.
  struct Route {
    Address from;
    Address to;
    auto operator<=>(const Route&) const = default;
  };
  struct Subscription {
    Route route;
    AddNotificationRequest request;
    std::chrono::nanoseconds cycle{};
    Time next_sample;
    std::optional<Bytes> last;
    // The value became unreadable, and the subscriber has been notified.
    bool invalid = false;
    // The first value was sampled.
    bool sampled = false;
  };

 public:
  /// The part of the state that may outlive a connection (Lingering).
  struct Kept {
    std::map<std::uint32_t, Subscription> subscriptions;
    std::uint32_t next_handle = 1;
  };

  Subscriptions(Device& device, const SubscriptionLimits& limits)
      : device_(device), limits_(limits) {}

  /// Returns a new handle for the sender of `header`. Fails with the error of a read of the value,
  /// with transmission_not_supported, or with no_more_handles.
  Result<std::uint32_t> add(const Header& header, const AddNotificationRequest& request,
                            Moment now);
  Result<void> remove(std::uint32_t handle);
  [[nodiscard]] std::size_t size() const { return subscriptions_.size(); }

  /// Takes the samples that are due, and returns the frames that are due.
  Bytes poll(Moment now);
  /// When poll() is needed next; after a removal perhaps too early.
  [[nodiscard]] std::optional<Time> next_due() const { return due_; }

  /// What outlives the connection.
  Kept give_up() &&;
  /// Continues these subscriptions under their old handles, up to the limit.
  void adopt(Kept kept, Moment now);

 private:
  struct CollectedSample {
    std::uint64_t filetime = 0;
    std::uint32_t handle = 0;
    Bytes data;
  };
  // Samples that wait for their max delay, in the order of their time.
  struct Collected {
    std::vector<CollectedSample> samples;
    Time due;
  };

  [[nodiscard]] Time next_moment(const Subscription& subscription, Time now) const;
  static std::size_t room_of(const CollectedSample& sample);
  void drop(Collected& collected, std::uint32_t handle);
  void sample(std::uint32_t handle, Subscription& subscription, Moment now);
  void collect(const Subscription& subscription, CollectedSample sample, Moment now);
  static Bytes frame(const Route& route, const Collected& collected);
  void consider(Time due) { due_ = due_ ? std::min(*due_, due) : due; }

  Device& device_;
  SubscriptionLimits limits_;
  std::map<std::uint32_t, Subscription> subscriptions_;
  std::map<Route, Collected> collected_;
  // Memory of all collected samples.
  std::size_t collected_bytes_ = 0;
  std::uint64_t samples_ = 0;
  std::uint32_t next_handle_ = 1;
  // Kept, since it is asked for after each request.
  std::optional<Time> due_;
};

// Answers the requests that add and delete device notifications, single ones and sums.

namespace sum {
/// Index groups of ReadWrites; the index offset is the number of items. In: 40 bytes for each
/// notification. Out: result and handle of each.
inline constexpr std::uint32_t add_notifications = 0xF085;
/// In: handles. Out: all results.
inline constexpr std::uint32_t delete_notifications = 0xF086;
}  // namespace sum

/// The payload of the response; nullopt for any other request.
std::optional<Bytes> answer_notification(Subscriptions& subscriptions, const Packet& packet,
                                         Moment now);

}  // namespace millrace::cnc::ads
