// The operator's side of a channel: which mode it is in, which program is chosen, start and reset.
//
//   control.set_mode(Mode::automatic);
//   control.set_parameter("demo.nc");
//   control.command(ProcessState::ready);    // chooses the program
//   control.command(ProcessState::active);   // starts it
//
// Modes, states and the meaning of the steps are documented (IB/tf5200_hli_interface/174845451,
// 174850187, 174858763); the vendor commands them through the PLC, here ADS does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/channel.hpp"
#include "cnc/simulator/program_source.hpp"

namespace millrace::cnc::simulator {

enum class Mode : std::uint32_t { standby = 1, automatic = 2, mdi = 3, manual = 4, reference = 5 };

enum class ProcessState : std::uint32_t {
  none = 0,
  deselected = 1,
  selected = 2,
  ready = 3,
  active = 4,
  hold = 5,
  error = 6,
};

/// What a program did not let be done: every mistake, or one reason.
using Refusal = std::vector<nc::Diagnostic>;

class ProgramControl {
 public:
  /// Both outlive this object. `ready_after_end`: a program that has ended may be started again.
  ProgramControl(nc::Channel& channel, ProgramSource& programs, bool ready_after_end = false);

  [[nodiscard]] Mode mode() const { return mode_; }
  /// After a program's end `selected`, or `ready` (not documented).
  [[nodiscard]] ProcessState state() const;
  [[nodiscard]] const std::string& parameter() const { return parameter_; }
  /// The name of the program that runs, or ran last; empty if none did.
  [[nodiscard]] const std::string& program() const { return program_; }

  /// Standby resets; any other mode is refused while a program is active or the channel in error.
  tl::expected<void, Refusal> set_mode(Mode mode);
  /// In automatic a program's name, in mdi its blocks.
  void set_parameter(std::string parameter);
  /// ready: chooses the program the parameter names (in reference mode rpf.nc). active: starts it,
  /// or goes on after M00. selected: resets. Other states cannot be commanded.
  tl::expected<void, Refusal> command(ProcessState state);
  /// Chooses and starts a program at once, in mode automatic.
  tl::expected<void, Refusal> start(const Program& program);
  /// NC reset.
  void reset();

 private:
  tl::expected<void, Refusal> choose();
  tl::expected<Program, Refusal> chosen_program();
  tl::expected<void, Refusal> activate();
  tl::expected<void, Refusal> run(const Program& program);
  [[nodiscard]] Refusal refusal(const std::string& reason) const;

  nc::Channel& channel_;
  ProgramSource& programs_;
  Mode mode_ = Mode::standby;
  std::string parameter_;
  std::optional<Program> ready_;
  bool ready_after_end_;
  /// That runs or has ended; none after a reset.
  std::optional<Program> started_;
  std::string program_;
};

}  // namespace millrace::cnc::simulator
