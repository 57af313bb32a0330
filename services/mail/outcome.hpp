// What one attempt to send came to. Pure.
#pragma once

#include <cstdint>
#include <string>

namespace millrace::services::mail {

enum class Verdict : std::uint8_t {
  /// The server has taken the mail.
  accepted,
  /// Not for now: 4xx, or no contact. The server does not have it.
  later,
  /// Never: 5xx.
  refused,
  /// Nothing was said to the server because the connection is not safe.
  insecure,
  /// The server does not let this service in, or its password cannot be read.
  login,
  /// The mail was handed over and no answer came: the server may have it.
  doubt,
};

struct Outcome {
  Verdict verdict = Verdict::later;
  /// What the server said, or what went wrong on the way.
  std::string reply{};
  /// Whether the server was there at all.
  bool contact = true;
  /// It was, and then let the time run out.
  bool stalled = false;
  bool operator==(const Outcome&) const = default;
};

/// What went wrong below SMTP.
enum class Trouble : std::uint8_t { none, no_contact, timeout, broken, tls, login };

/// What is known when an attempt has ended.
struct Exchange {
  Trouble trouble = Trouble::none;
  std::string trouble_text{};
  /// The last byte of the message was given to the network.
  bool handed_over = false;
  /// Code and text of the last reply, and whether it came after that; 0 = none.
  int code = 0;
  std::string reply{};
  bool replied_after = false;
};

Outcome outcome_of(const Exchange& exchange);

}  // namespace millrace::services::mail
