// Reads and checks mail.textproto (schema and defaults: idl/mail.proto).
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "services/mail/message.hpp"
#include "services/mail/rule.hpp"
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
  std::chrono::milliseconds connect_timeout{10000};
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
