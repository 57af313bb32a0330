#include "tools/recording/reader.hpp"

#include "tools/mcap/scan.hpp"
#include "tools/recording/codec.hpp"
#include "tools/recording/lcm_log.hpp"

namespace millrace::tools::recording {

namespace {

constexpr std::string_view our_schemas = "millrace.recording.";

/// MCAP's times are unsigned; ours end in the year 2262.
fabric::Time time_of(mcap::Nanoseconds time) {
  return fabric::Time(std::chrono::nanoseconds(static_cast<std::int64_t>(time)));
}

class EntryVisitor : public mcap::Visitor {
 public:
  EntryVisitor(const Filter& filter, const std::function<void(const Entry&)>& use)
      : filter_(filter), use_(use) {}

  void on_schema(const mcap::Schema& schema) override { schemas_[schema.id] = schema.name; }
  bool wants(const mcap::ChunkFrame& chunk) override {
    report_.has_read = true;
    return time_of(chunk.end) >= filter_.from && time_of(chunk.start) <= filter_.to;
  }
  void on_message(const mcap::Channel& channel, const mcap::Message& message,
                  std::uint64_t offset) override {
    report_.has_read = true;
    const std::string& schema = schemas_[channel.schema];
    if (!schema.starts_with(our_schemas)) {
      ++report_.foreign;
      return;
    }
    const auto entry = decode(schema, message.data, time_of(message.log_time));
    if (!entry) {
      report_.problems.add({offset, entry.error()});
    } else if (filter_.takes(*entry)) {
      use_(*entry);
    }
  }
  void on_problem(const mcap::Problem& problem) override { report_.problems.add(problem); }

  ReadReport& report() { return report_; }

 private:
  const Filter& filter_;
  const std::function<void(const Entry&)>& use_;
  std::map<mcap::SchemaId, std::string> schemas_;
  ReadReport report_;
};

}  // namespace

ReadReport read_entries(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use) {
  if (is_lcm_log(source)) {
    return read_lcm_log(source, filter, use);
  }
  const auto summary = mcap::read_summary(source);
  EntryVisitor visitor(filter, use);
  const bool closed =
      mcap::scan(source, summary ? summary->definitions : mcap::Definitions{}, visitor);
  if (closed && !summary) {
    visitor.report().problems.add(summary.error());
  }
  return std::move(visitor.report());
}

mcap::Survey survey(mcap::Source& source) {
  return is_lcm_log(source) ? survey_lcm_log(source) : mcap::survey(source);
}

}  // namespace millrace::tools::recording
