// Rules for mails without a call: an NC program ended, a channel waits, a connection is down, a
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
  /// For kind program: the events.
  std::set<fabric::ProgramEventKind> events{};
  /// For the other kinds: how long the condition must last.
  std::chrono::nanoseconds after{};
  /// Canonical; the service without an instance.
  std::string uuid{};
  /// Empty = every machine.
  std::set<std::string> machines{};
  /// Names of recipients.
  std::vector<std::string> to{};
  Template subject;
  Template text;
  /// The shortest time between two mails about the same channel, machine or service.
  std::chrono::nanoseconds quiet{};
};

/// The keys that the subject and text of a rule may use.
const std::set<std::string>& rule_keys();

}  // namespace millrace::services::mail
