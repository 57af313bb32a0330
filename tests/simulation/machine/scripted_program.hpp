// A script with the writes of a program that uses SysServiceWait, one by one, at any pace.
#pragma once

#include "tests/simulation/machine/program.hpp"

namespace millrace::tests::simulation {

class ScriptedProgram final : public Program {
 public:
  ScriptedProgram(MachineChannel& channel, ProgramBehaviour behaviour, Agenda& agenda, Party party,
                  History& history, Random random);

  void start() override;
  void stop() override;
  void calm_down() override;
  [[nodiscard]] bool done() const override { return left_ == 0 && !active_; }
  [[nodiscard]] bool active() const override { return active_; }
  [[nodiscard]] std::size_t answered() const override { return answered_; }
  [[nodiscard]] bool may_be_stuck() const override;
  [[nodiscard]] std::string place() const override;

 private:
  void after(Time delay, const char* name, void (ScriptedProgram::*step)());
  void begin();
  void write_request();
  void write_state();
  void change(std::uint64_t call);
  void look();
  void look_at_text();
  void read_response();
  void lose_patience(std::uint64_t call);
  void next();

  MachineChannel& channel_;
  ProgramBehaviour behaviour_;
  Agenda& agenda_;
  Party party_;
  History& history_;
  Random random_;
  std::size_t left_;
  bool active_ = false;
  bool calm_ = false;
  bool looking_ = false;
  bool waiting_ = false;
  bool hasty_ = false;
  /// Its last answer is one that no service gave.
  bool settled_ = false;
  std::uint64_t life_ = 0;
  std::uint64_t call_ = 0;
  std::uint32_t wait_at_ = 0;
  gateway::PendingRequest request_;
  std::size_t answered_ = 0;
};

}  // namespace millrace::tests::simulation
