#include "tools/recorder/repair.hpp"

#include <algorithm>

#include "tools/mcap/file.hpp"
#include "tools/print/hops_metadata.hpp"
#include "tools/print/missing.hpp"
#include "tools/recorder/recording_file.hpp"
#include "tools/recording/completeness.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::recorder {

namespace {

/// The readable parts of a recording, counted.
struct Count {
  std::uint64_t entries = 0;
  recording::Completeness completeness{};
  recording::HopStatistics hops{};

  explicit Count(mcap::Source& source) {
    fabric::Time last{};
    recording::read_entries(source, {}, [&](const recording::Entry& entry) {
      ++entries;
      completeness.add(entry, true);
      hops.add(entry);
      last = std::max(last, entry.at);
    });
    completeness.finish(last);
    hops.close();
  }
};

void revise(std::vector<mcap::Metadata>& all, const Count& count) {
  std::map<std::string, std::string> values;
  const auto old = std::find_if(all.begin(), all.end(), [](const mcap::Metadata& metadata) {
    return metadata.name == recorder_metadata;
  });
  if (old != all.end()) {
    values = old->values;
  } else if (count.entries == 0) {
    // No recording of ours.
    return;
  }
  for (const char* unknown : {"delivered_by_the_bus", "lost_by_the_bus", "filtered_out"}) {
    values.erase(unknown);
  }
  values["written"] = std::to_string(count.entries);
  for (const auto& [name, number] : print::missing_counts(count.completeness.missing())) {
    values[std::string(name)] = std::to_string(number);
  }
  values["repaired"] = "true";
  std::erase_if(all, [](const mcap::Metadata& metadata) {
    return metadata.name == recorder_metadata || metadata.name == hops_metadata;
  });
  all.push_back({recorder_metadata, std::move(values)});
  all.push_back({hops_metadata, print::hops_metadata(count.hops)});
}

}  // namespace

tl::expected<mcap::RepairReport, std::string> repair_recording(
    const std::filesystem::path& damaged, const std::filesystem::path& repaired,
    const std::string& library) {
  auto source = mcap::FileSource::open(damaged);
  if (!source) {
    return tl::unexpected(source.error());
  }
  const Count count(*source);
  return mcap::repair_file(damaged, repaired, library,
                           [&](std::vector<mcap::Metadata>& metadata) { revise(metadata, count); });
}

}  // namespace millrace::tools::recorder
