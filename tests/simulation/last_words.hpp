// A simulation that ends by an assertion or a wild pointer still says which one it was.
//
//   const LastWords named("seed 17", "millrace-simulation --seed 17 --trace");
//   …                                    // SIGABRT, SIGSEGV: "seed 17 ends by SIGABRT; replay: …"
#pragma once

#include <string>

namespace millrace::tests::simulation {

/// While it lives, a fatal signal writes its words to standard error, and is then dealt with as
/// before. One at a time; the signal handlers stay.
class LastWords {
 public:
  /// What runs, and the command that repeats it.
  LastWords(const std::string& what, const std::string& command);
  ~LastWords();
  LastWords(const LastWords&) = delete;
  LastWords& operator=(const LastWords&) = delete;
};

}  // namespace millrace::tests::simulation
