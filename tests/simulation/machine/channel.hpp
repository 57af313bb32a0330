// One channel of a controller: the virtual CNC's real channel with its Service Interface, the
// kernel's rules and the interpreter, and a history of its program's requests.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cnc/simulator/virtual_channel.hpp"
#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

class MachineChannel {
 public:
  MachineChannel(Key key, cnc::simulator::ServiceRules rules, Agenda& agenda, History& history);

  [[nodiscard]] const Key& key() const { return key_; }

  // Over ADS.
  [[nodiscard]] gateway::Value read(gateway::Variable variable) const;
  /// False if the controller refuses it.
  bool write(gateway::Variable variable, const gateway::Value& value);

  [[nodiscard]] const cnc::simulator::ServiceRules& rules() const { return rules_; }
  /// The kernel's own writes that are due.
  void advance();

  // The program's writes.
  void set(gateway::Variable variable, const gateway::Value& value);
  [[nodiscard]] std::uint32_t state(gateway::Variable variable) const;
  [[nodiscard]] std::string text(gateway::Variable variable) const;

  /// A program that others may call by its name, in addition to the cycles that come with the CNC.
  void add_program(const std::string& name, const std::string& text) { programs_.put(name, text); }
  /// Returns all errors in one text if the interpreter refuses the program.
  tl::expected<void, std::string> start(const std::string& text);
  /// One operation of the decoder; returns its events.
  std::vector<cnc::nc::Event> tick();
  [[nodiscard]] bool active() const;

  /// NC reset.
  void reset();
  /// The controller starts with all values 0.
  void power_up();

  /// The request in the channel; state 0 = none. A gateway's own writes do not change it.
  [[nodiscard]] const gateway::PendingRequest& standing() const { return standing_; }
  /// The program has withdrawn its request, or sent another, before RESPONSE_STATE had released it
  /// or after another gateway had written: what this gateway asked for earlier meets another
  /// request.
  [[nodiscard]] bool moved_on_since(Time time, GatewayNumber gateway) const {
    return moved_on_ > time || (asked_ > time && gave_up_before_) ||
           (asked_ > time && std::ranges::any_of(wrote_before_, [&](GatewayNumber gateway_number) {
              return gateway_number != gateway;
            }));
  }
  /// A write of an answer is acknowledged and lost, which holds until a later release succeeds.
  void set_lost_by(std::optional<GatewayNumber> gateway) { lost_by_ = gateway; }
  /// The gateway ends or leaves the channel: a write that was lost unseen is not repeated.
  void left_by(GatewayNumber gateway) { orphaned_ = orphaned_ || lost_by_ == gateway; }
  /// No gateway knows of the answer that the program waits for.
  [[nodiscard]] bool orphaned() const { return orphaned_; }
  /// The gateways that have written since the program's request.
  std::set<GatewayNumber> writers{};
  /// A write was under way when the program sent a new request, and has hit that one; no gateway
  /// can prevent this.
  bool crossed = false;
  /// The variables and their values as text.
  [[nodiscard]] std::string place() const;

  /// Called after a possible change, by observer of the channel.
  std::map<const void*, std::function<void()>> watchers;
  /// Called after each write over ADS.
  std::function<void()> on_ads_write = [] {};

 private:
  void changed();
  [[nodiscard]] cnc::simulator::Variable& at(gateway::Variable variable) const;
  /// The program has written a request, or one of its texts.
  void report(bool request_state);
  void move_on();
  void cleared(const std::string& why);

  class Programs final : public cnc::simulator::ProgramSource {
   public:
    void put(const std::string& name, const std::string& text) { texts_[name] = text; }
    tl::expected<cnc::simulator::Program, std::string> load(std::string_view name) override;

   private:
    std::map<std::string, std::string, std::less<>> texts_;
  };

  Key key_;
  cnc::simulator::ServiceRules rules_;
  Agenda& agenda_;
  History& history_;
  Programs programs_;
  struct Kernel;
  std::shared_ptr<Kernel> kernel_;
  gateway::PendingRequest standing_;
  /// RESPONSE_STATE has released the program.
  bool released_ = false;
  Time moved_on_{-1};
  std::optional<GatewayNumber> lost_by_{};
  bool orphaned_ = false;
  /// The program has given up a request since it asked, or gave up the one before.
  bool gave_up_ = false;
  bool gave_up_before_ = false;
  /// When it asked last, and the gateways that had written for the request before.
  Time asked_{-1};
  std::set<GatewayNumber> wrote_before_{};
};

}  // namespace millrace::tests::simulation
