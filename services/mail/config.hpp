// Reads and checks mail.textproto (schema and defaults: idl/mail.proto).
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/data.hpp"
#include "fabric/plant/concern.hpp"
#include "services/mail/message.hpp"
#include "services/mail/template.hpp"

namespace millrace::services::mail {

enum class Security : std::uint8_t {
  /// No encryption, and no login.
  none,
  /// Plain SMTP until both sides have agreed on TLS, before any other command.
  starttls,
  /// TLS from the first byte.
  tls
};

struct ServerConfig {
  std::string host{};
  std::uint16_t port = 587;
  Security security = Security::starttls;
  /// Empty = the system's.
  std::filesystem::path ca_file{};
  /// Empty = no login. Otherwise one of the next two is set.
  std::string user{};
  std::filesystem::path password_file{};
  std::string password_env{};
  std::chrono::milliseconds timeout{60000};
};

struct RetryPolicy {
  std::chrono::milliseconds first{10000};
  std::chrono::milliseconds longest{900000};
  std::chrono::hours give_up{72};
};

struct MailTemplate {
  /// Names of recipients.
  std::vector<std::string> to;
  Template subject;
  Template text;
};

/// A mail without a call: an event of an NC program, or what needs attention (idl/mail.proto,
/// Rule).
struct Rule {
  enum class Kind : std::uint8_t { program, concern, no_instance };

  std::string name{};
  Kind kind = Kind::program;
  /// For kind program: the events.
  std::set<fabric::ProgramEventKind> events{};
  /// For kind concern: the least level, and the kinds; empty = all.
  fabric::plant::Level least = fabric::plant::Level::act;
  std::set<fabric::plant::Kind> kinds{};
  /// For the other kinds: how long the cause must last.
  std::chrono::nanoseconds after{};
  /// Canonical; the service without an instance.
  std::string uuid{};
  /// Empty = every machine.
  std::set<std::string> machines{};
  /// Names of recipients.
  std::vector<std::string> to{};
  Template subject;
  Template text;
  /// The shortest time between two mails about the same channel or cause.
  std::chrono::nanoseconds quiet{};
};

/// The keys that the subject and text of a rule may use.
const std::set<std::string>& rule_keys();

struct Config {
  ServerConfig server;
  Address from;
  std::map<std::string, std::vector<Address>, std::less<>> recipients;
  std::map<std::string, MailTemplate, std::less<>> templates;
  std::vector<Rule> rules;
  /// Absolute.
  std::filesystem::path spool;
  RetryPolicy retry;
  /// Time in which a repeated call sends no second mail.
  std::chrono::hours remember{30 * 24};
};

/// The error has one line per mistake, with file, line and column.
tl::expected<Config, std::string> load(const std::filesystem::path& file);

/// The server's current password; empty without login. The error contains what to correct.
tl::expected<std::string, std::string> password(const ServerConfig& server);

}  // namespace millrace::services::mail
