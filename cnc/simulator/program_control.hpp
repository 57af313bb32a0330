// The operator's control of a channel: its mode, the selected NC program, start and reset.
//
//   control.set_mode(Mode::automatic);
//   control.set_parameter("demo.nc");
//   control.command(ProcessState::ready);    // selects the program
//   control.command(ProcessState::active);   // starts it
//
// Modes, states and the meaning of the steps are documented (IB/tf5200_hli_interface/174845451,
// 174850187, 174858763); the vendor commands them through the PLC, here ADS does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/channel.hpp"

namespace millrace::cnc::simulator {

// The source of NC programs for the virtual CNC.

struct Program {
  /// Name of the file in diagnostics.
  std::string file;
  /// The contents of the file, in CP1252.
  std::string text;
};

class ProgramSource {
 public:
  virtual ~ProgramSource() = default;

  /// The NC program with this name, as an NC program or an operator writes it, or the reason why it
  /// cannot be loaded.
  virtual tl::expected<Program, std::string> load(std::string_view name) = 0;
};

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

/// Why a command was refused: every mistake of the program, or one reason.
using Refusal = std::vector<nc::Diagnostic>;

class ProgramControl {
 public:
  /// Both must outlive this object. `ready_after_end`: an NC program that has ended may be started
  /// again.
  ProgramControl(nc::Channel& channel, ProgramSource& programs, bool ready_after_end = false);

  [[nodiscard]] Mode mode() const { return mode_; }
  /// After the end of an NC program `selected`, or `ready` with ready_after_end (not documented).
  [[nodiscard]] ProcessState state() const;
  [[nodiscard]] const std::string& parameter() const { return parameter_; }
  /// The name of the current or last NC program; empty if none ran.
  [[nodiscard]] const std::string& program() const { return program_; }

  /// Standby resets the channel. Any other mode is refused while an NC program is active or the
  /// channel is in error.
  tl::expected<void, Refusal> set_mode(Mode mode);
  /// In automatic the name of an NC program, in mdi its blocks.
  void set_parameter(std::string parameter);
  /// ready: selects the program that the parameter names (in reference mode rpf.nc). active: starts
  /// it, or continues after M00. selected: resets the channel. Other states cannot be commanded.
  tl::expected<void, Refusal> command(ProcessState state);
  /// Selects and starts an NC program at once, in mode automatic.
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
  /// The NC program that runs or has ended; nullopt after a reset.
  std::optional<Program> started_;
  std::string program_;
};

}  // namespace millrace::cnc::simulator
