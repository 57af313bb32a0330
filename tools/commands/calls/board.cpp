#include "tools/commands/calls/board.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::calls {

namespace {

/// More than any terminal shows.
constexpr std::size_t most_lines = 200;

/// Adds `line` if there is room.
void put(std::string& text, std::size_t& rows, const std::string& line, std::size_t columns) {
  if (rows > 0) {
    text += print::first_of(line, columns) + '\n';
    --rows;
  }
}

std::string request_text(const recording::Call& call) {
  const recording::Step* const seen = call.first(recording::Stage::seen);
  return seen == nullptr ? "?" : base::text::quoted(seen->text);
}

}  // namespace

void Board::add(const recording::Call& call, const recording::InstanceNames::Name& instance,
                fabric::Time now) {
  Channel& channel = channels_[call.key];
  channel.rate.add(now, call.duration());
  const recording::Step* const written = call.first(recording::Stage::written);
  channel.last_response =
      written != nullptr ? fmt::format("{} {}", base::text::quoted(written->text), written->state)
                         : std::string(print::end_of(call));
  lines_.push_back(print::line_of(call, instance));
  if (lines_.size() > most_lines) {
    lines_.pop_front();
  }
}

std::string Board::table(const fabric::plant::Plant& live, const recording::CallFollower& follower,
                         fabric::Time now) const {
  using print::Align;
  std::set<fabric::ChannelKey> keys;
  for (const auto& [key, status] : live.channels()) {
    keys.insert(key);
  }
  for (const auto& [key, channel] : channels_) {
    keys.insert(key);
  }
  print::Table table({{"CHANNEL"},
                      {"STATE"},
                      {"CALLS/S", Align::right},
                      {"MEAN", Align::right},
                      {"SEEN", Align::right},
                      {"LAST RESPONSE"},
                      {"PENDING"}});
  for (const fabric::ChannelKey& key : keys) {
    const auto status = live.channels().find(key);
    const auto known = channels_.find(key);
    const Channel& channel = known != channels_.end() ? known->second : Channel{};
    const auto pending = follower.under_way().find(key);
    const auto mean = channel.rate.mean(now);
    table.add(
        {base::text::safe(key.to_string()),
         status == live.channels().end() ? "-" : std::string(fabric::name_of(status->second.state)),
         fmt::format("{:.1f}", channel.rate.per_second(now)),
         mean ? print::duration_text(*mean) : "-", std::to_string(channel.rate.count()),
         channel.last_response,
         pending == follower.under_way().end() ? "" : request_text(pending->second)});
  }
  return table.text();
}

std::string Board::text(const fabric::plant::Plant& live, const recording::CallFollower& follower,
                        fabric::Time now, std::size_t rows, std::size_t columns) const {
  std::string text;
  const std::string channels = table(live, follower, now);
  for (std::size_t from = 0; from < channels.size();) {
    const std::size_t end = channels.find('\n', from);
    put(text, rows, channels.substr(from, end - from), columns);
    from = end + 1;
  }
  put(text, rows, "", columns);
  const std::size_t shown = std::min(rows, lines_.size());
  for (std::size_t i = lines_.size() - shown; i < lines_.size(); ++i) {
    put(text, rows, lines_[i], columns);
  }
  return text;
}

}  // namespace millrace::tools::commands::calls
