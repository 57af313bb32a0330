// Makes a file that every reader opens out of one that was cut or damaged.
#pragma once

#include <string>

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

/// Writes everything that can be read from `damaged` to `repaired`, with new indexes and summary.
/// `library` says who repaired. The error is the sink's.
tl::expected<RepairReport, std::string> repair(Source& damaged, Sink& repaired,
                                               const std::string& library);

}  // namespace millrace::tools::mcap
