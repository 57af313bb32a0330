// A mail in delivery: its envelope and message, and its stage.
#pragma once

#include <cstdint>
#include <functional>
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

// The outcome of one attempt to send. Pure.

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

// The interface between the mail_sender and a mail server.

/// Functions may be called from any thread.
class Transport {
 public:
  virtual ~Transport() = default;

  struct Watch {
    /// Called once, before the last byte of the message is sent; false = do not send it.
    std::function<bool()> handing_over;
    /// Called periodically until then; true = cancel, the mail is sent later.
    std::function<bool()> cancelled;
  };

  /// Makes one attempt; returns when it has ended.
  virtual Outcome send(const Mail& mail, const Watch& watch) = 0;

 protected:
  Transport() = default;
  Transport(const Transport&) = default;
  Transport& operator=(const Transport&) = default;
};

}  // namespace millrace::services::mail
