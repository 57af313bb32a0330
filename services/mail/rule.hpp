// What mails are sent for without a call: a program ended, a channel waits, a link is down, a
// service has no instance (idl/mail.proto, Rule).
#pragma once

#include <chrono>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "fabric/data.hpp"
#include "services/mail/template.hpp"

namespace millrace::services::mail {

struct Rule {
  enum class Kind : std::uint8_t { program, waits, link_down, no_instance };

  std::string name{};
  Kind kind = Kind::program;
  /// Of programs: which events.
  std::set<fabric::ProgramEventKind> events{};
  /// Of the others: how long it must be so.
  std::chrono::nanoseconds after{};
  /// Canonical; of the service that has no instance.
  std::string uuid{};
  /// Empty = every machine.
  std::set<std::string> machines{};
  /// Names of recipients.
  std::vector<std::string> to{};
  Template subject;
  Template text;
  /// Between two mails about the same channel, machine or service.
  std::chrono::nanoseconds quiet{};
};

/// What the subject and text of a rule may name.
const std::set<std::string>& rule_keys();

}  // namespace millrace::services::mail
