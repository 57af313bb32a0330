// The meaning of an examination's findings, and the remedies. Pure.
#pragma once

#include <vector>

#include <boost/json/object.hpp>

#include "base/messages/message.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor {

enum class Severity : std::uint8_t {
  fine,
  /// Calls continue, but something needs attention.
  warning,
  /// Some call will not be answered, or some process is not visible.
  problem
};

/// "fine", "warning", "problem"
std::string_view name_of(Severity severity);

struct Diagnosis {
  Severity severity = Severity::fine;
  /// The problem: one sentence.
  base::messages::Message what{};
  /// The steps of the remedy; none if there is none.
  std::vector<base::messages::Message> todo{};
};

/// Sorted by urgency.
std::vector<Diagnosis> diagnose(const Findings& findings);

/// No problem among them; warnings are allowed.
bool is_healthy(const std::vector<Diagnosis>& diagnoses);

// The findings and diagnoses of an examination as JSON.

/// As `millrace doctor --json` prints it.
boost::json::object json_of(const Findings& found, const std::vector<Diagnosis>& diagnoses);

}  // namespace millrace::tools::doctor
