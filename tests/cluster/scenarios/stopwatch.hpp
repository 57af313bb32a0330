// Measures and prints a number that the project promises.
#pragma once

#include <chrono>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace millrace::tests::cluster {

class Stopwatch {
 public:
  using Seconds = std::chrono::duration<double>;

  [[nodiscard]] Seconds time() const { return std::chrono::steady_clock::now() - start_; }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// "measured: take-over after a kill 0.512 s", also into the test's XML report.
inline void report(const std::string& what, Stopwatch::Seconds time) {
  const std::string text = fmt::format("{:.3f} s", time.count());
  fmt::print("measured: {} {}\n", what, text);
  testing::Test::RecordProperty(what, text);
}

}  // namespace millrace::tests::cluster
