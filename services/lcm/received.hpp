// Parses and checks the messages of LCM processes: every message on LCM is untrusted. Pure.
//
//   const auto presence = parse_presence(bytes);
//   if (!presence) warn_limited(presence.error());
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/lcm/packet.hpp"
#include "services/lcm/rules.hpp"
#include "services/sdk/announcement.hpp"

namespace millrace::services::lcm {

/// An attempt of a call.
struct Attempt {
  /// As call_name() returns it; only the form is checked, not the digest.
  std::string call{};
  std::uint32_t number = 1;
  bool operator==(const Attempt&) const = default;
};

struct Presence {
  /// Not 0.
  std::int64_t program = 0;
  /// By the clock of the LCM process.
  fabric::Time at{};
  sdk::Announcement announcement{};
  /// The calls that it runs.
  std::vector<Attempt> calls{};
  bool draining = false;
};

enum class AnswerKind : std::uint8_t { final, interim, failed };

/// Text and state as received: whether they can be written is checked later, and the NC program
/// gets an error if not.
struct Answered {
  std::int64_t program = 0;
  Attempt attempt{};
  AnswerKind kind = AnswerKind::final;
  std::string text{};
  std::int64_t state = 0;
};

/// The most calls of one LCM process.
inline constexpr std::uint32_t most_calls = 256;

/// The name of a call on LCM: "5f3a9c0112d4-17.8c0b1d2e3f4a5b6c". The part after the dot is a
/// digest of channel, text and state. LCM processes remember calls by this name. The call id
/// is not enough: another participant might use the id of a future call for a different request.
std::string call_name(const fabric::Request& request);

/// The error is the fault in the message.
tl::expected<Presence, std::string> parse_presence(std::string_view bytes);
tl::expected<Answered, std::string> parse_reply(std::string_view bytes);

/// A text of LCM in the controller's code page; the error is why that is not possible.
tl::expected<std::string, std::string> to_controller(const std::string& text, Encoding encoding);
/// The reverse.
std::string from_controller(const std::string& text, Encoding encoding);

// The LCM channels between the bridge and the LCM processes.

/// From all LCM processes.
inline constexpr std::string_view presence_channel = "MILLRACE_PRESENCE";

// Followed by the canonical UUID. To its processes:
inline constexpr std::string_view request_prefix = "MILLRACE_REQUEST.";
inline constexpr std::string_view withdrawal_prefix = "MILLRACE_WITHDRAWAL.";
inline constexpr std::string_view drain_prefix = "MILLRACE_DRAIN.";
// From them:
inline constexpr std::string_view reply_prefix = "MILLRACE_REPLY.";

/// Bytes of an identifier that fits into a channel's name.
inline constexpr std::size_t longest_uuid = fabric::lcm::longest_channel - withdrawal_prefix.size();

inline std::string channel_of(std::string_view prefix, std::string_view uuid) {
  return std::string(prefix).append(uuid);
}

}  // namespace millrace::services::lcm
