#include "tools/recorder/recording_file.hpp"

#include <algorithm>
#include <utility>

#include "tools/mcap/file.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/recording/completeness.hpp"
#include "tools/recording/lcm_log.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::recorder {

namespace {

void put_calls(std::map<std::string, std::string>& values, const recording::HopStatistics& calls) {
  values[print::calls_ended] = std::to_string(calls.ended());
  values[print::calls_failed] = std::to_string(calls.failed());
}

}  // namespace

tl::expected<std::unique_ptr<RecordingFile>, std::string> RecordingFile::create(
    const std::filesystem::path& path, const mcap::WriterOptions& options) {
  return mcap::FileSink::create(path).map([&](mcap::FileSink&& sink) {
    return std::make_unique<RecordingFile>(std::move(sink), options);
  });
}

RecordingFile::RecordingFile(mcap::FileSink sink, const mcap::WriterOptions& options)
    : sink_(std::move(sink)), file_(sink_, options), entries_(file_) {}

RecordingFile::Result RecordingFile::write(const recording::Entry& entry) {
  hops_.add(entry);
  return entries_.write(entry);
}

RecordingFile::Result RecordingFile::attach(const AttachedFile& file) {
  const auto at = static_cast<mcap::Nanoseconds>(file.at.time_since_epoch().count());
  return file_.write(mcap::Attachment{at, at, file.name, file.media_type, file.data});
}

RecordingFile::Result RecordingFile::close_chunk(bool sync) {
  return file_.close_chunk().and_then([&] { return sync ? sink_.sync() : Result{}; });
}

RecordingFile::Result RecordingFile::finish(const std::map<std::string, std::string>& metadata) {
  if (!std::exchange(ending_, true)) {
    hops_.close();
    // A refused chunk is kept, and close() reports it.
    static_cast<void>(file_.close_chunk());
    std::map<std::string, std::string> values = metadata;
    put_calls(values, hops_);
    static_cast<void>(file_.write(mcap::Metadata{print::recorder_metadata, std::move(values)}));
    static_cast<void>(file_.write(mcap::Metadata{hops_metadata, print::hops_metadata(hops_)}));
  }
  return file_.close().and_then([&] { return sink_.finish(); });
}

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
    return metadata.name == print::recorder_metadata;
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
  put_calls(values, count.hops);
  values["repaired"] = "true";
  std::erase_if(all, [](const mcap::Metadata& metadata) {
    return metadata.name == print::recorder_metadata || metadata.name == hops_metadata;
  });
  all.push_back({print::recorder_metadata, std::move(values)});
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
  if (recording::is_lcm_log(*source)) {
    return mcap::repair_into(
        repaired, [&](mcap::Sink& sink) { return recording::repair_lcm_log(*source, sink); });
  }
  const Count count(*source);
  return mcap::repair_file(damaged, repaired, library,
                           [&](std::vector<mcap::Metadata>& metadata) { revise(metadata, count); });
}

}  // namespace millrace::tools::recorder
