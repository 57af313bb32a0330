// Judges a scenario by what was written down while it ran. Pure.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "gateway/journal_entry.hpp"
#include "tests/cluster/history/execution_log.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tests::cluster {

struct History {
  /// The journal of the gateway that was started last. It begins with what was open then.
  std::vector<gateway::JournalEntry> journal;
  std::vector<Execution> executions;
  /// What a recorder on the fabric wrote down, in the order in which it received it.
  std::vector<tools::recording::Entry> recording{};
  /// The calls that the journals of gateways before it know as ended.
  std::set<std::string> ended_before{};
};

/// One sentence for each violation, with the call; empty if there is none.
///
/// I1  a call is answered at most once
/// I2  an answer belongs to an attempt that was given out
/// I3  an answer is whole before REQUEST_STATE is cleared, and that before the call is over: the
///     journal has each step before it is done, so its order is theirs
/// I4  the handler of an at-most-once call starts at most once
/// I5  every call that was given out has ended
/// I9  an attempt is run by one instance only, and no instance runs a call twice
/// and those of the recording, violations_recorded
std::vector<std::string> violations(const History& history);

}  // namespace millrace::tests::cluster
