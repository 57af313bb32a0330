// Checks a scenario by its records. Pure.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "gateway/journal_entry.hpp"
#include "tests/cluster/history/execution_log.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tests::cluster {

struct History {
  /// The journal of the last gateway. It begins with the calls that were open then.
  std::vector<gateway::JournalEntry> journal;
  std::vector<Execution> executions;
  /// The samples on the fabric, in the order in which the recorder received them.
  std::vector<tools::recording::Entry> recording{};
  /// The calls that earlier journals know as ended.
  std::set<std::string> ended_before{};
};

/// One sentence for each violation, with the call; empty without violations.
///
/// I1  a call is answered at most once
/// I2  an answer belongs to an attempt that was dispatched
/// I3  an answer is complete before REQUEST_STATE is cleared, and that before the call is over: the
///     journal has each step before it is done, so its order is that of the steps
/// I4  the handler of an at-most-once call starts at most once
/// I5  every call that was dispatched has ended
/// I9  an attempt is run by one instance only, and no instance runs a call twice
/// and those of the recording, violations_recorded
std::vector<std::string> violations(const History& history);

}  // namespace millrace::tests::cluster
