// One channel of a controller: the virtual CNC's real channel, with its Service Interface, the
// kernel's rules and the interpreter, and a history of what its program asks.
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
  /// What the kernel does by itself is due.
  void advance();

  // What the program does.
  void set(gateway::Variable variable, const gateway::Value& value);
  [[nodiscard]] std::uint32_t state(gateway::Variable variable) const;
  [[nodiscard]] std::string text(gateway::Variable variable) const;

  /// The program of a name that a program may call beside the cycles that come with the CNC.
  void add_program(const std::string& name, const std::string& text) { programs_.put(name, text); }
  /// Every mistake in one text if the interpreter does not take it.
  tl::expected<void, std::string> start(const std::string& text);
  /// One operation of the decoder; what it told.
  std::vector<cnc::nc::Event> tick();
  [[nodiscard]] bool active() const;

  /// NC reset.
  void reset();
  /// The controller starts: all is zero again.
  void power_up();

  /// What stands in the channel as a request; state 0 = nothing. A gateway's own writes change
  /// nothing of it.
  [[nodiscard]] const gateway::PendingRequest& standing() const { return standing_; }
  /// The program has taken its request back, or asked again, before RESPONSE_STATE had released it,
  /// or after another gateway had written too: what this one asked for earlier meets another
  /// request.
  [[nodiscard]] bool moved_on_since(Time time, GatewayNumber gateway) const {
    return moved_on_ > time || (asked_ > time && gave_up_before_) ||
           (asked_ > time &&
            std::ranges::any_of(wrote_before_, [&](GatewayNumber one) { return one != gateway; }));
  }
  /// A write of an answer is acknowledged and lost, until one that releases the program is not.
  void set_lost_by(std::optional<GatewayNumber> gateway) { lost_by_ = gateway; }
  /// The gateway ends, or leaves the channel: what it has written and not seen, nobody repeats.
  void left_by(GatewayNumber gateway) { orphaned_ = orphaned_ || lost_by_ == gateway; }
  /// Nobody knows of the answer that the program waits for.
  [[nodiscard]] bool orphaned() const { return orphaned_; }
  /// Who has written anything since the program asked.
  std::set<GatewayNumber> writers{};
  /// Something was written for another request than the one that stands: it was on its way when the
  /// program asked anew, and nobody can help that.
  bool crossed = false;
  /// The variables and what stands in them, in words.
  [[nodiscard]] std::string place() const;

  /// Called after something may have changed, by whoever watches the channel.
  std::map<const void*, std::function<void()>> watchers;
  /// Called after each write over ADS.
  std::function<void()> on_ads_write = [] {};

 private:
  void changed();
  [[nodiscard]] cnc::simulator::Variable& at(gateway::Variable variable) const;
  /// The program has written a request, or a text beside one.
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
  /// RESPONSE_STATE has told the program to go on.
  bool released_ = false;
  Time moved_on_{-1};
  std::optional<GatewayNumber> lost_by_{};
  bool orphaned_ = false;
  /// It has done so since it asked, or with the request before.
  bool gave_up_ = false;
  bool gave_up_before_ = false;
  /// When it asked last, and who had written anything for the request before.
  Time asked_{-1};
  std::set<GatewayNumber> wrote_before_{};
};

}  // namespace millrace::tests::simulation
