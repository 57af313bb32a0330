// The report of a replay: differences as they are found, a summary, the exit code.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "tools/recording/statistics.hpp"
#include "tools/replay/comparison.hpp"

namespace millrace::tools::commands::replay {

// A progress line on the terminal.

/// Shows nothing if standard error is not a terminal.
class Progress {
 public:
  /// `total` 0 = unknown; `what` is the plural noun of the counted things.
  explicit Progress(std::size_t total, const char* what = "calls");
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Draws it, at most five times a second and not within the first second.
  void show(std::size_t done);
  /// Makes room for other output.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  std::size_t total_;
  const char* what_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_ + std::chrono::seconds(1);
};

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
