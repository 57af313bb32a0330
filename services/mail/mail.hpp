// A mail on its way: what the server is told, and what has become of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::services::mail {

/// Envelope and message.
struct Mail {
  std::string from{};
  std::vector<std::string> to{};
  /// As to_message() makes it.
  std::string message{};
  bool operator==(const Mail&) const = default;
};

/// How far a mail has come (idl/mail.proto has the meanings).
enum class Stage : std::uint8_t { waiting, handed_over, accepted, refused, given_up };

/// What the spool keeps of one call.
struct Entry {
  fabric::CallId call{};
  Stage stage = Stage::waiting;
  Mail mail{};
  /// When the call came.
  fabric::Time made{};
  std::uint32_t attempts = 0;
  /// When it is tried again, while it waits.
  fabric::Time next{};
  /// What the server, or the way to it, said last.
  std::string reply{};
  bool operator==(const Entry&) const = default;
};

}  // namespace millrace::services::mail
