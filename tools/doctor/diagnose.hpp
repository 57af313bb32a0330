// What an examination's findings mean, and what to do. Pure.
#pragma once

#include <string>
#include <vector>

#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor {

enum class Severity : std::uint8_t {
  fine,
  /// Calls go on, but something is not as it should be.
  warning,
  /// Some call will not be answered, or some program not be seen.
  problem
};

/// "fine", "warning", "problem"
std::string_view name_of(Severity severity);

struct Diagnosis {
  Severity severity = Severity::fine;
  /// What is the matter: one sentence.
  std::string what{};
  /// What to do about it; empty if there is nothing to do.
  std::string advice{};
};

/// In the order in which somebody should look at them.
std::vector<Diagnosis> diagnose(const Findings& findings);

/// No problem among them; warnings are allowed.
bool is_healthy(const std::vector<Diagnosis>& diagnoses);

}  // namespace millrace::tools::doctor
