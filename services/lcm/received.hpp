// What programs say, checked: every message on LCM is foreign bytes. Pure.
//
//   const auto presence = parse_presence(bytes);
//   if (!presence) complain(presence.error());
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"
#include "services/lcm/rules.hpp"

namespace millrace::services::lcm {

/// An attempt of a call.
struct Attempt {
  /// As call_name() gives it; the form is checked, the digest is not.
  std::string call{};
  std::uint32_t number = 1;
  bool operator==(const Attempt&) const = default;
};

/// What an instance is registered as.
struct Announcement {
  /// Canonical.
  std::string uuid{};
  std::string name{};
  std::string description{};
  std::string version{};
  std::vector<fabric::ChannelScope> channels{};
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  std::uint32_t concurrency = 1;
  bool operator==(const Announcement&) const = default;
};

struct Presence {
  /// Not 0.
  std::int64_t program = 0;
  /// By the program's clock.
  fabric::Time at{};
  Announcement announcement{};
  /// The calls that it has.
  std::vector<Attempt> calls{};
  bool draining = false;
};

enum class AnswerKind : std::uint8_t { final, interim, failed };

/// Text and state are as they came: whether they can be written is another question, to which the
/// NC program gets an answer.
struct Answered {
  std::int64_t program = 0;
  Attempt attempt{};
  AnswerKind kind = AnswerKind::final;
  std::string text{};
  std::int64_t state = 0;
};

/// Calls that one program may have.
inline constexpr std::uint32_t most_calls = 256;

/// What a call is called on LCM: "5f3a9c0112d4-17.8c0b1d2e3f4a5b6c". The part behind the dot is
/// made of channel, text and state. Programs remember calls by this name, and a stranger on the
/// fabric may ask for something else under the id of a call to come.
std::string call_name(const fabric::Request& request);

/// The error says what is wrong with it.
tl::expected<Presence, std::string> parse_presence(std::string_view bytes);
tl::expected<Answered, std::string> parse_reply(std::string_view bytes);

/// A text of LCM in the controller's code page; the error says why it has none there.
tl::expected<std::string, std::string> to_controller(const std::string& text, Encoding encoding);
/// The other way.
std::string from_controller(const std::string& text, Encoding encoding);

}  // namespace millrace::services::lcm
