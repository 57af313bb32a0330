// The history of one simulation: each fact is checked as it happens, and traced if a trace is
// wanted.
//
//   History history(agenda, [](const std::string& line) { std::puts(line.c_str()); });
//   history.add(Started{…});
//   history.violations();        // "I4: …, at 1.204 s"
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/simulation/history/fact.hpp"

namespace millrace::tests::simulation {

/// Checks one invariant, or a few that belong together.
class Check {
 public:
  virtual ~Check() = default;
  /// Returns a sentence for each violation.
  virtual std::vector<std::string> on(const Fact& fact, Time now) = 0;
  /// Called when all faults are over and everything has had its time.
  virtual std::vector<std::string> at_the_end() { return {}; }
};

class History {
 public:
  using Trace = std::function<void(const std::string& line)>;

  /// Without a trace it formats no lines.
  explicit History(Agenda& agenda, Trace trace = {});

  void add(const Fact& fact);
  void judge_the_end();
  void note(const std::string& who, const std::string& what);
  void violated(const std::string& sentence);
  [[nodiscard]] bool traced() const { return static_cast<bool>(trace_); }
  [[nodiscard]] const std::vector<std::string>& violations() const { return violations_; }

 private:
  void print(const std::string& line);

  Agenda& agenda_;
  Trace trace_;
  std::vector<std::unique_ptr<Check>> checks_;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
