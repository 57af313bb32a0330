// The whole virtual CNC: its channels, advanced by ticks. It owns no socket, file, thread or clock.
//
//   Machine machine(settings, {.clock = clock, .programs = folders});
//   machine.channel(1)->start(program);
//   while (machine.active())
//     for (const NcEvent& happening : machine.tick(clock())) …
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "cnc/simulator/settings.hpp"
#include "cnc/simulator/virtual_channel.hpp"

namespace millrace::cnc::simulator {

/// An event of an NC program.
struct NcEvent {
  /// The channel's number.
  std::uint32_t channel = 0;
  nc::Event event;
};

class Machine {
 public:
  Machine(Settings settings, const Surroundings& surroundings);

  [[nodiscard]] const Settings& settings() const { return settings_; }
  /// The channel with this number, from 1; null if there is none.
  [[nodiscard]] VirtualChannel* channel(std::uint32_t number);
  [[nodiscard]] SystemData& system_data() const { return *common_.system_data; }
  /// The number of axes of all channels.
  [[nodiscard]] std::uint32_t axes() const;
  /// An axis by its logical number in the CNC, from 1: the axes of channel 1 come first (our
  /// choice).
  struct Axis {
    VirtualChannel* channel = nullptr;
    /// Number of the axis in the channel, from 1.
    std::uint32_t number = 0;
  };
  [[nodiscard]] std::optional<Axis> axis(std::uint32_t number);
  /// The logical number of a channel's first axis.
  [[nodiscard]] std::uint32_t first_axis(std::uint32_t channel) const;
  /// The cycles of the interpolator since its start. They begin at the clock's multiples of the
  /// cycle, like the calls of Cycle and the samples of notifications.
  [[nodiscard]] std::int64_t cycles() const {
    return clock_() / settings_.cycle - born_ / settings_.cycle;
  }

  /// Applies the due writes of ADS clients; call it before any read.
  void apply_writes();

  /// Advances every active channel to `now`, in the order of their numbers.
  std::vector<NcEvent> tick(std::chrono::nanoseconds now);
  /// True while any channel runs an NC program.
  [[nodiscard]] bool active() const;

 private:
  Settings settings_;
  Clock clock_;
  std::chrono::nanoseconds born_;
  Common common_;
  std::vector<std::unique_ptr<VirtualChannel>> channels_;
};

}  // namespace millrace::cnc::simulator
