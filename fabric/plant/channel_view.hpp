// How a channel is shown, and what keeps its calls from running. Pure.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

#include "fabric/plant/concern.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::fabric::plant {

/// How long a state may last until it is a concern. Our choice.
struct Patience {
  /// A new NC program and its service may start together.
  std::chrono::nanoseconds unknown_uuid = std::chrono::seconds(2);
  /// A gateway on a busy host may be late with its heartbeats.
  std::chrono::nanoseconds silent_gateway = std::chrono::seconds(1);
  /// A service that was there may restart.
  std::chrono::nanoseconds lost_service = std::chrono::seconds(1);
  /// A call that waits for a free instance is one to look at, and then needs a person.
  std::chrono::nanoseconds waiting_look = std::chrono::seconds(5);
  std::chrono::nanoseconds waiting_act = std::chrono::minutes(1);
  /// A call that runs this long, and this many times as long as its service needs on average.
  std::chrono::nanoseconds running_look = std::chrono::minutes(1);
  int running_means = 10;
};

enum class Link : std::uint8_t {
  /// The controller answers some gateway.
  up,
  down,
  /// No gateway reports about the machine.
  gone
};
Link link_of(const Plant& plant, std::string_view machine);

/// The gateway that reports why the machine has no connection; nullptr if none reports.
const MachineStatus* gateway_without_link(const Plant& plant, std::string_view machine);

/// The gateway of a machine does not respond, for so short a time that it is no concern.
bool is_silent_for_a_moment(const LostMachine& lost, Time now, const Patience& patience);

/// What keeps the channel's call, or all of its calls, from running; nothing if they run.
std::optional<Kind> obstacle_of(const Plant& plant, const ChannelStatus& status, Time now,
                                const Patience& patience);
/// Of that obstacle, after the time that its state has lasted.
Level level_of(const std::optional<Kind>& obstacle, const ChannelStatus& status, Time now,
               const Patience& patience);
/// Some service of the call's UUID was there.
bool was_served(const ChannelStatus& status);
/// The NC program, if its state is what a view shows of the channel: a call that needs a person may
/// have aborted the program, and a program that waits for its call is not on hold.
const Program* shown_program(const Plant& plant, const ChannelStatus& status,
                             const std::optional<Kind>& obstacle, Level level);

struct ChannelView {
  /// Of its call, or of what keeps all of its calls from running: "idle", "waiting", "overdue",
  /// "link down", "gateway gone", "journal", …
  std::string_view call{};
  Level call_level = Level::fine;
  /// The same, or that of its NC program, whichever is the cause: "program aborted".
  std::string_view state{};
  Level level = Level::fine;
  Time since{};
  /// Why its call, or all of its calls, do not run; empty if they do.
  Message why{};
  bool operator==(const ChannelView&) const = default;
};
ChannelView view_of(const Plant& plant, const ChannelStatus& status, Time now,
                    const Patience& patience = {});

}  // namespace millrace::fabric::plant
