// An NC program that calls services one after the other, as one written with SysServiceWait does.
// It may lose patience, be reset at any point, and not know what an interim state is.
#pragma once

#include <string>
#include <vector>

#include "tests/simulation/machine/channel.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

struct ProgramHabits {
  /// What it calls, in any order.
  std::vector<std::string> uuids;
  std::size_t calls = 5;
  /// In a hundred calls.
  unsigned impatient = 10;
  unsigned repeats_itself = 0;
  /// Between two writes, and until RESPONSE_STATE is looked at again.
  Time cycle = 2ms;
  Time pause = 50ms;
};

class Program {
 public:
  Program(MachineChannel& channel, ProgramHabits habits, Agenda& agenda, Party party,
          History& history, Random random);

  /// Runs what is left of its calls.
  void start();
  /// It ends where it is.
  void stop();
  /// From now on it waits as long as it takes and begins at most one more call.
  void calm_down();
  [[nodiscard]] bool done() const { return left_ == 0 && !active_; }
  [[nodiscard]] bool active() const { return active_; }
  [[nodiscard]] std::size_t answered() const { return answered_; }

 private:
  void after(Time delay, void (Program::*step)());
  void begin();
  void write_request();
  void write_state();
  void look();
  void read_response();
  void lose_patience(std::uint64_t call);
  void next();

  MachineChannel& channel_;
  ProgramHabits habits_;
  Agenda& agenda_;
  Party party_;
  History& history_;
  Random random_;
  std::size_t left_;
  bool active_ = false;
  bool calm_ = false;
  bool looking_ = false;
  bool waiting_ = false;
  std::uint64_t life_ = 0;
  std::uint64_t call_ = 0;
  std::uint32_t wait_at_ = 0;
  gateway::PendingRequest request_;
  std::size_t answered_ = 0;
};

}  // namespace millrace::tests::simulation
