// The outcome of one attempt to send. Pure.
#pragma once

#include <cstdint>
#include <string>

namespace millrace::services::mail {

enum class Verdict : std::uint8_t {
  /// The server has accepted the mail.
  accepted,
  /// Temporary failure: 4xx, or no contact. The server does not have the mail.
  later,
  /// Permanent failure: 5xx.
  refused,
  /// The connection is not safe, so nothing was sent to the server.
  insecure,
  /// The server refuses the login, or the password cannot be read.
  login,
  /// The mail was handed over without a reply: the server may have it.
  doubt,
};

struct Outcome {
  Verdict verdict = Verdict::later;
  /// The reply of the server, or the error of the connection.
  std::string reply{};
  /// The server was reachable.
  bool contact = true;
  /// The server was reachable, and then a timeout occurred.
  bool stalled = false;
  bool operator==(const Outcome&) const = default;
};

/// The error below SMTP.
enum class ConnectionError : std::uint8_t { none, no_contact, timeout, broken, tls, login };

/// What is known at the end of an attempt.
struct Exchange {
  ConnectionError trouble = ConnectionError::none;
  std::string trouble_text{};
  /// The last byte of the message was passed to the network.
  bool handed_over = false;
  /// Code and text of the last reply, and whether it came after the handover; 0 = none.
  int code = 0;
  std::string reply{};
  bool replied_after = false;
};

Outcome outcome_of(const Exchange& exchange);

}  // namespace millrace::services::mail
