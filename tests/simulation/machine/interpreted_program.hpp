// A program in the NC language, written from the seed and run by the interpreter of the virtual
// CNC, with the SysServiceWait.cyc that comes with it.
#pragma once

#include "tests/simulation/machine/program.hpp"

namespace millrace::tests::simulation {

class InterpretedProgram final : public Program {
 public:
  InterpretedProgram(MachineChannel& channel, ProgramBehaviour behaviour, Agenda& agenda,
                     Party party, History& history, Random random);

  void start() override;
  void stop() override;
  void calm_down() override;
  [[nodiscard]] bool done() const override { return left_ == 0 && !active_; }
  [[nodiscard]] bool active() const override { return active_; }
  [[nodiscard]] std::size_t answered() const override { return answered_; }

 private:
  /// Its remaining calls as NC text.
  std::string write();
  std::string write_call(std::size_t number);
  void cycle();
  void on(const cnc::nc::Event& event);
  void on_message(const std::string& text);

  MachineChannel& channel_;
  ProgramBehaviour behaviour_;
  Agenda& agenda_;
  Party party_;
  History& history_;
  Random random_;
  std::size_t left_;
  std::size_t written_ = 0;
  bool active_ = false;
  bool calm_ = false;
  std::uint64_t life_ = 0;
  std::string uuid_;
  std::string text_;
  std::size_t state_ = 1;
  std::size_t answered_ = 0;
};

}  // namespace millrace::tests::simulation
