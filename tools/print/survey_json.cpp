#include "tools/print/survey_json.hpp"

#include <boost/json/array.hpp>

#include "tools/print/json.hpp"

namespace millrace::tools::print {

namespace {

fabric::Time time_of(mcap::Nanoseconds time) {
  return fabric::Time(std::chrono::nanoseconds(static_cast<std::int64_t>(time)));
}

}  // namespace

boost::json::object json_of(std::uint64_t size, const mcap::Survey& survey) {
  const mcap::Statistics& counts = survey.summary.statistics;
  boost::json::object out;
  out["size"] = size;
  out["closed"] = survey.from_summary;
  out["library"] = utf8(survey.summary.header.library);
  put_time(out, "start", time_of(counts.start));
  put_time(out, "end", time_of(counts.end));
  out["messages"] = counts.messages;
  out["chunks"] = counts.chunks;
  out["channels"] = counts.channels;
  out["schemas"] = counts.schemas;
  boost::json::array topics;
  for (const auto& [id, channel] : survey.summary.definitions.channels()) {
    const mcap::Schema* schema = survey.summary.definitions.schema(channel.schema);
    const auto count = counts.channel_messages.find(id);
    topics.push_back({{"topic", utf8(channel.topic)},
                      {"schema", schema == nullptr ? "-" : utf8(schema->name)},
                      {"messages", count == counts.channel_messages.end() ? 0 : count->second}});
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
  for (const mcap::Problem& problem : survey.problems) {
    problems.push_back({{"offset", problem.offset}, {"text", utf8(problem.text)}});
  }
  out["problems"] = std::move(problems);
  return out;
}

}  // namespace millrace::tools::print
