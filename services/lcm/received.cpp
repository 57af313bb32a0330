#include "services/lcm/received.hpp"

#include <algorithm>
#include <limits>

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid.hpp>
#include <fmt/format.h>
#include <millrace/presence_t.hpp>
#include <millrace/reply_t.hpp>

#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/lcm/message.hpp"
#include "fabric/messages.hpp"

namespace millrace::services::lcm {

namespace {

using Error = tl::unexpected<std::string>;

// The limits of idl/millrace.idl and of identities.
constexpr std::size_t longest_name = 63;
constexpr std::size_t longest_description = 127;
constexpr std::size_t longest_version = 31;
/// The most channels that an LCM process may announce.
constexpr std::size_t most_scopes = 16;

/// Letters, digits, '-', '_', '.': excludes wildcards of partitions, and blanks in names.
bool is_plain(char c) {
  return base::text::is_alphanumeric(c) || c == '-' || c == '_' || c == '.';
}

tl::expected<std::string, std::string> checked_uuid(const std::string& text) {
  std::string uuid = fabric::canonical_uuid(text);
  if (uuid.empty() || uuid.size() > longest_uuid || !std::ranges::all_of(uuid, is_plain)) {
    return Error(
        fmt::format("its UUID is {}; expected a UUID, or 1 to {} letters, digits, '-', "
                    "'_' and '.'",
                    base::text::quoted(text.substr(0, longest_uuid)), longest_uuid));
  }
  return uuid;
}

tl::expected<std::string, std::string> checked_text(const std::string& text, const char* field,
                                                    std::size_t longest) {
  std::string safe = base::text::safe(text);
  if (safe.size() > longest) {
    return Error(fmt::format("its {} has {} bytes; at most {} fit", field, safe.size(), longest));
  }
  return safe;
}

tl::expected<std::vector<fabric::ChannelScope>, std::string> scopes(std::string_view text) {
  std::vector<fabric::ChannelScope> scopes;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (word.empty()) {
      continue;
    }
    const auto scope = fabric::parse_channel_scope(word);
    if (!scope) {
      return Error("its channels: " + scope.error());
    }
    if (scopes.size() == most_scopes) {
      return Error(fmt::format("it names more than {} channels", most_scopes));
    }
    scopes.push_back(*scope);
  }
  return scopes;
}

tl::expected<Attempt, std::string> attempt_of(const call_t& call) {
  const std::string_view id = call.id;
  constexpr std::size_t longest = 64;
  if (id.size() > longest || !std::ranges::all_of(id, is_plain) ||
      !fabric::parse_call_id(id.substr(0, id.find('.'))) || call.attempt < 1) {
    return Error("it names an impossible call: " + base::text::quoted(call.id.substr(0, 64)));
  }
  return Attempt{call.id, static_cast<std::uint32_t>(call.attempt)};
}

tl::expected<sdk::Announcement, std::string> announcement_of(const presence_t& from) {
  auto uuid = checked_uuid(from.uuid);
  if (!uuid) {
    return Error(uuid.error());
  }
  auto name = checked_text(from.name.empty() ? "lcm" : from.name, "name", longest_name);
  auto description = checked_text(from.description, "description", longest_description);
  auto version = checked_text(from.version, "version", longest_version);
  for (const auto* text : {&name, &description, &version}) {
    if (!*text) {
      return Error(text->error());
    }
  }
  auto channels = scopes(from.channels);
  if (!channels) {
    return Error(channels.error());
  }
  if (from.concurrency < 1 || from.concurrency > static_cast<std::int32_t>(most_calls)) {
    return Error(
        fmt::format("its concurrency is {}; expected 1 to {}", from.concurrency, most_calls));
  }
  if (from.delivery != presence_t::AT_LEAST_ONCE && from.delivery != presence_t::AT_MOST_ONCE) {
    return Error(fmt::format("its delivery is {}; expected 0 (at least once) or 1 (at most once)",
                             from.delivery));
  }
  return sdk::Announcement{.uuid = *std::move(uuid),
                           .name = *std::move(name),
                           .description = *std::move(description),
                           .version = *std::move(version),
                           .channels = *std::move(channels),
                           .delivery = from.delivery == presence_t::AT_MOST_ONCE
                                           ? fabric::Delivery::at_most_once
                                           : fabric::Delivery::at_least_once,
                           .concurrency = static_cast<std::uint32_t>(from.concurrency)};
}

/// True for microseconds that fit into nanoseconds of 64 bits.
bool is_time(std::int64_t microseconds) {
  constexpr std::int64_t last = std::numeric_limits<std::int64_t>::max() / 1000;
  return microseconds > 0 && microseconds <= last;
}

}  // namespace

std::string call_name(const fabric::Request& request) {
  const boost::uuids::name_generator_sha1 digest{boost::uuids::uuid{}};
  const boost::uuids::uuid of_question =
      digest(fmt::format("{}\n{}\n{}", request.key.to_string(), request.state, request.text));
  std::uint64_t shown = 0;
  for (std::size_t i = 0; i < sizeof shown; ++i) {
    shown = (shown << 8U) | of_question.data[i];
  }
  return fmt::format("{}.{:016x}", request.call.to_string(), shown);
}

tl::expected<Presence, std::string> parse_presence(std::string_view bytes) {
  if (const auto type = fabric::lcm::check_type<presence_t>(bytes); !type) {
    return Error(type.error());
  }
  // Each call takes at least its length, its NUL and its attempt.
  constexpr std::size_t smallest_call = 9;
  const std::int32_t count = fabric::lcm::leading_count(bytes);
  if (count < 0 || count > static_cast<std::int32_t>(most_calls) ||
      static_cast<std::size_t>(count) * smallest_call > bytes.size()) {
    return Error(fmt::format("it announces {} calls; at most {} may follow", count, most_calls));
  }
  const auto message = fabric::lcm::decode<presence_t>(bytes);
  if (!message) {
    return Error(message.error());
  }
  if (message->program == 0) {
    return Error("its number is 0; expected a random number that the program draws when it starts");
  }
  if (!is_time(message->utime)) {
    return Error(fmt::format("its utime is {}; expected microseconds since 1970", message->utime));
  }
  auto announcement = announcement_of(*message);
  if (!announcement) {
    return Error(announcement.error());
  }
  Presence presence{.program = message->program,
                    .at = fabric::Time(std::chrono::microseconds(message->utime)),
                    .announcement = *std::move(announcement),
                    .draining = message->draining != 0};
  for (const call_t& call : message->calls) {
    const auto attempt = attempt_of(call);
    if (!attempt) {
      return Error(attempt.error());
    }
    presence.calls.push_back(*attempt);
  }
  return presence;
}

tl::expected<Answered, std::string> parse_reply(std::string_view bytes) {
  const auto message = fabric::lcm::decode<reply_t>(bytes);
  if (!message) {
    return Error(message.error());
  }
  const auto attempt = attempt_of(message->call);
  if (!attempt) {
    return Error(attempt.error());
  }
  Answered answered{.program = message->program,
                    .attempt = *attempt,
                    .text = message->text,
                    .state = message->state};
  switch (message->kind) {
    case reply_t::FINAL:
      return answered;
    case reply_t::INTERIM:
      answered.kind = AnswerKind::interim;
      return answered;
    case reply_t::FAILED:
      answered.kind = AnswerKind::failed;
      return answered;
    default:
      return Error(fmt::format("its kind is {}; expected 0, 1 or 2", message->kind));
  }
}

tl::expected<std::string, std::string> to_controller(const std::string& text, Encoding encoding) {
  return encoding == Encoding::utf8 ? base::text::to_cp1252(text)
                                    : tl::expected<std::string, std::string>(text);
}

std::string from_controller(const std::string& text, Encoding encoding) {
  return encoding == Encoding::utf8 ? base::text::to_utf8(text) : text;
}

}  // namespace millrace::services::lcm
