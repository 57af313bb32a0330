#include "tools/recording/lcm_log.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string_view>

#include "base/text/quoted.hpp"
#include "fabric/lcm/mirror.hpp"

namespace millrace::tools::recording {

namespace {

constexpr std::string_view sync_word = "\xED\xA1\xDA\x01";
/// Sync word, number, time, two lengths.
constexpr std::uint64_t header_size = 28;
constexpr std::size_t time_at = 12;
constexpr std::size_t channel_length_at = 20;
constexpr std::size_t message_length_at = 24;
/// LCM's own limit is 63 characters.
constexpr std::uint64_t longest_channel = 63;
/// Far above our own messages; larger foreign ones are skipped unread.
constexpr std::uint64_t longest_of_ours = 65'536;
constexpr std::uint64_t piece = 1U << 20U;

template <typename Number>
Number number_at(std::string_view bytes, std::size_t offset) {
  Number number = 0;
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

/// The place of an event's parts in the file.
struct Event {
  std::uint64_t offset = 0;
  /// Microseconds since 1970.
  std::uint64_t time = 0;
  std::uint64_t channel_length = 0;
  std::uint64_t message_length = 0;

  [[nodiscard]] std::uint64_t body() const { return offset + header_size; }
  [[nodiscard]] std::uint64_t end() const { return body() + channel_length + message_length; }
};

/// The event at `offset`, if a whole header is there.
std::optional<Event> header_at(Window& file, std::uint64_t offset) {
  const std::string_view header = file.at(offset, header_size);
  if (header.size() < header_size || !header.starts_with(sync_word)) {
    return std::nullopt;
  }
  return Event{offset, number_at<std::uint64_t>(header, time_at),
               number_at<std::uint32_t>(header, channel_length_at),
               number_at<std::uint32_t>(header, message_length_at)};
}

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

/// Passes each whole event on; what is between them is a problem.
void for_each_event(Window& file, mcap::Problems& problems,
                    const std::function<void(const Event&)>& use) {
  std::uint64_t offset = 0;
  while (offset < file.size()) {
    const auto event = header_at(file, offset);
    if (event && event->end() <= file.size()) {
      use(*event);
      offset = event->end();
      continue;
    }
    const std::uint64_t next = next_sync(file, offset + 1);
    const std::string begin(file.at(offset, sync_word.size()));
    // Of a killed logger, or with damaged lengths.
    problems.add({offset, begin == sync_word.substr(0, begin.size())
                              ? "an LCM event ends after the end of the file"
                              : "no LCM event begins here; " + std::to_string(next - offset) +
                                    " bytes are skipped"});
    offset = next;
  }
}

}  // namespace

bool is_lcm_log(mcap::Source& source) {
  Window file(source);
  const std::string start(file.at(0, piece));
  if (start.starts_with(sync_word) ||
      mcap::magic.starts_with(start.substr(0, mcap::magic.size()))) {
    return start.starts_with(sync_word);
  }
  for (std::size_t at = start.find(sync_word); at != std::string::npos;
       at = start.find(sync_word, at + 1)) {
    const auto event = header_at(file, at);
    if (event && event->channel_length <= longest_channel &&
        (event->end() == file.size() || header_at(file, event->end()))) {
      return true;
    }
  }
  return false;
}

ReadReport read_lcm_log(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use) {
  ReadReport report;
  Window file(source);
  for_each_event(file, report.problems, [&](const Event& event) {
    report.has_read = true;
    if (event.channel_length + event.message_length > longest_of_ours) {
      ++report.foreign;
      return;
    }
    const std::string_view body =
        file.at(event.body(), event.channel_length + event.message_length);
    const std::string_view channel = body.substr(0, static_cast<std::size_t>(event.channel_length));
    if (!fabric::lcm::is_mirror(channel)) {
      ++report.foreign;
    } else if (const auto entry = fabric::lcm::entry_of(
                   channel, body.substr(static_cast<std::size_t>(event.channel_length)));
               !entry) {
      report.problems.add({event.offset, "on " + base::text::safe(channel) + ": " + entry.error()});
    } else if (filter.takes(*entry)) {
      use(*entry);
    }
  });
  return report;
}

mcap::Survey survey_lcm_log(mcap::Source& source) {
  mcap::Survey survey;
  survey.summary.header.library = "LCM's logger";
  mcap::Statistics& all = survey.summary.statistics;
  std::map<std::string, mcap::ChannelId> ids;
  Window file(source);
  for_each_event(file, survey.problems, [&](const Event& event) {
    const mcap::Nanoseconds time = event.time * 1000;
    all.start = all.messages == 0 ? time : std::min(all.start, time);
    all.end = std::max(all.end, time);
    ++all.messages;
    const std::string topic(file.at(event.body(), std::min(event.channel_length, longest_channel)));
    const auto id = static_cast<mcap::ChannelId>(ids.size());
    const auto [known, is_new] = ids.try_emplace(topic, id);
    if (is_new && ids.size() > std::numeric_limits<mcap::ChannelId>::max()) {
      ids.erase(known);
      survey.problems.add({event.offset, "the log has more channels than are counted"});
      return;
    }
    if (is_new) {
      static_cast<void>(
          survey.summary.definitions.add(mcap::Channel{id, 0, topic, "", {}}, event.offset));
      ++all.channels;
    }
    ++all.channel_messages[known->second];
  });
  survey.closed = survey.problems.empty();
  return survey;
}

tl::expected<mcap::RepairReport, std::string> repair_lcm_log(mcap::Source& damaged,
                                                             mcap::Sink& repaired) {
  mcap::RepairReport report;
  tl::expected<void, std::string> result;
  Window file(damaged);
  for_each_event(file, report.problems, [&](const Event& event) {
    ++report.saved.messages;
    for (std::uint64_t at = event.offset; at < event.end() && result; at += piece) {
      result = repaired.write(file.at(at, std::min(piece, event.end() - at)));
    }
  });
  return result.map([&] { return std::move(report); });
}

}  // namespace millrace::tools::recording
