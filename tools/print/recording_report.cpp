#include "tools/print/recording_report.hpp"

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using recording::Histogram;

double milliseconds(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// Calls `use(uuid, hop, histogram)` for each hop that was measured.
template <typename Use>
void for_each_hop(const recording::HopStatistics& hops, Use use) {
  for (const auto& [uuid, histograms] : hops.services()) {
    for (std::size_t i = 0; i < histograms.size(); ++i) {
      if (histograms.at(i).count() > 0) {
        use(uuid, name_of(static_cast<recording::Hop>(i)), histograms.at(i));
      }
    }
  }
}

}  // namespace

std::string hops_text(const recording::HopStatistics& hops) {
  Table table({{"SERVICE"},
               {"HOP"},
               {"CALLS", Align::right},
               {"P50", Align::right},
               {"P99", Align::right},
               {"MAX", Align::right}});
  for_each_hop(hops, [&](const std::string& uuid, std::string_view hop, const Histogram& times) {
    table.add({utf8(uuid), std::string(hop), std::to_string(times.count()),
               duration_text(times.percentile(0.5)), duration_text(times.percentile(0.99)),
               duration_text(times.max())});
  });
  return table.empty() ? "no call was answered in this recording\n" : table.text();
}

boost::json::array hops_json(const recording::HopStatistics& hops) {
  boost::json::array out;
  for_each_hop(hops, [&](const std::string& uuid, std::string_view hop, const Histogram& times) {
    out.push_back({{"uuid", utf8(uuid)},
                   {"hop", hop},
                   {"calls", times.count()},
                   {"p50_ms", milliseconds(times.percentile(0.5))},
                   {"p99_ms", milliseconds(times.percentile(0.99))},
                   {"max_ms", milliseconds(times.max())}});
  });
  return out;
}

std::map<std::string, std::string> hops_metadata(const recording::HopStatistics& hops) {
  std::map<std::string, std::string> metadata;
  for (const auto& [uuid, histograms] : hops.services()) {
    for (std::size_t i = 0; i < histograms.size(); ++i) {
      const recording::Histogram& times = histograms.at(i);
      if (times.count() > 0) {
        metadata[fmt::format("{} {}", uuid, name_of(static_cast<recording::Hop>(i)))] = fmt::format(
            "calls {}, p50 {}, p99 {}, max {}", times.count(), duration_text(times.percentile(0.5)),
            duration_text(times.percentile(0.99)), duration_text(times.max()));
      }
    }
  }
  return metadata;
}

namespace {

fabric::Time time_of(mcap::Nanoseconds time) {
  return fabric::Time(std::chrono::nanoseconds(static_cast<std::int64_t>(time)));
}

/// Foreign text made safe for a terminal.
std::string shown(std::string_view text) {
  return base::text::safe(utf8(text));
}

std::string counted(std::uint64_t count, std::string_view single, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? single : many);
}

/// "zstd: 12 chunks, 1.5 MiB of 8.0 MiB"
std::string compression_text(const std::string& compression, const mcap::ChunkSizes& sizes) {
  const std::string size = size_text(sizes.uncompressed);
  return fmt::format("{}: {}, {}", compression.empty() ? "none" : shown(compression),
                     counted(sizes.chunks, "chunk", "chunks"),
                     compression.empty() ? size : size_text(sizes.stored) + " of " + size);
}

struct Topic {
  std::string name;
  /// "-" if unknown.
  std::string schema;
  std::uint64_t messages = 0;
};

std::vector<Topic> topics_of(const mcap::Summary& summary) {
  std::vector<Topic> topics;
  for (const auto& [id, channel] : summary.definitions.channels()) {
    const mcap::Schema* schema = summary.definitions.schema(channel.schema);
    const auto count = summary.statistics.channel_messages.find(id);
    topics.push_back({utf8(channel.topic), schema == nullptr ? "-" : utf8(schema->name),
                      count == summary.statistics.channel_messages.end() ? 0 : count->second});
  }
  return topics;
}

}  // namespace

std::string text_of(const std::string& file, std::uint64_t size, const mcap::Survey& survey) {
  const mcap::Statistics& counts = survey.summary.statistics;
  std::string text =
      fmt::format("{}: {}, {}\nwritten by  {}\n", file, size_text(size),
                  survey.from_summary ? "closed"
                  : survey.closed     ? "closed, without statistics: the whole file was read"
                                      : "without a valid summary: the whole file was read",
                  shown(survey.summary.header.library));
  if (counts.messages > 0) {
    text += fmt::format("recorded    {} to {} ({})\n", time_text(time_of(counts.start)),
                        time_text(time_of(counts.end)),
                        duration_text(time_of(counts.end) - time_of(counts.start)));
  }
  text += fmt::format("messages    {} in {}, {}\n", counts.messages,
                      counted(counts.chunks, "chunk", "chunks"),
                      counted(counts.channels, "topic", "topics"));
  for (const auto& [compression, sizes] : survey.chunk_sizes) {
    text += fmt::format("compression {}\n", compression_text(compression, sizes));
  }
  for (const mcap::Metadata& metadata : survey.metadata) {
    text += fmt::format("{}\n", shown(metadata.name));
    for (const auto& [key, value] : metadata.values) {
      text += fmt::format("  {}: {}\n", shown(key), shown(value));
    }
  }
  for (const mcap::AttachmentIndex& attachment : survey.summary.attachments) {
    text += fmt::format("attachment  {} ({})\n", shown(attachment.name),
                        size_text(attachment.data_size));
  }
  Table table({{"TOPIC"}, {"MESSAGES", Align::right}, {"SCHEMA"}});
  for (Topic& topic : topics_of(survey.summary)) {
    table.add({std::move(topic.name), std::to_string(topic.messages), std::move(topic.schema)});
  }
  return table.empty() ? text : text + '\n' + table.text();
}

boost::json::object json_of(std::uint64_t size, const mcap::Survey& survey) {
  const mcap::Statistics& counts = survey.summary.statistics;
  boost::json::object out;
  out["size"] = size;
  out["closed"] = survey.closed;
  out["library"] = utf8(survey.summary.header.library);
  put_time(out, "start", time_of(counts.start));
  put_time(out, "end", time_of(counts.end));
  out["messages"] = counts.messages;
  out["chunks"] = counts.chunks;
  out["channels"] = counts.channels;
  out["schemas"] = counts.schemas;
  boost::json::array topics;
  for (const Topic& topic : topics_of(survey.summary)) {
    topics.push_back(
        {{"topic", topic.name}, {"schema", topic.schema}, {"messages", topic.messages}});
  }
  out["topics"] = std::move(topics);
  boost::json::object compression;
  for (const auto& [name, sizes] : survey.chunk_sizes) {
    compression[name.empty() ? "none" : utf8(name)] = {
        {"chunks", sizes.chunks}, {"stored", sizes.stored}, {"uncompressed", sizes.uncompressed}};
  }
  out["compression"] = std::move(compression);
  boost::json::object metadata;
  for (const mcap::Metadata& record : survey.metadata) {
    boost::json::object values;
    for (const auto& [key, value] : record.values) {
      values[utf8(key)] = utf8(value);
    }
    metadata[utf8(record.name)] = std::move(values);
  }
  out["metadata"] = std::move(metadata);
  boost::json::array attachments;
  for (const mcap::AttachmentIndex& attachment : survey.summary.attachments) {
    attachments.push_back({{"name", utf8(attachment.name)}, {"size", attachment.data_size}});
  }
  out["attachments"] = std::move(attachments);
  boost::json::array problems;
  for (const mcap::Problem& problem : survey.problems.described()) {
    problems.push_back({{"offset", problem.offset}, {"text", utf8(problem.text)}});
  }
  out["problems"] = std::move(problems);
  return out;
}

std::array<std::pair<std::string_view, std::uint64_t>, 6> missing_counts(
    const recording::Missing& missing) {
  return {{{"calls_complete", missing.complete},
           {"calls_incomplete", missing.incomplete},
           {"calls_unseen", missing.unseen},
           {"missing_requests", missing.requests},
           {"missing_replies", missing.replies},
           {"missing_events", missing.events}}};
}

std::string missing_text(const recording::Missing& missing) {
  std::string text = fmt::format("{} complete", counted(missing.complete, "call is", "calls are"));
  if (missing.incomplete > 0) {
    text += fmt::format("; {} incomplete: at least {}, {} and {} are missing",
                        counted(missing.incomplete, "call is", "calls are"),
                        counted(missing.requests, "request", "requests"),
                        counted(missing.replies, "reply", "replies"),
                        counted(missing.events, "event", "events"));
  }
  if (missing.unseen > 0) {
    text += fmt::format("; {} not received", counted(missing.unseen, "call was", "calls were"));
  }
  return text;
}

}  // namespace millrace::tools::print
