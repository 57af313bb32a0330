// Judges a scenario by what was written down while it ran. Pure.
#pragma once

#include <string>
#include <vector>

#include "gateway/journal/entry.hpp"
#include "tests/cluster/history/execution_log.hpp"

namespace millrace::tests::cluster {

struct History {
  /// The gateway's journal, all of it.
  std::vector<gateway::journal::Entry> journal;
  std::vector<Execution> executions;
};

/// One sentence for each violation, with the call; empty if there is none.
///
/// I1  a call is answered at most once
/// I2  an answer belongs to an attempt that was given out
/// I4  the handler of an at-most-once call starts at most once
/// I5  every call that was given out has ended
/// I9  an attempt is run by one instance only, and no instance runs a call twice
std::vector<std::string> violations(const History& history);

}  // namespace millrace::tests::cluster
