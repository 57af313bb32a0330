// A simulation that ends by an assertion or an invalid pointer still prints which one it was.
//
//   const LastWords named("seed 17", "millrace-simulation --seed 17 --trace");
//   …                                    // SIGABRT, SIGSEGV: "seed 17 ends by SIGABRT; replay: …"
#pragma once

#include <string>

namespace millrace::tests::simulation {

/// While it exists, a fatal signal first writes these words to standard error. One at a time; the
/// signal handlers stay installed.
class LastWords {
 public:
  /// The name of the simulation, and the command that repeats it.
  LastWords(const std::string& what, const std::string& command);
  ~LastWords();
  LastWords(const LastWords&) = delete;
  LastWords& operator=(const LastWords&) = delete;
};

}  // namespace millrace::tests::simulation
