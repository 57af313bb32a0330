// Faults, drawn from the seed. Each simulation has some kinds of faults only, so that frequent
// kinds do not hide rare ones.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/simulation/plant.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

class FaultInjector {
 public:
  FaultInjector(Plant& plant, Random random);

  /// Faults happen from now on, for this duration.
  void begin(Time duration);
  /// Repairs everything that does not recover by itself.
  void end();
  [[nodiscard]] bool over() const { return over_; }
  /// The names of all kinds of faults.
  static std::vector<std::string> names();
  /// How often each kind hit a channel in each state, as its gateways report it: "cut-link",
  /// "running".
  using Coverage = std::map<std::pair<std::string_view, std::string_view>, std::uint64_t>;
  /// The states of a channel. Answering is divided by the write that is under way or done: the
  /// first variable, REQUEST_STATE = 0, the completion signal. In addition: an at-most-once call,
  /// and a call of a message queue.
  static constexpr std::array steps{
      std::string_view("link down"), std::string_view("idle"),    std::string_view("unserved"),
      std::string_view("waiting"),   std::string_view("running"), std::string_view("interim"),
      std::string_view("answering"), std::string_view("begun"),   std::string_view("cleared"),
      std::string_view("released"),  std::string_view("held"),    std::string_view("once"),
      std::string_view("queue")};
  [[nodiscard]] const Coverage& coverage() const { return coverage_; }

 private:
  struct Fault {
    std::string_view name;
    void (FaultInjector::*begin)();
  };
  static const std::vector<Fault>& all();
  void inject();
  /// Counts the fault that has just happened for these channels.
  using ChannelFilter = std::function<bool(const GatewayProcess&, const fabric::ChannelStatus&)>;
  void count_hits(const ChannelFilter& filter);
  void count_all_hits();
  GatewayProcess& some_gateway();
  Controller& some_controller();
  ServiceProcess& some_service();
  void soon(Time delay, std::function<void()> act);
  static constexpr Time longest_fault = std::chrono::milliseconds(3000);
  /// Calls `undo` after a while, at the latest at the end of all faults.
  void for_a_while(std::function<void()> undo);

  void cut_link();
  void silence_link();
  void slow_link();
  void refuse_requests();
  void lose_requests();
  void reset_channel();
  void switch_controller_off();
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
  void cut_path();
  void cut_off();
  void lose_samples();
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
  std::string_view fault_;
  Coverage coverage_;
};

}  // namespace millrace::tests::simulation
