#include "tests/simulation/crash_report.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstring>

#include <unistd.h>

namespace millrace::tests::simulation {

namespace {

struct Fatal {
  int number;
  const char* name;
};
constexpr std::array fatal_signals{Fatal{SIGABRT, "SIGABRT"}, Fatal{SIGSEGV, "SIGSEGV"},
                                   Fatal{SIGBUS, "SIGBUS"}, Fatal{SIGFPE, "SIGFPE"},
                                   Fatal{SIGILL, "SIGILL"}};

// Prepared for the signal handler, which allocates no memory and takes no lock.
std::array<char, 256> what{};
std::array<char, 256> command{};
std::atomic<bool> named = false;
std::array<struct sigaction, fatal_signals.size()> before{};
/// For signals from a stack overflow.
std::array<char, 16384> stack{};

void put(const char* text) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text, std::strlen(text));
}

void on_fatal_signal(int number) {
  for (std::size_t i = 0; i < fatal_signals.size(); ++i) {
    if (fatal_signals[i].number == number) {
      if (named) {
        put("\n");
        put(what.data());
        put(" ends by ");
        put(fatal_signals[i].name);
        put("\n  replay: ");
        put(command.data());
        put("\n");
      }
      // The cause raises the signal again: abort() by itself, an invalid pointer by its
      // instruction.
      ::sigaction(number, &before[i], nullptr);
    }
  }
}

bool listen() {
  stack_t other{};
  other.ss_sp = stack.data();
  other.ss_size = stack.size();
  ::sigaltstack(&other, nullptr);
  for (std::size_t i = 0; i < fatal_signals.size(); ++i) {
    struct sigaction action {};
    action.sa_handler = on_fatal_signal;
    action.sa_flags = SA_ONSTACK;
    ::sigaction(fatal_signals[i].number, &action, &before[i]);
  }
  return true;
}

void keep(std::array<char, 256>& where, const std::string& text) {
  const auto length = std::min(text.size(), where.size() - 1);
  std::copy_n(text.begin(), length, where.begin());
  where[length] = '\0';
}

}  // namespace

CrashReport::CrashReport(const std::string& of_what, const std::string& by_command) {
  [[maybe_unused]] static const bool listening = listen();
  keep(what, of_what);
  keep(command, by_command);
  named = true;
}

CrashReport::~CrashReport() {
  named = false;
}

}  // namespace millrace::tests::simulation
