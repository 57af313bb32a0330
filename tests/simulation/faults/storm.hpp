// What goes wrong, drawn from the seed: each simulation has some kinds of faults and not others, so
// that rare ones are not drowned by frequent ones.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/simulation/plant.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

class Storm {
 public:
  Storm(Plant& plant, Random random);

  /// Faults from now on, for so long.
  void begin(Time duration);
  /// All is mended, as far as it is not by itself.
  void end();
  [[nodiscard]] bool over() const { return over_; }
  /// Of all kinds of faults.
  static std::vector<std::string> names();
  /// How often each kind came about while a channel was in each state, as its gateways say:
  /// "cut-link", "running".
  using Reach = std::map<std::pair<std::string, fabric::ChannelState>, std::uint64_t>;
  [[nodiscard]] const Reach& reach() const { return reach_; }

 private:
  struct Fault {
    std::string_view name;
    void (Storm::*begin)();
  };
  static const std::vector<Fault>& all();
  void strike();
  void soon(Time delay, std::function<void()> act);
  /// Undone at the end at the latest.
  void for_a_while(std::function<void()> undo);

  // faults/storm_machines.cpp
  void cut_link();
  void silence_link();
  void slow_link();
  void refuse_requests();
  void lose_requests();
  void reset_channel();
  void switch_controller_off();
  // faults/storm_processes.cpp
  void kill_gateway();
  void cut_gateway_power();
  void stop_gateway();
  void freeze_gateway();
  void kill_service();
  void drain_service();
  void freeze_service();
  void fill_disk();
  void step_clock();
  void reload_gateway();
  void part_gateways();
  // faults/storm_fabric.cpp
  void cut_path();
  void cut_off();
  void lose_samples();
  // faults/storm_strangers.cpp
  void stranger_speaks();
  void speak_for_another();
  void speak_again();
  [[nodiscard]] std::optional<fabric::ChannelStatus> some_call();

  Plant& plant_;
  Random random_;
  std::vector<Fault> kinds_;
  Time pause_ = 200ms;
  Time end_{};
  bool over_ = false;
  Reach reach_;
};

}  // namespace millrace::tests::simulation
