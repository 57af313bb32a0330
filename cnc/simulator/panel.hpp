// The operator's panel of the virtual CNC: messages on standard output, reasons in the log, report
// files, and how the NC programs ended.
//
//   Panel panel(log, ReportFiles(folder));
//   panel.show({1, nc::MessageEvent{"part 7 done"}});     // [ch1] part 7 done
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "base/program/log.hpp"
#include "cnc/simulator/cycle.hpp"
#include "cnc/simulator/host_files.hpp"
#include "cnc/simulator/machine.hpp"

namespace millrace::cnc::simulator {

class Panel {
 public:
  /// With `keep_timings`, keeps the answered calls for print_timings().
  Panel(base::program::Log log, ReportFiles files, bool keep_timings);

  /// Fails with the reason if a report file is refused.
  tl::expected<void, std::string> show(const NcEvent& happening);
  /// For an NC program that could not be started.
  void show_mistakes(std::uint32_t channel, const std::vector<nc::Diagnostic>& mistakes);
  void remember(std::uint32_t channel, const AnsweredCall& call);

  /// Logs how punctual the interpolator's cycles were; a warning if any was late.
  void report_cycles(const CycleCounts& cycles) const;

  /// True if any NC program could not be started or was aborted.
  [[nodiscard]] bool failed() const { return failed_; }
  /// Prints "[ch1] call 1: 560aacbf-…: 1.23 ms" for each call, in the order of the responses.
  void print_timings() const;

 private:
  base::program::Log log_;
  ReportFiles files_;
  bool keep_timings_;
  bool failed_ = false;
  std::vector<std::pair<std::uint32_t, AnsweredCall>> calls_;
};

}  // namespace millrace::cnc::simulator
