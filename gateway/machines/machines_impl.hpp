// What Machines keeps to itself: each machine of the configuration, and how far it is with it.
#pragma once

#include <map>
#include <optional>
#include <set>

#include "fabric/complaints.hpp"
#include "gateway/machines/claims.hpp"
#include "gateway/machines/machine_report.hpp"
#include "gateway/machines/machines.hpp"

namespace millrace::gateway::machines {

using Channels = std::vector<std::uint16_t>;

/// One machine of the configuration.
struct MachineState {
  settings::MachineSettings settings;
  MachineReport report;
  /// Counts how often it began to listen for other gateways.
  unsigned listening = 0;
  bool listens = false;
  SteadyTime listens_since{};
  /// It may have served already; then its claim is not moved behind those of others.
  bool has_served = false;
  std::unique_ptr<Link> link{};
  bool up = false;
  /// What the controller has, while the link is up.
  Channels found{};
  std::set<std::uint16_t> served{};
  /// The configuration names it no more.
  bool leaving = false;
  /// Who serves it in our place, as it was logged last.
  std::string refusal{};
  /// What is missing although it is up: channels that others serve.
  std::string note{};
  Watch watch{settings.watch};
  /// When on_time() of the watch is asked for.
  std::optional<SteadyTime> watch_time{};
};

struct Machines::Impl final : LinkEvents, std::enable_shared_from_this<Impl> {
  Impl(GatewayIdentity the_own, MachinesIo& the_hands, MachinesListener& the_listener)
      : own(std::move(the_own)), hands(the_hands), listener(the_listener), claims(own.id) {}

  // What the links say, also one that was taken away a moment ago.
  void on_link_up(const std::string& machine, const Channels& channels) override {
    if (MachineState* one = linked(machine)) {
      one->up = true;
      one->found = channels;
      serve(*one);
    }
  }
  void on_link_down(const std::string& machine, const std::string& reason) override {
    if (MachineState* one = linked(machine)) {
      one->up = false;
      one->served.clear();
      forget_watch(*one);
      if (one->refusal.empty()) {
        one->report.on_down(reason, hands.now());
      }
      listener.on_link_down(machine, reason);
      publish(*one);
    }
  }
  void on_read(const fabric::ChannelKey& key, const Snapshot& snapshot) override {
    if (MachineState* one = linked(key.machine)) {
      // First, so that it is known when to look next.
      carry_out(*one, one->watch.on_looked(key.channel, snapshot, hands.now().steady));
      listener.on_read(key, snapshot);
    }
  }
  void on_read_failed(const fabric::ChannelKey& key, const std::string& reason) override {
    if (linked(key.machine) != nullptr) {
      listener.on_read_failed(key, reason);
    }
  }
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                const std::string& reason) override {
    if (linked(key.machine) != nullptr) {
      listener.on_write(key, outcome, reason);
    }
  }
  void on_watched(const std::string& machine, const std::vector<WatchOutcome>& outcomes) override {
    if (MachineState* one = linked(machine)) {
      carry_out(*one, one->watch.on_watched(outcomes, hands.now().steady));
    }
  }
  void on_told(const fabric::ChannelKey& key, Variable variable,
               std::optional<std::uint32_t> value) override {
    if (MachineState* one = linked(key.machine)) {
      carry_out(*one, one->watch.on_told(key.channel, variable, value, hands.now().steady));
    }
  }
  MachineState* linked(const std::string& machine) {
    MachineState& one = machines.at(machine);
    return one.link ? &one : nullptr;
  }

  void set(const std::vector<settings::MachineSettings>& wanted);
  MachineState& add(const settings::MachineSettings& settings);
  void change(MachineState& one, const settings::MachineSettings& settings);
  /// What another gateway says of a machine; false if it does not count for ours.
  bool take(const fabric::MachineStatus& status);
  void complain(const std::string& kind, const std::string& about, const std::string& text);
  void listen(MachineState& one);
  void listened(MachineState& one);
  void review(const std::string& machine);
  bool refused_by_all(MachineState& one);
  void serve(MachineState& one);
  void connect(MachineState& one);
  void drop_link(MachineState& one, const std::string& reason);
  void refuse(const MachineState& one, std::uint16_t channel, const std::string& reason);
  void inherit(const fabric::ChannelKey& key);
  void publish(MachineState& one);
  /// machines_watch.cpp: how the machine is watched.
  void carry_out(MachineState& one, const WatchActions& actions);
  void arm_watch(MachineState& one);
  static void forget_watch(MachineState& one);
  static std::string note_of(const MachineState& one);
  void review_soon(const std::string& machine);
  void say(Level level, const std::string& text) { hands.say(level, text); }

  GatewayIdentity own;
  MachinesIo& hands;
  MachinesListener& listener;
  Claims claims;
  std::map<std::string, MachineState> machines;
  /// What channels of contested machines showed last, while others served them.
  std::map<fabric::ChannelKey, fabric::ChannelStatus> last_seen;
  /// What a stranger may say ten thousand times a second is said once.
  fabric::Complaints complaints;
  /// The gateway that left each machine last.
  std::map<std::string, std::string> predecessors;
};

}  // namespace millrace::gateway::machines
