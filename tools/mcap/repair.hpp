// Makes a file that every reader opens out of one that was cut or damaged.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/mcap/problem.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

struct RepairReport {
  /// What was saved.
  Statistics saved;
  /// What was not, and where it was in the damaged file.
  Problems problems;
};

/// Changes the metadata that the damaged file had into those of the repaired one: what they counted
/// may be there no more.
using Revise = std::function<void(std::vector<Metadata>&)>;

/// Writes everything that can be read from `damaged` to `repaired`, with new indexes and summary.
/// `library` says who repaired. The error is the sink's, or says that nothing in it is of a
/// recording.
tl::expected<RepairReport, std::string> repair(
    Source& damaged, Sink& repaired, const std::string& library,
    const Revise& revise = [](std::vector<Metadata>&) {});

}  // namespace millrace::tools::mcap
