// A program whose event loop hangs while its other threads, those of DDS included, go on: the
// thread of the loop stands still as under a debugger. It is the main thread, or in a service the
// one named "loop".
//
//   {
//     const StuckLoop stuck(gateway);        // or (service, "loop")
//     …
//   }                                        // it continues
#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>

#include <sys/ptrace.h>

#include "tests/support/process.hpp"

namespace millrace::tests {

/// To be used in one thread, which must not wait for the process while the loop hangs.
class StuckLoop {
 public:
  /// Returns when the thread stands still. Throws std::runtime_error if it may not be stopped.
  explicit StuckLoop(const Process& process, const std::string& thread = {})
      : process_(process.pid()), thread_(thread.empty() ? process_ : find(thread)) {
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
    std::ifstream stat(tasks() / std::to_string(thread_) / "stat");
    std::string line;
    std::getline(stat, line);
    const std::size_t name_end = line.rfind(')');
    return name_end + 2 < line.size() ? line[name_end + 2] : '?';
  }

  [[nodiscard]] std::filesystem::path tasks() const {
    return std::filesystem::path("/proc") / std::to_string(process_) / "task";
  }
  /// Waits until the process has a thread of this name.
  [[nodiscard]] pid_t find(const std::string& name) const {
    const auto end = std::chrono::steady_clock::now() + patience;
    do {
      for (const auto& task : std::filesystem::directory_iterator(tasks())) {
        std::ifstream comm(task.path() / "comm");
        std::string line;
        if (std::getline(comm, line) && line == name) {
          return std::stoi(task.path().filename());
        }
      }
      std::this_thread::yield();
    } while (std::chrono::steady_clock::now() < end);
    throw std::runtime_error("the process has no thread called " + name);
  }

  pid_t process_;
  pid_t thread_;
};

}  // namespace millrace::tests
