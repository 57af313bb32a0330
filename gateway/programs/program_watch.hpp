// The starts, ends and aborts of the NC programs of one channel, from reads of its state. Pure.
//
//   ProgramWatch watch({"press", 1}, {.name = "mc_program_name_r", .counter = "V.E.PARTS"});
//   sampled group: watch.group()                     // what has to be read, and how often
//   for (const auto& event : watch.on_sample(sample)) publish(event);
//
// A channel's states and their meaning are documented (IB/tf5200_hli_interface/174845451,
// 174850187, 174858763); their addresses are those of an open-source client
// (cnc/variables/objects.hpp). The state after an NC program's end is not documented: from active
// to ready or selected in the same mode counts as an end, so an NC reset that keeps the mode looks
// like one. No program ends by itself in hold, so leaving hold is a reset, and so is a change from
// error to any state but a running program. Programs that begin and end between two reads are not
// seen. A program that runs or has an error at the first read is reported as found.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fabric/data.hpp"
#include "gateway/data/group.hpp"

namespace millrace::gateway::programs {

/// The channels whose NC programs are watched (idl/gateway.proto, Programs).
struct ProgramSettings {
  std::uint16_t channel = 1;
  std::chrono::milliseconds period{100};
  /// Variables or objects; empty = not read.
  std::string name{};
  std::string error{};
  std::string counter{};
  bool operator==(const ProgramSettings&) const = default;
};

/// The name of the group that is sampled for it; no group of a configuration has a slash.
inline constexpr const char* programs_group = "/programs";

/// The data group that is sampled for a channel's NC programs.
data::GroupSettings group_of(const ProgramSettings& settings);

class ProgramWatch {
 public:
  ProgramWatch(fabric::ChannelKey key, ProgramSettings settings)
      : key_(std::move(key)), settings_(std::move(settings)) {}

  /// A sample of its group.
  std::vector<fabric::ProgramEvent> on_sample(const fabric::DataSample& sample);

 private:
  /// As documented.
  enum class State : std::uint32_t {
    none = 0,
    deselected = 1,
    selected = 2,
    ready = 3,
    active = 4,
    hold = 5,
    error = 6
  };
  /// The values of one read.
  struct Look {
    State state = State::none;
    std::uint32_t mode = 0;
    std::string name;
    std::uint32_t error = 0;
    std::optional<std::int64_t> parts;
    fabric::Time at{};
  };

  static bool runs(State state) { return state == State::active || state == State::hold; }
  [[nodiscard]] std::optional<Look> look_of(const fabric::DataSample& sample) const;
  /// The first read.
  void begin(const Look& now, std::vector<fabric::ProgramEvent>& events);
  void step(const Look& before, const Look& now, std::vector<fabric::ProgramEvent>& events);
  void forget_run();
  [[nodiscard]] fabric::ProgramEventKind end_of(const Look& before, const Look& now) const;
  fabric::ProgramEvent event(fabric::ProgramEventKind kind, const Look& now) const;

  fabric::ChannelKey key_;
  ProgramSettings settings_;
  /// Nullopt until the first read.
  std::optional<Look> last_;
  /// The controller has not responded since.
  bool blind_ = false;
  /// Of the run that is under way, or was aborted and not yet cleared.
  fabric::Time started_{};
  std::string program_;
};

}  // namespace millrace::gateway::programs
