// One channel of the virtual CNC: its variables, its Service Interface and its NC program.
//
//   channel.start({"demo.nc", text});
//   while (channel.program().active()) channel.tick(now);
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/channel.hpp"
#include "cnc/simulator/program_control.hpp"
#include "cnc/simulator/service_interface.hpp"
#include "cnc/simulator/settings.hpp"
#include "cnc/simulator/store.hpp"
#include "cnc/simulator/system_data.hpp"

namespace millrace::cnc::simulator {

/// The environment of the virtual CNC; all of it must outlive the CNC.
struct Surroundings {
  Clock clock;
  ProgramSource& programs;
  /// Called with the number of the channel.
  std::function<void(std::uint32_t, const AnsweredCall&)> on_answered = [](auto, const auto&) {};
  /// Called when an ADS client has commanded a channel, so that ticks are needed.
  std::function<void()> on_command = [] {};
};

/// State that the channels of a CNC share.
struct Common {
  /// V.E. variables of scope GLOBAL.
  std::vector<std::shared_ptr<Variable>> externals;
  std::shared_ptr<nc::Timers> timers;
  std::shared_ptr<SystemData> system_data =
      std::make_shared<SystemData>(std::vector<DataDeclaration>{});
};

/// An operator's settings of a block search.
struct BlockSearch {
  /// Execution mode 1.
  bool commanded = false;
  /// 0 none, 4 a block number.
  std::uint16_t type = 0;
  std::uint32_t block = 0;
};

class VirtualChannel : private nc::Environment {
 public:
  VirtualChannel(std::uint32_t number, const Settings& settings, const Common& common,
                 const Surroundings& surroundings);

  /// Counts from 1.
  [[nodiscard]] std::uint32_t number() const { return number_; }
  [[nodiscard]] const Store& store() const { return store_; }
  [[nodiscard]] const nc::Channel& program() const { return program_; }
  /// For the operator's adjustments: override, single step and others.
  [[nodiscard]] nc::Channel& program() { return program_; }
  /// P, V.P, V.L, V.S and V.CYC of the NC program.
  [[nodiscard]] nc::run::Memory& program_variables() { return program_.variables(); }
  [[nodiscard]] const std::vector<AxisSettings>& axes() const { return axes_; }
  /// Mode and state, and the selected NC program.
  [[nodiscard]] const ProgramControl& control() const { return control_; }
  /// The number of the error that ended the NC program; 0 once it is cleared.
  [[nodiscard]] std::uint32_t error() const { return error_; }

  /// Starts an NC program, or returns all its mistakes. Not while one is active.
  tl::expected<void, Refusal> start(const Program& program);
  /// NC reset.
  void reset();
  // Commands of ADS clients; the next tick also reports a refusal to the operator.
  tl::expected<void, Refusal> command_mode(Mode mode);
  tl::expected<void, Refusal> command_state(ProcessState state);
  void command_parameter(std::string parameter);
  /// Applies to the next start.
  void set_block_search(const BlockSearch& search);
  [[nodiscard]] const BlockSearch& block_search() const { return search_; }
  /// A packet for the streaming program.
  tl::expected<void, Refusal> command_stream(std::string packet);

  /// Applies the writes of ADS clients that are due by now.
  void apply_writes(std::chrono::nanoseconds now) { service_.advance(now); }

  /// Advances the NC program to `now`; its decoder executes at most `operations` operations.
  std::vector<nc::Event> tick(std::chrono::nanoseconds now, std::size_t operations);

 private:
  tl::expected<nc::Value, nc::Fault> read(std::string_view name) override;
  tl::expected<void, nc::Fault> write(std::string_view name, const nc::Value& value) override;
  bool synchronous(std::string_view name) override;
  std::size_t elements(std::string_view name) override;
  tl::expected<void, nc::Fault> initialise(std::string_view name) override;
  tl::expected<std::string, nc::Fault> load(std::string_view program) override;

  tl::expected<Selection, nc::Fault> element(std::string_view name) const;
  void add_variables(const Settings& settings, const Common& common);
  tl::expected<void, Refusal> report(tl::expected<void, Refusal> outcome);

  std::uint32_t number_;
  std::vector<AxisSettings> axes_;
  Surroundings surroundings_;
  std::shared_ptr<SystemData> system_data_;
  Store store_;
  ServiceInterface service_;
  nc::Channel program_;
  ProgramControl control_;
  BlockSearch search_;
  std::uint32_t error_ = 0;
  /// Refused commands that were not reported to the operator yet.
  std::vector<nc::Event> unreported_;
};

// The V.A. variables of the virtual CNC: the positions and software limits of the axes of a
// channel.

/// Names without the axis. Documented in examples of the manuals (V.A.ACT_POS.X, V.A.ABS.X,
/// V.A.WCS.X, V.A.+SWE.X). Without offsets and compensations the first three have the same value.
inline constexpr std::array<std::string_view, 5> axis_quantities{"V.A.ABS", "V.A.ACT_POS",
                                                                 "V.A.WCS", "V.A.-SWE", "V.A.+SWE"};

}  // namespace millrace::cnc::simulator
