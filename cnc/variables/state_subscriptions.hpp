// Notifications from the controller when REQUEST_STATE and RESPONSE_STATE of channels change.
//
//   StateSubscriptions subscriptions(client, "CH[{channel}].{variable}", on_state);
//   auto outcomes = co_await subscriptions.subscribe({1, 2});     // one for each: granted, or the error
//   → on_state(1, ServiceVariable::request_state, 7)
//   co_await subscriptions.unsubscribe({1});
//
// Each variable needs a handle for its symbol name (0xF003) and a notification on that handle
// (0xF005): on change, sampled every millisecond or in the cycle of the controller, sent at once.
// Not documented, so tried: that the variables of a CNC are symbols of port 552, how these are
// named, and that notifications on them are granted.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cnc/variables/channel.hpp"
#include "cnc/variables/service_variable.hpp"

namespace millrace::cnc::variables {

/// Without a value, the handle has become invalid: no further notification of this variable
/// follows.
using StateNotificationHandler =
    std::function<void(std::uint16_t channel, ServiceVariable, std::optional<std::uint32_t> value)>;

struct SubscriptionOutcome {
  std::uint16_t channel = 0;
  /// none = both states have a notification.
  ads::ErrorCode error = ads::ErrorCode::none;
  /// What was refused, as text with the code.
  std::string refusal{};
};

/// The client must outlive the pending requests. One subscribe() or unsubscribe() at a time.
class StateSubscriptions {
 public:
  /// `symbol` contains {channel} and {variable}. `on_state` is not called after forget() or
  /// leave().
  StateSubscriptions(ads::Client& client, std::string symbol, StateNotificationHandler on_state)
      : client_(client), symbol_(std::move(symbol)), on_state_(std::move(on_state)) {}

  /// Subscribes to both states of each channel; results in the order of `channels`. If one state of
  /// a channel is refused, neither has a notification.
  boost::asio::awaitable<std::vector<SubscriptionOutcome>> subscribe(
      std::vector<std::uint16_t> channels);
  boost::asio::awaitable<void> unsubscribe(std::vector<std::uint16_t> channels);
  /// Closes the client, and releases all handles at the controller.
  void leave();
  /// The connection is lost.
  void forget() { subscribed_.clear(); }

 private:
  struct Subscribed {
    std::vector<std::uint32_t> symbols;
    std::vector<std::uint32_t> notifications;
  };
  using Handles = std::vector<ads::Result<std::uint32_t>>;

  [[nodiscard]] std::string name_of_symbol(std::uint16_t channel, ServiceVariable variable) const;
  boost::asio::awaitable<Handles> symbol_handles(std::vector<std::string> names);
  boost::asio::awaitable<void> release(std::vector<std::uint32_t> symbols);

  ads::Client& client_;
  std::string symbol_;
  StateNotificationHandler on_state_;
  std::map<std::uint16_t, Subscribed> subscribed_;
};

}  // namespace millrace::cnc::variables
