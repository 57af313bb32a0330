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
  [[nodiscard]] fabric::Reply heard(const fabric::Reply& reply,
                                    const GatewayChecker& checker) const;
  /// Nobody cares for this reply.
  [[nodiscard]] bool forgets(const fabric::Reply& reply) const;
  /// A look that is made up instead of taken.
  std::optional<gateway::ServiceSnapshot> instead_of(const Key& key, gateway::ReadSet set,
                                                     const GatewayChecker& checker);
  void on_read(const Key& key, const gateway::ServiceSnapshot& snapshot);
  /// What the gateway takes it for.
  [[nodiscard]] gateway::ServiceSnapshot taken_for(const Key& key,
                                                   gateway::ServiceSnapshot snapshot);
  [[nodiscard]] gateway::machines::Answer taken_for(const std::string& machine,
                                                    gateway::machines::Answer answer);
  void on_write(const Key& key, gateway::WriteOutcome outcome);
  /// The write is not done, and nobody notices.
  bool keeps(const Key& key, const gateway::Write& write, const GatewayChecker& checker);
  /// What is written once more.
  std::optional<gateway::Write> again(const Key& key, gateway::WriteOutcome outcome,
                                      const std::string& reason) const;
  /// The journal is not told of it.
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
