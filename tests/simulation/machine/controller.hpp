// A controller: its channels with their programs, behind one ADS router. It can be switched off.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/simulation/machine/message_ring.hpp"
#include "tests/simulation/machine/program.hpp"
#include "tests/simulation/values/value_store.hpp"

namespace millrace::tests::simulation {

class Controller {
 public:
  Controller(std::string name, Party party, Agenda& agenda, History& history)
      : name_(std::move(name)),
        party_(party),
        agenda_(agenda),
        history_(history),
        values_(agenda) {}

  void add(cnc::simulator::ServiceRules rules, ProgramBehaviour behaviour, Random random);
  void add_queue(RingPlan plan, Random random);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint64_t parties() const { return std::uint64_t{1} << party_; }
  [[nodiscard]] bool powered() const { return powered_; }
  /// Counts how often it was switched on.
  [[nodiscard]] std::uint64_t life() const { return life_; }
  [[nodiscard]] std::vector<std::uint16_t> numbers() const;
  [[nodiscard]] MachineChannel& channel(std::uint16_t number) {
    return *lines_.at(number - 1U).channel;
  }
  [[nodiscard]] Program& program(std::uint16_t number) { return *lines_.at(number - 1U).program; }
  [[nodiscard]] std::size_t size() const { return lines_.size(); }
  [[nodiscard]] bool kernel_clears() const {
    return lines_.front().channel->rules().kernel_clears_after.has_value();
  }
  [[nodiscard]] const std::vector<std::unique_ptr<MessageRing>>& queues() const { return rings_; }
  [[nodiscard]] MessageRing& queue(const std::string& name) const;
  [[nodiscard]] ValueStore& values() { return values_; }

  void start_programs();
  /// NC reset of one channel; its program starts again after `pause`.
  void reset(std::uint16_t number, Time pause);
  void switch_off();
  void switch_on();

  /// The requests from connections that are gone which it has not executed, by gateway.
  std::map<GatewayNumber, unsigned> leftovers;
  /// When the last write to a variable of a channel takes effect. Writes to one variable keep their
  /// order, also where their delay changes.
  std::map<std::pair<std::uint16_t, gateway::Variable>, Time> effective;

  [[nodiscard]] bool done() const;
  void calm_down();
  /// Everything that determines its future, except what is on its way to it; for a walk through all
  /// orders.
  [[nodiscard]] std::string place() const;

 private:
  struct Line {
    std::unique_ptr<MachineChannel> channel;
    std::unique_ptr<Program> program;
  };

  std::string name_;
  Party party_;
  Agenda& agenda_;
  History& history_;
  ValueStore values_;
  std::vector<Line> lines_;
  std::vector<std::unique_ptr<MessageRing>> rings_;
  bool powered_ = true;
  std::uint64_t life_ = 1;
};

}  // namespace millrace::tests::simulation
