// Makes a file that every reader opens from one that was cut or damaged.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/mcap/problem.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

struct RepairReport {
  /// The saved records.
  Statistics saved;
  /// The problems, with their positions in the damaged file.
  Problems problems;
};

/// Changes the metadata of the damaged file for the repaired one: the records that they count may
/// be lost.
using Revise = std::function<void(std::vector<Metadata>&)>;

/// Writes everything that can be read from `damaged` to `repaired`, with new indexes and summary.
/// `library` is the name of the repairing program. The error is the sink's, or that the file
/// contains nothing of a recording.
tl::expected<RepairReport, std::string> repair(
    Source& damaged, Sink& repaired, const std::string& library,
    const Revise& revise = [](std::vector<Metadata>&) {});

}  // namespace millrace::tools::mcap
