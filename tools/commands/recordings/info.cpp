// millrace recording info: what a recording holds, from its summary.
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/print/json.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::recordings {

namespace {

struct InfoOptions {
  std::filesystem::path file;
  bool hops = false;
  bool json = false;
};

fabric::Time time_of(mcap::Nanoseconds time) {
  return fabric::Time(std::chrono::nanoseconds(static_cast<std::int64_t>(time)));
}

/// Foreign text made safe for a terminal.
std::string shown(const std::string& text) {
  return base::text::safe(print::utf8(text));
}

/// "zstd: 12 chunks, 1.5 MiB of 8.0 MiB"
std::string compression_text(const std::string& compression, const mcap::ChunkSizes& sizes) {
  const std::string size = print::size_text(sizes.uncompressed);
  return fmt::format("{}: {} chunks, {}", compression.empty() ? "none" : shown(compression),
                     sizes.chunks,
                     compression.empty() ? size : print::size_text(sizes.stored) + " of " + size);
}

void print_text(const InfoOptions& options, std::uint64_t size, const mcap::Survey& survey) {
  const mcap::Statistics& counts = survey.summary.statistics;
  fmt::print("{}: {}, {}\n", options.file.string(), print::size_text(size),
             survey.from_summary ? "closed" : "without a valid summary: the whole file was read");
  fmt::print("written by  {}\n", shown(survey.summary.header.library));
  if (counts.messages > 0) {
    fmt::print("recorded    {} to {} ({})\n", print::time_text(time_of(counts.start)),
               print::time_text(time_of(counts.end)),
               print::duration_text(time_of(counts.end) - time_of(counts.start)));
  }
  fmt::print("messages    {} in {} chunks, {} channels\n", counts.messages, counts.chunks,
             counts.channels);
  for (const auto& [compression, sizes] : survey.chunk_sizes) {
    fmt::print("compression {}\n", compression_text(compression, sizes));
  }
  for (const mcap::Metadata& metadata : survey.metadata) {
    fmt::print("{}\n", shown(metadata.name));
    for (const auto& [key, value] : metadata.values) {
      fmt::print("  {}: {}\n", shown(key), shown(value));
    }
  }
  for (const mcap::AttachmentIndex& attachment : survey.summary.attachments) {
    fmt::print("attachment  {} ({})\n", shown(attachment.name),
               print::size_text(attachment.data_size));
  }
}

void print_topics(const mcap::Summary& summary) {
  print::Table table({{"TOPIC"}, {"MESSAGES", print::Align::right}, {"SCHEMA"}});
  for (const auto& [id, channel] : summary.definitions.channels()) {
    const mcap::Schema* schema = summary.definitions.schema(channel.schema);
    const auto count = summary.statistics.channel_messages.find(id);
    table.add(
        {print::utf8(channel.topic),
         std::to_string(count == summary.statistics.channel_messages.end() ? 0 : count->second),
         schema == nullptr ? "-" : print::utf8(schema->name)});
  }
  if (!table.empty()) {
    fmt::print("\n{}", table.text());
  }
}

int info(const InfoOptions& options) {
  mcap::FileSource source = open(options.file);
  const mcap::Survey survey = mcap::survey(source);
  recording::HopStatistics hops;
  if (options.hops) {
    recording::read_entries(source, {}, [&](const recording::Entry& entry) { hops.add(entry); });
    hops.close();
  }
  if (options.json) {
    boost::json::object out = print::json_of(source.size(), survey);
    if (options.hops) {
      out["hops"] = print::hops_json(hops);
    }
    print::print_json(out);
  } else {
    print_text(options, source.size(), survey);
    print_topics(survey.summary);
    if (options.hops) {
      fmt::print("\n{}", print::hops_text(hops));
    }
  }
  return report(options.file, survey.problems);
}

}  // namespace

void add_info(CLI::App& recording, Chosen& chosen) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App& command =
      add_subcommand(recording, "info", "What a recording holds; reads its summary only",
                     "millrace recording info --hops run.mcap");
  add_file(command, options->file);
  command.add_flag("--hops", options->hops,
                   "Also p50, p99 and maximum of each hop and service; reads the whole file");
  add_json(command, options->json);
  command.callback([options, &chosen] { chosen.run = [options] { return info(*options); }; });
}

}  // namespace millrace::tools::commands::recordings
