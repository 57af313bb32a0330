#include "tools/recording/reader.hpp"

#include <algorithm>

#include "base/text/quoted.hpp"
#include "fabric/lcm/mirror.hpp"
#include "tools/mcap/scan.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/recording/codec.hpp"

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
    return time_of(chunk.end) >= filter_.from && time_of(chunk.start) <= filter_.to;
  }
  void on_message(const mcap::Channel& channel, const mcap::Message& message,
                  std::uint64_t offset) override {
    const std::string& schema = schemas_[channel.schema];
    if (!schema.starts_with(our_schemas)) {
      ++report_.foreign;
      return;
    }
    const auto entry = decode(schema, message.data, time_of(message.log_time));
    if (!entry) {
      report_.problems.push_back({offset, entry.error()});
    } else if (filter_.takes(*entry)) {
      use_(*entry);
    }
  }
  void on_problem(const mcap::Problem& problem) override { report_.problems.push_back(problem); }

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
    visitor.report().problems.push_back(summary.error());
  }
  return std::move(visitor.report());
}

namespace {

constexpr std::string_view sync_word = "\xED\xA1\xDA\x01";
/// Sync word, number, time, two lengths.
constexpr std::uint64_t header_size = 28;
constexpr std::uint64_t channel_length_at = 20;
constexpr std::uint64_t message_length_at = 24;
/// Far above our own messages; larger foreign ones are skipped unread.
constexpr std::uint64_t longest_of_ours = 65'536;

std::uint32_t number_at(std::string_view bytes, std::size_t offset) {
  std::uint32_t number = 0;
  for (const char c : bytes.substr(offset, sizeof number)) {
    number = number << 8U | static_cast<unsigned char>(c);
  }
  return number;
}

/// Reads a file front to back in large pieces.
class Window {
 public:
  explicit Window(mcap::Source& source) : source_(source) {}

  /// `length` bytes from `offset`, fewer where the file ends; until the next call.
  std::string_view at(std::uint64_t offset, std::uint64_t length) {
    constexpr std::uint64_t piece = 1U << 20U;
    if (offset < start_ || offset + length > start_ + bytes_.size()) {
      source_.read(offset, std::max(length, piece), bytes_);
      start_ = offset;
    }
    return std::string_view(bytes_).substr(static_cast<std::size_t>(offset - start_),
                                           static_cast<std::size_t>(length));
  }
  [[nodiscard]] std::uint64_t size() const { return source_.size(); }

 private:
  mcap::Source& source_;
  std::uint64_t start_ = 0;
  std::string bytes_;
};

/// The possible begin of the next event, from `offset` on; the end of the file if there is none.
std::uint64_t next_sync(Window& file, std::uint64_t offset) {
  constexpr std::uint64_t step = 1U << 16U;
  while (offset + sync_word.size() <= file.size()) {
    const std::size_t found = file.at(offset, step).find(sync_word);
    if (found != std::string_view::npos) {
      return offset + found;
    }
    // A sync word may lie across two steps.
    offset += step - sync_word.size() + 1;
  }
  return file.size();
}

}  // namespace

bool is_lcm_log(mcap::Source& source) {
  std::string begin;
  source.read(0, sync_word.size(), begin);
  return begin == sync_word;
}

ReadReport read_lcm_log(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use) {
  ReadReport report;
  Window file(source);
  std::uint64_t offset = 0;
  while (offset < file.size()) {
    const std::string header(file.at(offset, header_size));
    if (!header.starts_with(sync_word.substr(0, header.size()))) {
      const std::uint64_t next = next_sync(file, offset + 1);
      report.problems.push_back({offset, "no LCM event begins here; " +
                                             std::to_string(next - offset) + " bytes are skipped"});
      offset = next;
      continue;
    }
    const std::uint64_t channel_length =
        header.size() < header_size ? 0 : number_at(header, channel_length_at);
    const std::uint64_t message_length =
        header.size() < header_size ? 0 : number_at(header, message_length_at);
    const std::uint64_t end = offset + header_size + channel_length + message_length;
    if (end > file.size()) {
      // Of a killed logger, or with damaged lengths.
      const std::uint64_t next = next_sync(file, offset + 1);
      report.problems.push_back({offset, "an LCM event ends after the end of the file"});
      offset = next;
      continue;
    }
    if (channel_length + message_length > longest_of_ours) {
      ++report.foreign;
      offset = end;
      continue;
    }
    const std::string_view body = file.at(offset + header_size, channel_length + message_length);
    const std::string_view channel = body.substr(0, static_cast<std::size_t>(channel_length));
    if (!fabric::lcm::is_mirror(channel)) {
      ++report.foreign;
    } else if (const auto entry = fabric::lcm::entry_of(
                   channel, body.substr(static_cast<std::size_t>(channel_length)));
               !entry) {
      report.problems.push_back({offset, "on " + base::text::safe(channel) + ": " + entry.error()});
    } else if (filter.takes(*entry)) {
      use(*entry);
    }
    offset = end;
  }
  return report;
}

}  // namespace millrace::tools::recording
