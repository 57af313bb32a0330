// A mail in delivery: its envelope and message, and its stage.
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

/// The stages of a mail (meanings: idl/mail.proto).
enum class Stage : std::uint8_t { waiting, handed_over, accepted, refused, given_up };

/// The data that the spool stores for one call.
struct Entry {
  fabric::CallId call{};
  Stage stage = Stage::waiting;
  Mail mail{};
  /// When the call came.
  fabric::Time made{};
  std::uint32_t attempts = 0;
  /// Time of the next attempt, while the mail waits.
  fabric::Time next{};
  /// The last reply of the server, or the last error of the connection.
  std::string reply{};
  bool operator==(const Entry&) const = default;
};

}  // namespace millrace::services::mail
