// The report of a replay: differences as they are found, a summary, the exit code.
#pragma once

#include <array>
#include <cstdint>

#include "tools/commands/replay/progress.hpp"
#include "tools/recording/histogram.hpp"
#include "tools/replay/outcome.hpp"

namespace millrace::tools::commands::replay {

struct ReportOptions {
  tools::replay::Side side = tools::replay::Side::service;
  /// nullptr: nothing is compared.
  const tools::replay::Tolerances* tolerances = nullptr;
  bool json = false;
  /// Each call, not only those that failed.
  bool every = false;
  /// Calls have times that were to be kept.
  bool timed = true;
};

class Report {
 public:
  /// Both outlive the report.
  Report(const tools::replay::Plan& plan, ReportOptions options, Progress& progress)
      : plan_(plan), options_(options), progress_(progress) {}

  void add(const tools::replay::Outcome& outcome);
  /// The summary; returns the exit code. `reason`: why the replay ended before its end.
  int finish(const std::string& reason = {});

 private:
  void print_text(const tools::replay::Outcome& outcome,
                  const tools::replay::Judgement& judgement) const;
  void print_line(const tools::replay::Outcome& outcome,
                  const tools::replay::Judgement& judgement) const;
  [[nodiscard]] std::uint64_t count(tools::replay::Verdict verdict) const {
    return counts_.at(static_cast<std::size_t>(verdict));
  }

  const tools::replay::Plan& plan_;
  ReportOptions options_;
  Progress& progress_;
  std::array<std::uint64_t, tools::replay::verdict_count> counts_{};
  /// Of calls that did not wait for others.
  recording::Histogram late_;
  std::uint64_t held_up_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace millrace::tools::commands::replay
