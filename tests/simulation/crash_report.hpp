// A simulation that ends by an assertion or an invalid pointer still prints which one it was.
//
//   const CrashReport named("seed 17", "millrace-simulation --seed 17 --trace");
//   …                                    // SIGABRT, SIGSEGV: "seed 17 ends by SIGABRT; replay: …"
#pragma once

#include <string>

namespace millrace::tests::simulation {

/// While it exists, a fatal signal first writes these words to standard error. One at a time; the
/// signal handlers stay installed.
class CrashReport {
 public:
  /// The name of the simulation, and the command that repeats it.
  CrashReport(const std::string& what, const std::string& command);
  ~CrashReport();
  CrashReport(const CrashReport&) = delete;
  CrashReport& operator=(const CrashReport&) = delete;
};

}  // namespace millrace::tests::simulation
