// Makes one of the mistakes of bug.hpp between a gateway's decisions and the simulated world.
#pragma once

#include <map>
#include <optional>

#include "gateway/journal_entry.hpp"
#include "gateway/machines/controller.hpp"
#include "gateway/outputs.hpp"
#include "tests/simulation/gateway/bug.hpp"
#include "tests/simulation/gateway/gateway_checker.hpp"

namespace millrace::tests::simulation {

class Mistakes {
 public:
  explicit Mistakes(Bug bug) : bug_(bug) {}

  [[nodiscard]] bool makes(Bug bug) const { return bug_ == bug; }
  void forget();

  [[nodiscard]] fabric::InstanceIdentity seen(const fabric::InstanceIdentity& instance) const;
  [[nodiscard]] fabric::Reply taken_for(const fabric::Reply& reply,
                                        const GatewayChecker& checker) const;
  /// The gateway ignores this reply.
  [[nodiscard]] bool forgets(const fabric::Reply& reply) const;
  /// An invented read in place of a real one.
  std::optional<gateway::ServiceSnapshot> instead_of(const Key& key, gateway::ReadSet set,
                                                     const GatewayChecker& checker);
  void on_read(const Key& key, const gateway::ServiceSnapshot& snapshot);
  /// What the gateway believes to have read.
  [[nodiscard]] gateway::ServiceSnapshot taken_for(const Key& key,
                                                   gateway::ServiceSnapshot snapshot);
  [[nodiscard]] gateway::machines::Answer taken_for(const std::string& machine,
                                                    gateway::machines::Answer answer);
  void on_write(const Key& key, gateway::WriteOutcome outcome);
  /// The write is not done and reported as done.
  bool keeps(const Key& key, const gateway::Write& write, const GatewayChecker& checker);
  /// A write to repeat.
  std::optional<gateway::Write> again(const Key& key, gateway::WriteOutcome outcome,
                                      const std::string& reason) const;
  /// This entry is not journalled.
  [[nodiscard]] bool skips(const gateway::JournalEntry& entry) const;

 private:
  Bug bug_;
  std::map<Key, gateway::ServiceSnapshot> last_looks_;
  std::map<Key, gateway::ServiceSnapshot> last_states_;
  std::map<Key, gateway::ServiceSnapshot> texts_read_;
  std::map<Key, gateway::Write> last_writes_;
  std::map<std::string, std::vector<gateway::data::Sampler::Answer>> last_values_;
  std::map<Key, std::map<gateway::Variable, gateway::Value>> acknowledged_;
};

}  // namespace millrace::tests::simulation
