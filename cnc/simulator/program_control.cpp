#include "cnc/simulator/program_control.hpp"

#include <utility>

namespace millrace::cnc::simulator {

ProgramControl::ProgramControl(nc::Channel& channel, ProgramSource& programs, bool ready_after_end)
    : channel_(channel), programs_(programs), ready_after_end_(ready_after_end) {}

ProcessState ProgramControl::state() const {
  switch (channel_.state()) {
    case nc::ChannelState::active:
      return ProcessState::active;
    case nc::ChannelState::held:
      return ProcessState::hold;
    case nc::ChannelState::error:
      return ProcessState::error;
    case nc::ChannelState::idle:
      break;
  }
  const bool again = ready_after_end_ && started_;
  return ready_ || again ? ProcessState::ready : ProcessState::selected;
}

tl::expected<void, Refusal> ProgramControl::set_mode(Mode mode) {
  if (mode == Mode::standby) {
    reset();
  } else if (channel_.state() != nc::ChannelState::idle) {
    return tl::unexpected(refusal("the mode cannot change while a program is active or in error"));
  }
  mode_ = mode;
  ready_.reset();
  started_.reset();
  return {};
}

void ProgramControl::set_parameter(std::string parameter) {
  parameter_ = std::move(parameter);
}

tl::expected<void, Refusal> ProgramControl::command(ProcessState state) {
  switch (state) {
    case ProcessState::selected:
      reset();
      return {};
    case ProcessState::ready:
      return choose();
    case ProcessState::active:
      return activate();
    default:
      return tl::unexpected(refusal("only selected, ready and active can be commanded"));
  }
}

tl::expected<void, Refusal> ProgramControl::start(const Program& program) {
  mode_ = Mode::automatic;
  ready_.reset();
  return run(program);
}

tl::expected<void, Refusal> ProgramControl::run(const Program& program) {
  return channel_.start(program.file, program.text).map([&] {
    started_ = program;
    program_ = program.file;
  });
}

void ProgramControl::reset() {
  channel_.reset();
  ready_.reset();
  started_.reset();
}

tl::expected<void, Refusal> ProgramControl::choose() {
  if (channel_.state() != nc::ChannelState::idle) {
    return tl::unexpected(refusal("a program is active or in error"));
  }
  auto program = chosen_program();
  if (!program) {
    return tl::unexpected(program.error());
  }
  if (Refusal mistakes = nc::check(program->file, program->text); !mistakes.empty()) {
    return tl::unexpected(std::move(mistakes));
  }
  ready_ = std::move(*program);
  return {};
}

tl::expected<Program, Refusal> ProgramControl::chosen_program() {
  const auto to_refusal = [this](const std::string& reason) { return refusal(reason); };
  switch (mode_) {
    case Mode::automatic:
      if (!parameter_.empty() && parameter_ == channel_.options().stream_program) {
        return Program{parameter_, ""};
      }
      return programs_.load(parameter_).map_error(to_refusal);
    case Mode::mdi:
      return Program{"MDI", parameter_};
    case Mode::reference:
      return programs_.load("rpf.nc").map_error(to_refusal);
    default:
      return tl::unexpected(refusal("no program can be chosen in this mode"));
  }
}

tl::expected<void, Refusal> ProgramControl::activate() {
  if (channel_.state() == nc::ChannelState::held) {
    channel_.resume();
    return {};
  }
  auto program = std::exchange(ready_, std::nullopt);
  if (!program && ready_after_end_ && channel_.state() == nc::ChannelState::idle) {
    program = started_;
  }
  if (!program) {
    return tl::unexpected(refusal("no program is ready"));
  }
  return run(*program);
}

Refusal ProgramControl::refusal(const std::string& reason) const {
  return {nc::Diagnostic{{parameter_, 0, 0, 0}, 0, reason}};
}

}  // namespace millrace::cnc::simulator
