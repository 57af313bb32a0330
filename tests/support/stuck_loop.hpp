// A program whose event loop hangs, while its other threads (those of DDS among them) go on: its
// main thread stands still as under a debugger.
//
//   {
//     const StuckLoop stuck(gateway);
//     …
//   }                                        // and goes on
#pragma once

#include <chrono>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>

#include <sys/ptrace.h>

#include "tests/support/process.hpp"

namespace millrace::tests {

/// To be used in one thread, which must not wait for the process meanwhile.
class StuckLoop {
 public:
  /// Returns when the thread stands still. Throws std::runtime_error if it may not be stopped.
  explicit StuckLoop(const Process& process) : thread_(process.pid()) {
    if (::ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) != 0 ||
        ::ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) != 0) {
      throw std::runtime_error("this test may not trace the process it has started (ptrace)");
    }
    const auto end = std::chrono::steady_clock::now() + patience;
    while (state() != 't') {
      if (std::chrono::steady_clock::now() > end) {
        throw std::runtime_error("the thread does not stop: " + std::string(1, state()));
      }
      std::this_thread::yield();
    }
  }
  ~StuckLoop() { ::ptrace(PTRACE_DETACH, thread_, nullptr, nullptr); }
  StuckLoop(const StuckLoop&) = delete;
  StuckLoop& operator=(const StuckLoop&) = delete;

 private:
  /// As proc(5) has it: 't' under a tracer.
  [[nodiscard]] char state() const {
    const std::string id = std::to_string(thread_);
    std::ifstream stat("/proc/" + id + "/task/" + id + "/stat");
    std::string line;
    std::getline(stat, line);
    const std::size_t name_end = line.rfind(')');
    return name_end + 2 < line.size() ? line[name_end + 2] : '?';
  }

  pid_t thread_;
};

}  // namespace millrace::tests
