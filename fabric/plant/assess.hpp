// What of a plant is wrong: the only place that judges its states. Pure.
//
//   for (const Concern& concern : assess(plant, now, {.flags = " --domain 7"})) …   // the worst first
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/plant/concern.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::fabric::plant {

/// How long a state may last until it is a concern. Our choice.
struct Patience {
  /// A new NC program and its service may start together.
  std::chrono::nanoseconds unknown_uuid = std::chrono::seconds(2);
  /// A service that was there may restart.
  std::chrono::nanoseconds lost_service = std::chrono::seconds(1);
  /// A call that waits for a free instance is one to look at, and then needs a person.
  std::chrono::nanoseconds waiting_look = std::chrono::seconds(5);
  std::chrono::nanoseconds waiting_act = std::chrono::minutes(1);
};

struct View {
  /// For suggested commands (fabric::profile::given_flags).
  std::string flags{};
  Patience patience{};
};

/// One concern for each cause: a gateway that is gone is one with all of its machines, a service
/// without an instance one with all channels that wait for it. Sorted.
std::vector<Concern> assess(const Plant& plant, Time now, const View& view = {});
/// By level, then by urgency and age.
void sort(std::vector<Concern>& concerns);

/// The worst level; fine if there is none.
Level level_of(const std::vector<Concern>& concerns);

/// How a channel is shown.
struct ChannelView {
  /// Of its call, or of what keeps all of its calls from running: "idle", "waiting", "overdue",
  /// "link down", "gateway gone", "journal", …
  std::string_view call{};
  Level call_level = Level::fine;
  /// The same, or that of its NC program, whichever is the cause: "program aborted".
  std::string_view state{};
  Level level = Level::fine;
  Time since{};
  bool operator==(const ChannelView&) const = default;
};
ChannelView view_of(const Plant& plant, const ChannelStatus& status, Time now,
                    const Patience& patience = {});

/// Whether the machine has a controller that answers some gateway: "up", "down", or "gone" without
/// a gateway.
std::string_view link_of(const Plant& plant, std::string_view machine);

}  // namespace millrace::fabric::plant
